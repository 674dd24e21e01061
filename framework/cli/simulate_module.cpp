// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/progress.hpp"
#include "cli/simulate.hpp"
#include "config/diagnostics.hpp"
#include "io/campaign.hpp"
#include "io/output_file.hpp"
#include "report/scene_preview.hpp"
#include "simulation/recording.hpp"
#include "simulation/simulation.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <array>
#include <atomic>
#include <cmath>

namespace tofgraph::cli {
namespace {

using simulation::Simulation;
namespace fs = std::filesystem;

/// Preview of the first frame: points in the optical frame and decoded phases.
std::string preview_of(const Simulation& simulation) {
  const auto condition = simulation.prepare(0);
  const auto& frames = condition->frames;
  const simulation::Pixels& pixels = simulation.pixels();
  const std::size_t n = pixels.size();
  std::vector<float> phases(frames.exposures() * n), distance(n), amplitude(n), points;
  frames.phases(0, phases.data());
  frames.distance(0, distance.data(), amplitude.data());
  for (const simulation::Hit& hit : frames.hits()) {
    const bool there = std::isfinite(hit.return_path);
    const double z = hit.point.z - simulation.camera().focal_length;
    for (const double x : {hit.point.x, hit.point.y, z}) points.push_back(there ? static_cast<float>(x) : NAN);
  }
  const std::string title = simulation.scene().name.empty() ? "scene" : simulation.scene().name;
  return report::scene_preview({title, pixels.rows, pixels.columns, physics::exposures_of(simulation.camera()), phases,
                                distance, amplitude, points});
}

void check_outputs(const SimulateArguments& arguments, bool campaign, bool whole) {
  const auto refuse = [](const char* option, const std::string& problem) {
    if (!problem.empty()) throw config::ConfigurationError(fmt::format("{}: error: {}", option, problem));
  };
  const std::array<fs::path, 2> inputs = {arguments.scene, arguments.model};
  refuse("--preview", io::input_problem(fs::path(arguments.preview), inputs));
  refuse("--out", io::input_problem(fs::path(arguments.out), inputs));
  if (!arguments.preview.empty())
    refuse("--preview", io::output_problem(fs::path(arguments.preview), arguments.force, "--force"));
  if (arguments.out.empty()) return;
  const fs::path out = fs::path(arguments.out).lexically_normal();
  if (!campaign) return refuse("--out", io::output_problem(out, arguments.force, "--force"));
  refuse("--out", io::write_error(out / "campaign.yaml"));
  std::error_code error;
  if (fs::exists(out, error) && !fs::is_directory(out, error))
    refuse("--out", fmt::format("{} is a file; a scene with a sequence makes a folder", out.string()));
  if (fs::is_directory(out, error) && !fs::is_empty(out, error) && !arguments.force && whole)
    refuse("--out", fmt::format("the folder {} is not empty\n         --force replaces the files of a campaign in it",
                                out.string()));
}

int simulate(const SimulateArguments& arguments) {
  const graph::PluginRegistry registry(arguments.plugin_folders);
  simulation::SimulationChanges changes{arguments.model, arguments.seed, {}};
  if (arguments.frames != 0) changes.frames = arguments.frames;
  config::Diagnostics diagnostics;
  const auto simulation = Simulation::read(arguments.scene, registry, changes, diagnostics);
  if (!simulation) throw config::ConfigurationError(diagnostics);
  if (!arguments.quiet && !diagnostics.all().empty()) print_message(diagnostics.text());
  const bool campaign = !simulation->scene().sequence.empty();
  const config::Shard shard = config::parse_shard(arguments.shard);
  if (!shard.is_whole() && (!campaign || arguments.force))
    throw config::ConfigurationError(
        campaign ? "--shard: error: shards keep what is there and cannot be used with --force"
                 : "--shard: error: the scene has no sequence, so that it has one condition, which cannot be divided");
  check_outputs(arguments, campaign, shard.is_whole());
  if (!arguments.preview.empty()) {
    io::write_file(arguments.preview, preview_of(*simulation));
    if (!arguments.quiet) print_message(fmt::format("wrote {}: a picture of the first frame", arguments.preview));
  }
  if (arguments.out.empty()) return 0;

  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    arguments.threads != 0 ? arguments.threads : std::thread::hardware_concurrency());
  Progress progress(arguments.quiet);
  std::atomic<std::uint64_t> done = 0;
  std::uint64_t conditions = 0;
  for (std::size_t i = 0; i < simulation->conditions().size(); ++i) conditions += shard.has(i) ? 1U : 0U;
  const std::uint64_t all = conditions * simulation->frames();
  const simulation::RecordingOptions options{arguments.truth, arguments.force, arguments.compression, shard, [&] {
                                               progress.show(
                                                   static_cast<double>(++done) / static_cast<double>(all),
                                                   fmt::format("{} of {}", done.load(), config::counted(all, "frame")));
                                             }};
  if (campaign)
    simulation::record_campaign(*simulation, arguments.out, options);
  else
    simulation::record(*simulation, 0, arguments.out, options);
  progress.finish();
  if (!arguments.quiet)
    print_message(fmt::format("wrote {}: {}, {}", arguments.out, config::counted(conditions, "condition"),
                              config::counted(all, "frame")));
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::simulate(*static_cast<const tofgraph::cli::SimulateArguments*>(arguments));
}
