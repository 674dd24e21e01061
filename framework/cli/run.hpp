// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The request of `tofgraph run`.
#pragma once

#include "cli/commands.hpp"

#include <cstdint>
#include <string>

namespace tofgraph::cli {

struct RunArguments : PipelineArguments {
  std::uint64_t frames = 0;  ///< at most; 0: all
  unsigned threads = 0;      ///< 0: one per core
  std::string stats, time_limit;
  std::string campaign, out;  ///< a campaign file and the folder of its results; empty: one run
  bool force = false, validate = false;
  bool safe = false;       ///< without plugins of others
  bool view = false;       ///< with a live view of every node
  bool untrusted = false;  ///< within the limits for pipelines of others
};

/// Runs a pipeline once, with everything that `tofgraph run` says and writes.
/// @param document the pipeline, instead of that of the arguments
/// @returns the exit code @throws config::ConfigurationError what is wrong before the first frame
int run_once(const config::Value& document, const RunArguments& arguments, const Common& common);

/// Runs the pipeline on every condition of the campaign, one after the other in this process.
/// @returns the exit code @throws config::ConfigurationError what is wrong before the first frame
int run_campaign(const RunArguments& arguments, const Common& common);

}  // namespace tofgraph::cli
