// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A campaign as jobs of an engine that is there already: the scripts of a job folder, with what each task takes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::cli {

struct BatchArguments {
  std::string campaign, model, engine = "slurm", out;
  std::vector<std::filesystem::path> plugin_path;  ///< those of --plugin-path
  std::size_t shards = 0;                          ///< 0: by the measured time
  std::size_t confidence = 0;                      ///< injected cases
  unsigned threads = 1;                            ///< of a task
  bool submit = false, status = false, force = false, quiet = false;
};

/// Cost of reducing one condition, measured.
struct TaskCost {
  double seconds = 0;       ///< of one condition
  double bytes = 0;         ///< of its capture
  double memory_bytes = 0;  ///< peak of the process
};

/// Reduces the first condition into a scratch folder in a process of its own. @param conditions of the campaign
/// @throws std::runtime_error when that fails
TaskCost measured_cost(const BatchArguments& arguments, std::size_t conditions, const std::filesystem::path& scratch);

/// Writes a job folder. @throws config::ConfigurationError for a campaign, a model or a folder that cannot be used
int make_job(const BatchArguments& arguments);

/// Runs a script of a job folder. @returns its exit code
int run_job_script(const BatchArguments& arguments, const std::string& script);

}  // namespace tofgraph::cli
