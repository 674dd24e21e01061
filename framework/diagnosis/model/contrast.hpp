// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Contrast of the demodulation, a / 2I, as the taps of a campaign show it beside a model.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <optional>
#include <string>

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

}  // namespace tofgraph::diagnosis
