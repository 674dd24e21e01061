// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Facts about a capture that checks need, without its images; a statistics file keeps those of its capture.
#pragma once

#include "io/captures/capture.hpp"

#include <filesystem>

namespace tofgraph::io {

struct CaptureFacts {
  CaptureHeader header;
  std::uint64_t frames = 0;
  tofgraph_metadata first{};    ///< metadata of frame 0; NaN where there is none or it is unknown
  std::uint64_t exposures = 0;  ///< of a frame's taps or phases; 0: it has neither
};

CaptureFacts facts_of(const CaptureReader& capture);

/// Facts of a capture, or of the capture that a statistics file was made from.
/// @throws std::runtime_error when it cannot be read
CaptureFacts read_facts(const std::filesystem::path& file);

}  // namespace tofgraph::io
