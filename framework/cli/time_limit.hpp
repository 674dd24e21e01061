// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The option --time-limit, for the program and its modules.
#pragma once

#include "config/diagnostics.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>

#include <string>

namespace tofgraph::cli {

/// Reads a time limit as it is written on the command line. @returns s, above 0
/// @throws config::ConfigurationError no time, or none above 0
inline double parse_time_limit(const std::string& text) {
  const config::Quantity limit = config::parse_quantity(text, "s");
  if (limit.ok() && limit.value > 0) return limit.value;
  throw config::ConfigurationError(fmt::format("--time-limit: error: '{}' {}\n         example: --time-limit '5 min'",
                                               text, limit.ok() ? "must be greater than 0" : limit.problem));
}

}  // namespace tofgraph::cli
