// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Whether the values of an effect say anything.
#pragma once

#include "diagnosis/validation.hpp"

#include <optional>
#include <span>
#include <string>

namespace tofgraph::diagnosis {

/// Why the values of a term say nothing.
struct Silence {
  std::string why;                   ///< empty: they say something
  std::optional<std::size_t> shape;  ///< of its parameters, that may be anything, or is at its limit
  bool at_limit = false;             ///< it is the latter
};

/// What a reader is told where a shape is as good as at the least that it may be: one that may be much more than is
/// typical, as what can be from none to all is at its ends by itself. Else "".
std::string limit_of(const FreeParameter& p, double value);

/// A shape that may be anything, or went to the least that it may be and says nothing there, as a warm-up of a second,
/// which is an offset; or sizes that may as well be off, each of them and all together.
/// @param all intervals of the parameters of all terms @param lack_of_fit chi-square over its expectation
Silence silence_of(const Fit& fit, std::size_t term, std::span<const Interval> all, double lack_of_fit);

}  // namespace tofgraph::diagnosis
