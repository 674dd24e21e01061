// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Settings of the decoder of any exposures for all pixels of a frame.
#pragma once

#include <array>
#include <vector>

#include "plugins/filters/decoder.hpp"

namespace tofgraph {

constexpr std::size_t max_bands = 3;

/// The exposures of one frequency; see physics::PhaseFit. The rows of what the fit leaves are one after the other.
struct Band {
  std::vector<std::size_t> image;
  std::vector<float> cosine, sine, rest;
  float xx, xy, yy;
};

/// Constants of all pixels of a frame.
struct PhaseSettings {
  std::array<float, max_bands> metres_per_radian, range, inverse_range;  // of each band, lowest frequency first
  DecoderCounts counts;
  float any_variance;                // of a sample, where the noise is not known: weights need a scale
  float phase_variance;              // rad^2, of systematic errors
  float wrapped_below;               // chi-square between the best and the second best wraps
  float steepest;                    // rad^2: no wrap can be told with more variance of the phase
  float rest_above, disagree_above;  // chi-square of the samples' rest, and of the frequencies
  float wrong_above;                 // of the frequencies: none of the wraps within max_range is right
  int first_wrap, last_wrap;         // of the highest frequency
  float repeat;                      // m: distances repeat; 0: where max_range ends them
  float max_range, margin;           // m, standard deviations; infinity: none
  float intensity_scale;             // 1 / number of taps
  float each;                        // 1 / number of bands
  const Band* bands;
};

}  // namespace tofgraph
