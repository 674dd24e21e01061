// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Values of channels and parameters.
#pragma once

#include "conformance/trial.hpp"

#include <random>

namespace tofgraph::conformance {

/// Fills a channel with values of its kind: lengths in m, counts, flags. Equal seeds give equal values, and the
/// channels of one frame have the same invalid pixels.
void fill(tofgraph_frame::Channel& channel, const io::CameraPtr& camera, std::uint64_t seed, Content content);

/// Random value within the bounds of a parameter, as written in a pipeline; empty: not possible.
std::string random_value(const tofgraph_parameter& parameter, std::mt19937_64& random);
/// Values at the bounds.
std::vector<std::string> bounds_of(const tofgraph_parameter& parameter);
/// Values outside the bounds or of other kinds, all of which must be rejected.
std::vector<std::string> wrong_values(const tofgraph_parameter& parameter);

}  // namespace tofgraph::conformance
