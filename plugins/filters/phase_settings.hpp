// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Settings of the decoder for arbitrary exposures, for all pixels of a frame.
#pragma once

#include <array>
#include <vector>

#include "plugins/filters/decoder.hpp"

namespace tofgraph {

constexpr std::size_t max_bands = 3;

/// Exposures of one frequency; see physics::PhaseFit. The residual rows of the fit are stored consecutively.
struct Band {
  std::vector<std::size_t> image;
  std::vector<float> cosine, sine, rest;
  float xx, xy, yy;
};

/// Constants of all pixels of a frame.
struct PhaseSettings {
  std::array<float, max_bands> metres_per_radian, range, inverse_range;  // of each band, in ascending frequency
  DecoderCounts counts;
  float any_variance;                // variance of a sample if the noise is unknown: the weights need a scale
  float phase_variance;              // rad^2, due to systematic errors
  float wrapped_below;               // difference of chi-square between the best and the second best wraps
  float steepest;                    // rad^2: with a larger variance of the phase, wraps cannot be determined
  float rest_above, disagree_above;  // chi-square of the samples' residuals, and between the frequencies
  float wrong_above;                 // between the frequencies: none of the wraps within max_range is right
  int first_wrap, last_wrap;         // of the highest frequency
  float repeat;                      // m: distances repeat; 0: limited by max_range instead
  float max_range, margin;           // m, standard deviations; infinity: none
  float intensity_scale;             // 1 / number of taps
  float each;                        // 1 / number of bands
  const Band* bands;
};

}  // namespace tofgraph
