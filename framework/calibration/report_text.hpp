// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Number formats of the reports.
#pragma once

#include "calibration/interval.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace tofgraph::calibration {

/// Millimetres without their unit; `-` for unknown values.
inline std::string mm(double metres, int digits = 2) {
  return std::isfinite(metres) ? fmt::format("{:.{}f}", metres * 1e3, digits) : "-";
}

/// `1.40 (0.83 to 1.87)` mm, or only the value.
inline std::string interval_mm(const Interval& i, int digits = 2) {
  if (!std::isfinite(i.low)) return mm(i.value, digits);
  return fmt::format("{} ({} to {})", mm(i.value, digits), mm(i.low, digits), mm(i.high, digits));
}

}  // namespace tofgraph::calibration
