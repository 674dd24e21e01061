// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Maps that were found on superpixels, at the resolution of the pixels: the difference of each pixel from its
/// superpixel is estimated from the frames, by least squares over the conditions, and shrunk by its uncertainty.
#pragma once

#include "diagnosis/data/ingest.hpp"
#include "diagnosis/model/fit.hpp"

#include <memory>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

struct PixelMap {
  std::string effect, dataset, unit;
  std::vector<double> values;  ///< height x width, SI
  double spread = 0;           ///< standard deviation of pixels about their superpixel, without noise; SI
  double noise = 0;            ///< median standard deviation of the estimates before shrinking, SI; NaN: none
};

/// @param measurements from captures, which are read again
/// @param state all parameters, with the maps of superpixels
/// @throws std::runtime_error if a capture can no longer be read
std::vector<PixelMap> pixel_maps(const Measurements& measurements, const Problem& problem, const State& state);

// ---- Effects of the setup that a map of the pixels could absorb ----

/// "These conditions cannot distinguish board_tilt from the map of fixed_pattern: ..", for each effect of the setup
/// that the author of a map in the model lists as confused with it, and that the data do not determine to within its
/// typical value when fitted with the map. @param candidates effects that the model may lack
std::vector<std::string> notes_on_pattern_ties(const Problem& problem, const ModelFit& fit,
                                               const std::vector<std::unique_ptr<Candidate>>& candidates);

}  // namespace tofgraph::diagnosis
