// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The commands: each adds itself to the command line and gives back its exit code.
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
  std::vector<std::filesystem::path> plugin_path;  ///< those of --plugin-path
  std::function<int()> command;                    ///< the one that was chosen
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

/// Options of all commands that take a pipeline.
struct PipelineArguments {
  std::string pipeline;
  std::string camera;
  std::vector<std::string> settings;
  bool other_serial = false;  ///< calibrations of another device are used, with a warning

  void add_to(CLI::App& command);
  /// The document of a file, or of the one-line form. @throws config::ConfigurationError
  config::Value document() const;
};

/// Runs a command that lives in a module of its own, which brings what it needs (HDF5, Embree, OpenCV, Ceres).
/// @param arguments what the module expects, see its header in cli/
/// @returns the exit code
int run_module(const std::string& name, const void* arguments);

/// For the program under the name tofgraph-mpi: makes this process a rank of an MPI job.
/// @returns true if that is its name @throws std::runtime_error when the library that knows MPI is not installed
bool join_ranks(const char* program_name);

/// Says which plugins cannot be reached, as others of their name stand before them. @param name of one; empty: of all
void warn_shadowed(const graph::PluginRegistry& registry, const Common& common, const std::string& name = "");

/// Builds the graph; warnings are printed. @throws config::ConfigurationError with every mistake
std::unique_ptr<graph::Graph> build(const config::Value& document, const PipelineArguments& arguments,
                                    const Common& common, bool overwrite);

}  // namespace tofgraph::cli
