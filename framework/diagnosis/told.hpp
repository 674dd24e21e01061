// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Whether the values of an effect say anything.
#pragma once

#include "diagnosis/validation.hpp"

#include <span>
#include <string>

namespace tofgraph::diagnosis {

/// What untold() says of sizes.
inline constexpr const char* may_be_off = "all of its sizes may as well be off";

/// Why the values of a term say nothing, or nothing: a shape that may be anything, or sizes that may as well be off,
/// each of them and all together.
/// @param all intervals of the parameters of all terms @param lack_of_fit chi-square over its expectation
std::string untold(const Fit& fit, std::size_t term, std::span<const Interval> all, double lack_of_fit);

}  // namespace tofgraph::diagnosis
