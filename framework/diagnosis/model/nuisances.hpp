// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Nuisances that conditions share: a drift of the camera's distances and of the light while the
/// conditions were measured, offsets from one session to the next, and a contrast that is not the profile's.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/model/mixed_model.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Unknowns with a normal prior around zero, whose standard deviation is estimated but for that of the contrast.
struct Nuisances {
  std::vector<std::vector<Shared>> of_condition;            ///< one a condition
  std::vector<double RandomEffectSd::*> sd;                 ///< one an unknown: that of its prior
  double jitter = std::numeric_limits<double>::infinity();  ///< m, see Design::jitter()
};

/// A constant and half waves over the order measured where all conditions tell it, k of them with 1 / k of the standard
/// deviation as those of a random walk have; an offset and a factor of light for each session where there are several.
/// @param contrast whether that is an unknown, too: see shows_another_contrast()
Nuisances nuisances_of(const Design& design, bool contrast = false);

/// Root mean square over the conditions of a drift with a standard deviation of its first wave.
double drift_of(const Design& design, double sd);

// ---- Contrast of the demodulation, a / 2I, as the taps of a campaign show it beside a model ----

struct Problem;
struct State;

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
