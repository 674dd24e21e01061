// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/campaign.hpp"
#include "cli/commands.hpp"
#include "foreign/layout.hpp"
#include "graph/checking.hpp"

#include "io/campaign.hpp"
#include "io/profile.hpp"
#include "simulation/files/camera_needs.hpp"
#include "simulation/files/model.hpp"
#include "simulation/files/scene_file.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

namespace tofgraph::cli {
namespace {

/// Warns of missing camera properties that a simulation or search uses; pipelines do not need them.
void warn_of_camera(const io::Camera& camera, const char* who, const std::vector<simulation::Need>& missing,
                    const config::Position& at, config::Diagnostics& diagnostics) {
  if (missing.empty()) return;
  diagnostics.warning(at,
                      fmt::format("{} cannot use the camera '{}': its profile has no {}", who, camera.view().name,
                                  simulation::keys_of(missing)),
                      simulation::added_to_profile(camera, missing));
}

std::string check_profile(const config::Value& document, config::Diagnostics& diagnostics, const Common&) {
  const io::CameraPtr camera = io::read_profile(document, diagnostics);
  if (!camera) return {};
  const tofgraph_camera& view = camera->view();
  std::vector<simulation::Need> missing = simulation::missing_for_light(view);
  warn_of_camera(*camera, "diagnose", missing, document.at, diagnostics);
  if (!(view.frame_rate > 0)) missing.push_back({"frame_rate", "frame_rate: 80 Hz"});
  warn_of_camera(*camera, "simulate", missing, document.at, diagnostics);
  if (!simulation::has_noise(view))
    diagnostics.warning(document.at, "the profile has no read_noise and shot_noise: a scene must write noise: none");
  return "the profile is valid";
}

std::string check_model(const config::Value& document, config::Diagnostics& diagnostics, const Common& common) {
  config::check_version(document, "model", 1, diagnostics);
  const simulation::Model model =
      simulation::read_model(document, graph::PluginRegistry(common.plugin_folders), diagnostics);
  const std::size_t effects = model.effects.size();
  // If the camera is known, its effects are created to detect maps of the wrong size.
  const config::Entry* camera = document.find("camera");
  if (diagnostics.ok() && camera != nullptr && !io::find_profile(camera->value.text, {}).empty()) {
    const io::CameraPtr profile = io::find_camera(camera->value, diagnostics);
    if (profile) simulation::make_effects(model, profile->view(), diagnostics);
  }
  return "the model is valid, " + config::counted(effects, "effect");
}

std::string check_scene(const config::Value& document, config::Diagnostics& diagnostics, const Common& common) {
  const simulation::SceneFile scene = simulation::read_scene(document, diagnostics);
  config::Diagnostics of_model;  // separate, so that an error in the scene does not hide one in the model
  const simulation::Model model =
      simulation::model_of_scene(scene.model, graph::PluginRegistry(common.plugin_folders), of_model);
  if (scene.camera) simulation::make_effects(model, scene.camera->view(), of_model);
  if (scene.camera && !simulation::is_for(model, *scene.camera))
    of_model.warning(document.at, fmt::format("the model is for the camera '{}', the scene has '{}'", model.camera,
                                              scene.camera->view().name));
  diagnostics.add(of_model.all());
  if (!diagnostics.ok()) return {};
  const std::size_t conditions = simulation::expand(scene).size();
  return fmt::format("the scene is valid, {}, {}", config::counted(scene.objects.size(), "object"),
                     config::counted(conditions, "condition"));
}

std::string check_campaign(const config::Value& document, config::Diagnostics& diagnostics, const Common&) {
  const io::Campaign campaign = io::read_campaign(document, diagnostics);
  io::warn_of_targets(campaign, diagnostics);
  const CampaignArguments captures{campaign, diagnostics};
  run_module("campaign", &captures);
  const std::size_t conditions = campaign.conditions.size();
  if (campaign.camera)
    warn_of_camera(*campaign.camera, "diagnose", simulation::missing_for_light(campaign.camera->view()), document.at,
                   diagnostics);
  return "the campaign is valid, " + config::counted(conditions, "condition");
}

std::string check_layout(const config::Value& document, config::Diagnostics& diagnostics, const Common&) {
  const foreign::Layout layout = foreign::read_layout(document, diagnostics);
  if (const config::Entry* camera = document.find("camera")) io::find_camera(camera->value, diagnostics);
  return "the layout is valid, " + config::counted(layout.channels.size(), "channel");
}

/// Check of one kind of file; returns the message for a valid one.
struct Kind {
  std::string_view key;
  std::string (*check)(const config::Value& document, config::Diagnostics& diagnostics, const Common& common);
};

constexpr Kind kinds[] = {{"profile", check_profile},
                          {"scene", check_scene},
                          {"model", check_model},
                          {"campaign", check_campaign},
                          {"layout", check_layout}};

/// Checks a file according to the kind given by its first key.
int check(const PipelineArguments& arguments, bool force, const Common& common) {
  const config::Value document = arguments.document();
  for (const Kind& kind : kinds) {
    if (document.entries.empty() || document.entries.front().key != kind.key) continue;
    config::Diagnostics diagnostics;
    const std::string said = kind.check(document, diagnostics, common);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    if (!common.quiet && !diagnostics.all().empty()) print_message(diagnostics.text());
    if (!common.quiet) print_message(fmt::format("{}: {}", arguments.pipeline, said));
    return done;
  }
  graph::set_only_checking();
  const auto graph = build(document, arguments, common, force);
  if (!common.quiet)
    print_message(fmt::format("{}: the pipeline is valid, {}", arguments.pipeline,
                              config::counted(graph->nodes().size(), "node")));
  return done;
}

}  // namespace

void add_check(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<PipelineArguments>();
  CLI::App* command = app.add_subcommand(
      "check", "Report every error in a pipeline, profile, scene, model, campaign or layout, without running it");
  command->footer("Example: tofgraph check pipelines/quickstart.yaml --set clouds.encoding=ascii --force");
  arguments->add_to(*command);
  auto force = std::make_shared<bool>(false);
  command->add_flag("--force", *force, "Existing outputs may be replaced");
  command->callback([=, &common] { common.command = [=, &common] { return check(*arguments, *force, common); }; });
}

}  // namespace tofgraph::cli
