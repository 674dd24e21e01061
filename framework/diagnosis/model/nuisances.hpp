// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Nuisances that conditions share: a drift of the camera's distances and of the light while the
/// conditions were measured, offsets from one session to the next, and a contrast that is not the profile's.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/model/mixed_model.hpp"

#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Unknowns with a normal prior around zero, whose standard deviation is estimated but for that of the contrast.
struct Nuisances {
  std::vector<std::vector<Shared>> of_condition;  ///< one a condition
  std::vector<double RandomEffectSd::*> sd;       ///< one an unknown: that of its prior
};

/// A constant and half waves over the order measured where all conditions tell it, k of them with 1 / k of the standard
/// deviation as those of a random walk have; an offset and a factor of light for each session where there are several.
/// @param contrast whether that is an unknown, too: see shows_another_contrast()
Nuisances nuisances_of(const Design& design, bool contrast = false);

/// Root mean square over the conditions of a drift with a standard deviation of its first wave.
double drift_of(const Design& design, double sd);

}  // namespace tofgraph::diagnosis
