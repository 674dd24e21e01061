// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Plausibility of the content of a capture; the limits are those of io/plausibility.hpp.
#pragma once

#include "io/captures/capture.hpp"

#include <string>
#include <vector>

namespace tofgraph::io {

/// Doubts about the settings and clocks of the frames first to last, and about the lengths of the first frame, one
/// sentence per quantity. Simulated ground truth is not examined. @param camera of the frames; may be null
/// @throws std::runtime_error if the first frame cannot be read
std::vector<std::string> doubts_of(const CaptureReader& capture, std::size_t first, std::size_t last,
                                   const tofgraph_camera* camera);

}  // namespace tofgraph::io
