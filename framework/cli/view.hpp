// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The live view of a pipeline that was written without one.
#pragma once

#include "cli/commands.hpp"

#include <cstdint>

namespace tofgraph::cli {

struct ViewOptions {
  std::uint32_t port = 8765;  ///< 0: a free one
  bool hold = false;          ///< the view stays after the last frame
  bool recorded = false;      ///< waits for the first client, and runs at most at 30 Hz
};

/// The pipeline with a sink `live_view` that reads every node but the sinks. One that has such a sink stays as it is.
config::Value with_view(config::Value document, const ViewOptions& options, const Common& common);

}  // namespace tofgraph::cli
