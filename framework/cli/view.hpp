// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Live view of a pipeline that has no sink for one.
#pragma once

#include "cli/commands.hpp"

#include <cstdint>

namespace tofgraph::cli {

struct ViewOptions {
  std::uint32_t port = 8765;  ///< 0: any free port
  bool hold = false;          ///< the view stays after the last frame
  bool recorded = false;      ///< waits for the first client and runs at 30 Hz at most
};

/// Adds a sink `live_view` that reads every node except sinks. A pipeline that already has one is left unchanged.
config::Value with_view(config::Value document, const ViewOptions& options, const Common& common);

}  // namespace tofgraph::cli
