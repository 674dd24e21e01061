// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Contrast of the demodulation, a / 2I, as the taps of a campaign show it beside a model.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/model/fit.hpp"
#include "diagnosis/model/linearisation.hpp"
#include "diagnosis/model/nuisances.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

struct MeasuredContrast {
  double profile = 0, value = 0;
  double low = 0, high = 0;  ///< 95 % interval of the value

  /// By more than the interval and 1 %.
  bool profile_is_off() const;
  /// "0.470 +- 0.001"
  std::string text() const;
};

/// Nothing where no intensities are known. @param lack_of_fit chi-square over its expectation
std::optional<MeasuredContrast> contrast_of(const Problem& problem, const State& state, double lack_of_fit);

// ---- Decision whether a search estimates the contrast ----

/// True if the ratio of amplitude to intensity shows a contrast that differs from the profile's by more than 1 %,
/// consistently over the brighter half of the conditions, where ambient light matters least.
bool shows_another_contrast(const Design& design, const std::vector<Observations>& data);

inline bool has_contrast(const Nuisances& nuisances) {
  return std::ranges::find(nuisances.sd, &RandomEffectSd::contrast) != nuisances.sd.end();
}

/// ln of how much lower than the profile's the contrast is, if it is an unknown of a problem.
double log_lower_contrast(const Problem& problem, const State& state);

}  // namespace tofgraph::diagnosis
