// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Request of `tofgraph run`.
#pragma once

#include "cli/commands.hpp"

#include <cstdint>
#include <string>

namespace tofgraph::cli {

struct RunArguments : PipelineArguments {
  std::uint64_t frames = 0;  ///< maximum; 0: all
  unsigned threads = 0;      ///< 0: one per core
  std::string stats, time_limit;
  std::string campaign, out;  ///< campaign file and folder of its results; empty: single run
  bool force = false, validate = false;
  bool safe = false;       ///< without third-party plugins
  bool view = false;       ///< with a live view of every node
  bool untrusted = false;  ///< within the limits for untrusted pipelines
};

/// Runs a pipeline once, with all messages and files of `tofgraph run`.
/// @param document the pipeline, instead of that in the arguments
/// @returns the exit code @throws config::ConfigurationError for errors before the first frame
int run_once(const config::Value& document, const RunArguments& arguments, const Common& common);

/// Runs the pipeline on every condition of the campaign, one after the other in this process.
/// @returns the exit code @throws config::ConfigurationError for errors before the first frame
int run_campaign(const RunArguments& arguments, const Common& common);

}  // namespace tofgraph::cli
