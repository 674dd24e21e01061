// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "recording/plan.hpp"

#include "config/quantity.hpp"
#include "simulation/files/scene_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace tofgraph::recording {
namespace {

using config::format_quantity;

void take_scene(const config::Value& document, Plan& plan, config::Diagnostics& diagnostics) {
  const simulation::SceneFile scene = simulation::read_scene(document, diagnostics);
  if (!diagnostics.ok()) return;
  plan.campaign.name = scene.name;
  plan.campaign.camera = scene.camera;
  plan.campaign.camera_value = scene.document.find("camera")->value;
  plan.campaign.camera_name = simulation::camera_name_in(scene, std::filesystem::absolute(plan.file).parent_path());
  plan.campaign.pattern = simulation::pattern_of(scene);
  plan.frames = static_cast<std::uint64_t>(scene.frames);
  const std::vector<simulation::SceneCondition> conditions = simulation::expand(scene);
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    plan.campaign.conditions.push_back(conditions[i]);
    const bool board_says_all = conditions[i].has_board();
    plan.scenes.push_back(board_says_all ? "" : config::yaml_text(simulation::document_of(scene, i)));
  }
}

/// Checks the integration times before the first condition is recorded.
void check_times(const Plan& plan, const config::Position& at, config::Diagnostics& diagnostics) {
  if (!plan.campaign.camera) return;
  const double *valid = plan.campaign.camera->view().integration_time, shortest = valid[0], longest = valid[1];
  for (const io::Condition& condition : plan.campaign.conditions) {
    const double time = condition.integration_time;
    if (!(time < shortest || time > longest)) continue;
    diagnostics.error(condition.at.line != 0 ? condition.at : at,
                      fmt::format("'{}': the integration time {} is not valid for the camera '{}': {} to {}",
                                  condition.id, format_quantity(time, "s"), plan.campaign.camera->view().name,
                                  format_quantity(shortest, "s"), format_quantity(longest, "s")));
  }
}

}  // namespace

Plan read_plan(const std::filesystem::path& file) {
  Plan plan;
  plan.file = file;
  config::Diagnostics diagnostics;
  const config::Value document = config::load_document(file);
  if (document.find("scene") != nullptr) {
    take_scene(document, plan, diagnostics);
  } else {
    plan.campaign = io::read_campaign(document, diagnostics, io::Captures::may_be_missing);
    if (plan.campaign.from_table)
      diagnostics.error(document.at, "a plan needs 'conditions': a table of statistics cannot be recorded");
    plan.scenes.resize(plan.campaign.conditions.size());
  }
  check_times(plan, document.at, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return plan;
}

std::string setup_text(const io::Condition& c) {
  std::vector<std::string> parts;
  if (c.has_board()) {
    std::string board = "board at " + format_quantity(c.board_distance, "m");
    if (c.board_tilt_x != 0 && !std::isnan(c.board_tilt_x))
      board += ", tilted about x by " + format_quantity(c.board_tilt_x, "rad");
    if (c.board_tilt_y != 0 && !std::isnan(c.board_tilt_y))
      board += ", tilted about y by " + format_quantity(c.board_tilt_y, "rad");
    parts.push_back(board);
  } else if (c.is_capped()) {
    parts.emplace_back("the lens capped");
  } else {
    parts.push_back(c.scene.empty() ? "scene " + c.id : "scene " + c.scene.filename().string());
  }
  if (!c.target.empty()) parts.push_back("target " + c.target);
  if (!c.sources.empty()) parts.push_back(fmt::format("only the source {}", fmt::join(c.sources, " and ")));
  if (c.ambient != "dark") parts.push_back("ambient light " + c.ambient);
  if (c.roll != 0) parts.push_back("camera rolled by " + format_quantity(c.roll, "rad"));
  if (!std::isnan(c.velocity) && c.velocity != 0)
    parts.push_back("board moving with " + format_quantity(c.velocity, "m/s"));
  if (!c.rail.empty()) parts.push_back("rail " + c.rail);
  if (!std::isnan(c.time_since_power_on))
    parts.push_back(format_quantity(c.time_since_power_on, "s") + " after power on");
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string condition_text(const io::Condition& c) {
  const std::string time =
      std::isnan(c.integration_time) ? "" : ", integration time " + format_quantity(c.integration_time, "s");
  return fmt::format("{}: {}{}", c.id, setup_text(c), time);
}

}  // namespace tofgraph::recording
