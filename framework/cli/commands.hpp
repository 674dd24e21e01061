// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The commands: each adds itself to the command line and stores its exit code.
#pragma once

#include "config/log.hpp"
#include "graph/graph.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace tofgraph::cli {

using config::print_message;

inline constexpr int done = 0, failed = 1, wrong_usage = 2, interrupted = 130;

/// Options common to all commands.
struct Common {
  bool quiet = false;
  bool verbose = false;
  std::vector<std::filesystem::path> plugin_folders;
  std::vector<std::filesystem::path> plugin_path;  ///< from --plugin-path
  std::function<int()> command;                    ///< of the chosen command
};

void add_run(CLI::App& app, Common& common);
void add_check(CLI::App& app, Common& common);
void add_explain(CLI::App& app, Common& common);
void add_list(CLI::App& app, Common& common);
void add_describe(CLI::App& app, Common& common);
void add_simulate(CLI::App& app, Common& common);
void add_gallery(CLI::App& app, Common& common);
void add_info(CLI::App& app, Common& common);
void add_record(CLI::App& app, Common& common);
void add_repair(CLI::App& app, Common& common);
void add_devices(CLI::App& app, Common& common);
void add_calibrate(CLI::App& app, Common& common);
void add_report(CLI::App& app, Common& common);
void add_diagnose(CLI::App& app, Common& common);
void add_evaluate(CLI::App& app, Common& common);
void add_reduce(CLI::App& app, Common& common);
void add_merge(CLI::App& app, Common& common);
void add_batch(CLI::App& app, Common& common);
void add_convert(CLI::App& app, Common& common);
void add_inspect(CLI::App& app, Common& common);
void add_camera(CLI::App& app, Common& common);
void add_pose(CLI::App& app, Common& common);
void add_plugin(CLI::App& app, Common& common);
void add_view(CLI::App& app, Common& common);
void add_manual(CLI::App& app, Common& common);

/// Adds `--shard I/N`.
void add_shard(CLI::App& command, std::string& shard);

/// Options of all commands that read a pipeline.
struct PipelineArguments {
  std::string pipeline;
  std::string camera;
  std::vector<std::string> settings;
  bool other_serial = false;  ///< accepts calibrations of another device, with a warning

  void add_to(CLI::App& command);
  /// Document of a file or of the one-line form. @throws config::ConfigurationError
  config::Value document() const;
};

/// Runs a command implemented in a module of its own, which links to further libraries (HDF5, Embree, OpenCV, Ceres).
/// @param arguments expected by the module, see its header in cli/
/// @returns the exit code
int run_module(const std::string& name, const void* arguments);

/// Makes this process a rank of an MPI job if the program was started as tofgraph-mpi.
/// @returns whether it was @throws std::runtime_error if the MPI library is not installed
bool join_ranks(const char* program_name);

/// Reports plugins that are hidden by others of the same name. @param name of one; empty: all
void warn_shadowed(const graph::PluginRegistry& registry, const Common& common, const std::string& name = "");

/// Builds the graph and prints warnings. @throws config::ConfigurationError listing all errors
std::unique_ptr<graph::Graph> build(const config::Value& document, const PipelineArguments& arguments,
                                    const Common& common, bool overwrite);

}  // namespace tofgraph::cli
