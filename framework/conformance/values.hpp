// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Values of channels and parameters.
#pragma once

#include "conformance/trial.hpp"

#include <random>

namespace tofgraph::conformance {

/// Fills a channel with values of its kind: lengths in m, counts, flags. The same seed gives the same values, and
/// channels of one frame agree on which pixels are invalid.
void fill(tofgraph_frame::Channel& channel, const io::CameraPtr& camera, std::uint64_t seed, Content content);

/// A value within the bounds of a parameter as it is written in a pipeline; empty: none can be made up.
std::string random_value(const tofgraph_parameter& parameter, std::mt19937_64& random);
/// The values at its bounds.
std::vector<std::string> bounds_of(const tofgraph_parameter& parameter);
/// Values beyond its bounds, and of other kinds: none may be taken.
std::vector<std::string> wrong_values(const tofgraph_parameter& parameter);

}  // namespace tofgraph::conformance
