// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Runs a campaign as jobs of an existing batch engine: writes a folder of scripts with their requests.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::cli {

struct BatchArguments {
  std::string campaign, model, engine = "slurm", out;
  std::vector<std::filesystem::path> plugin_path;  ///< from --plugin-path
  std::size_t shards = 0;                          ///< 0: chosen from the measured time
  std::size_t confidence = 0;                      ///< injected cases
  unsigned threads = 1;                            ///< per task
  bool submit = false, status = false, force = false, quiet = false;
};

/// Measured cost of reducing one condition.
struct TaskCost {
  double seconds = 0;       ///< of one condition
  double bytes = 0;         ///< of the condition's capture
  double memory_bytes = 0;  ///< peak of the process
};

/// Reduces the first condition in a scratch folder and a separate process. @param conditions of the campaign
/// @throws std::runtime_error on failure
TaskCost measured_cost(const BatchArguments& arguments, std::size_t conditions, const std::filesystem::path& scratch);

/// Writes a job folder. @throws config::ConfigurationError if the campaign, model or folder is unusable
int make_job(const BatchArguments& arguments);

/// Runs a script of a job folder. @returns its exit code
int run_job_script(const BatchArguments& arguments, const std::string& script);

}  // namespace tofgraph::cli
