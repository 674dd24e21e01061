// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The option --time-limit, for the program and its modules.
#pragma once

#include "config/diagnostics.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>

#include <string>

namespace tofgraph::cli {

/// Parses a time limit of the command line. @returns s, above 0
/// @throws config::ConfigurationError if it is not a time above 0
inline double parse_time_limit(const std::string& text) {
  const config::Quantity limit = config::parse_quantity(text, "s");
  if (limit.ok() && limit.value > 0) return limit.value;
  throw config::ConfigurationError(fmt::format("--time-limit: error: '{}' {}\n         example: --time-limit '5 min'",
                                               text, limit.ok() ? "must be greater than 0" : limit.problem));
}

}  // namespace tofgraph::cli
