// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Nuisances that conditions share: drift of the camera's distances and of the light during the campaign, offsets
/// between sessions, and a contrast that differs from the profile's.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/model/mixed_model.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Unknowns with a zero-mean normal prior, whose standard deviation is estimated, except that of the contrast.
struct Nuisances {
  std::vector<std::vector<Shared>> of_condition;            ///< one per condition
  std::vector<double RandomEffectSd::*> sd;                 ///< one per unknown: of its prior
  double jitter = std::numeric_limits<double>::infinity();  ///< m, see Design::jitter()
};

/// Drift, if all conditions state their order: a constant and half cosines over it, the k-th with 1 / k of the standard
/// deviation, as in a random walk. An offset and a factor of light per session, if there are several.
/// @param contrast true: an unknown, too, see shows_another_contrast()
Nuisances nuisances_of(const Design& design, bool contrast = false);

/// Root mean square over the conditions of a drift. @param sd standard deviation of its first half cosine
double drift_of(const Design& design, double sd);

// ---- Contrast of the demodulation, a / 2I, estimated from the taps of a campaign together with a model ----

struct Problem;
struct State;

struct MeasuredContrast {
  double profile = 0, value = 0;
  double low = 0, high = 0;  ///< 95 % interval of the value

  /// True if the profile's contrast is outside the interval and differs by more than 1 %.
  bool profile_is_off() const;
};

/// Contrast given a model; nullopt without intensities. @param lack_of_fit chi-square over its expectation
std::optional<MeasuredContrast> contrast_of(const Problem& problem, const State& state, double lack_of_fit);

// ---- Decision whether a search estimates the contrast ----

/// True if the ratio of amplitude to intensity differs from the profile's contrast by more than 1 %, consistently over
/// the brighter half of the conditions, where ambient light matters least.
bool shows_another_contrast(const Design& design, const std::vector<Observations>& data);

inline bool has_contrast(const Nuisances& nuisances) { return contains(nuisances.sd, &RandomEffectSd::contrast); }

/// ln of the profile's contrast over the estimated one, for a problem that has it as an unknown.
double log_lower_contrast(const Problem& problem, const State& state);

}  // namespace tofgraph::diagnosis
