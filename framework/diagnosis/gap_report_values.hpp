// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Numbers as the gap report shows them.
#pragma once

#include "diagnosis/fit.hpp"

#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Lengths in mm, what is relative in percent.
std::string shown(double value, std::size_t observable);
double scaled(double value, std::size_t observable);
std::string unit_of(std::size_t observable);
std::string label(std::size_t observable);

/// Measurement minus a model, condition by condition, superpixel by superpixel; NaN where nothing is known.
using Residuals = std::vector<std::vector<double>>;
Residuals residuals(const Problem& problem, const State& state, std::size_t observable);

/// Of those that are finite; NaN when none is.
double mean(const std::vector<double>& values);

}  // namespace tofgraph::diagnosis
