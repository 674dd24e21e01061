// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Properties of a capture that checks need, without its images; a statistics file stores those of its capture.
#pragma once

#include "io/captures/capture.hpp"
#include "io/condition.hpp"

namespace tofgraph::io {

struct CaptureFacts {
  CaptureHeader header;
  std::uint64_t frames = 0;
  tofgraph_metadata first{};    ///< metadata of the first used frame; NaN if there is none or it is unknown
  std::uint64_t exposures = 0;  ///< taps or phases per frame; 0: it has neither
};

/// @param condition whose frames are used
CaptureFacts facts_of(const CaptureReader& capture, const Condition& condition);

/// Properties of a condition's capture, or of the capture from which its statistics file was computed.
/// @throws std::runtime_error if it cannot be read
CaptureFacts read_facts(const Condition& condition);

}  // namespace tofgraph::io
