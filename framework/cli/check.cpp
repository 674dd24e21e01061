// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/commands.hpp"

#include "io/campaign.hpp"
#include "io/profile.hpp"
#include "simulation/files/model.hpp"
#include "simulation/files/scene_file.hpp"

#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

namespace tofgraph::cli {
namespace {

std::string check_profile(const config::Value& document, config::Diagnostics& diagnostics, const Common&) {
  io::read_profile(document, diagnostics);
  return "the profile is right";
}

std::string check_model(const config::Value& document, config::Diagnostics& diagnostics, const Common& common) {
  config::check_version(document, "model", 1, diagnostics);
  const simulation::Model model =
      simulation::read_model(document, graph::PluginRegistry(common.plugin_folders), diagnostics);
  const std::size_t effects = model.effects.size();
  // Where its camera is known its effects are made, so that maps of the wrong size are told.
  const config::Entry* camera = document.find("camera");
  if (diagnostics.ok() && camera != nullptr && !io::find_profile(camera->value.text, {}).empty()) {
    const io::CameraPtr profile = io::find_camera(camera->value, diagnostics);
    if (profile) simulation::make_effects(model, profile->view(), diagnostics);
  }
  return fmt::format("the model is right, {} effect{}", effects, effects == 1 ? "" : "s");
}

std::string check_scene(const config::Value& document, config::Diagnostics& diagnostics, const Common& common) {
  const simulation::SceneFile scene = simulation::read_scene(document, diagnostics);
  const simulation::Model model =
      simulation::model_of_scene(scene.model, graph::PluginRegistry(common.plugin_folders), diagnostics);
  if (scene.camera) simulation::make_effects(model, scene.camera->view(), diagnostics);
  if (!diagnostics.ok()) return {};
  const std::size_t conditions = simulation::expand(scene).size();
  return fmt::format("the scene is right, {} object{}, {} condition{}", scene.objects.size(),
                     scene.objects.size() == 1 ? "" : "s", conditions, conditions == 1 ? "" : "s");
}

std::string check_campaign(const config::Value& document, config::Diagnostics& diagnostics, const Common&) {
  const io::Campaign campaign = io::read_campaign(document, diagnostics);
  const std::size_t conditions = campaign.conditions.size();
  const std::string problem =
      campaign.camera ? physics::not_the_four(physics::exposures_of(campaign.camera->view())) : std::string();
  if (!problem.empty()) diagnostics.warning(document.at, fmt::format("diagnose {}", problem));
  return fmt::format("the campaign is right, {} condition{}", conditions, conditions == 1 ? "" : "s");
}

/// How a kind of file is checked; gives what is said when it is right.
struct Kind {
  std::string_view key;
  std::string (*check)(const config::Value& document, config::Diagnostics& diagnostics, const Common& common);
};

constexpr Kind kinds[] = {
    {"profile", check_profile}, {"scene", check_scene}, {"model", check_model}, {"campaign", check_campaign}};

/// Checks a file by the kind that its first key names.
int check(const PipelineArguments& arguments, bool force, const Common& common) {
  const config::Value document = arguments.document();
  for (const Kind& kind : kinds) {
    if (document.entries.empty() || document.entries.front().key != kind.key) continue;
    config::Diagnostics diagnostics;
    const std::string said = kind.check(document, diagnostics, common);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    if (!diagnostics.all().empty()) say(diagnostics.text());
    if (!common.quiet) say(fmt::format("{}: {}", arguments.pipeline, said));
    return done;
  }
  const auto graph = build(document, arguments, common, force);
  if (!common.quiet) say(fmt::format("{}: the pipeline is right, {} nodes", arguments.pipeline, graph->nodes().size()));
  return done;
}

}  // namespace

void add_check(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<PipelineArguments>();
  CLI::App* command =
      app.add_subcommand("check", "Say every mistake in a pipeline, profile, scene or campaign; run nothing");
  command->footer("Example: tofgraph check pipelines/quickstart.yaml --set save.encoding=ascii");
  arguments->add_to(*command);
  auto force = std::make_shared<bool>(false);
  command->add_flag("--force", *force, "Outputs that exist may be replaced");
  command->callback([=, &common] { common.command = [=, &common] { return check(*arguments, *force, common); }; });
}

}  // namespace tofgraph::cli
