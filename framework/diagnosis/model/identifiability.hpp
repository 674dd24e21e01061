// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Identifiability of the values of an effect.
#pragma once

#include "diagnosis/model/validation.hpp"

#include <optional>
#include <span>
#include <string>

namespace tofgraph::diagnosis {

/// Why the values of a term say nothing.
struct Unidentified {
  std::string why;                       ///< empty: they say something
  std::optional<std::size_t> nonlinear;  ///< of its parameters, that may be anything, or is at its limit
  bool at_limit = false;                 ///< it is the latter
};

/// Message for a nonlinear parameter that is practically at its minimum: one that may be much more than is
/// typical, as what can be from none to all is at its ends by itself. Else "".
std::string limit_of(const FreeParameter& p, double value);

/// A shape that may be anything, or went to the least that it may be and says nothing there, as a warm-up of a second,
/// which is an offset; or sizes that may as well be off, each of them and all together.
/// @param all intervals of the parameters of all terms @param lack_of_fit chi-square over its expectation
Unidentified identifiability_of(const ModelFit& fit, std::size_t term, std::span<const Interval> all,
                                double lack_of_fit);

}  // namespace tofgraph::diagnosis
