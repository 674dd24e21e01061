// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "recording/pipelines.hpp"

#include "config/log.hpp"
#include "graph/camera_spec.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace tofgraph::recording {
namespace {

config::Position at_option(const char* option, const std::string& text) {
  const auto source =
      std::make_shared<config::SourceText>(config::SourceText{option, text, std::filesystem::current_path(), true});
  return {source, 1, 1, std::max<std::size_t>(text.size(), 1)};
}

config::Value node(const std::string& text) {
  return config::parse_document("record", text, std::filesystem::current_path());
}

config::Value document(const CameraRequest& camera, const std::vector<config::Value>& others) {
  config::Value result = node("pipeline: 1\nnodes: []\n");
  if (!camera.profile.empty()) {
    config::Value profile = config::parse_value(config::yaml_word(camera.profile), {});
    profile.at = at_option("--profile", camera.profile);
    result.entries.push_back({"camera", profile.at, profile});
  }
  config::Value source = graph::camera_node(camera.spec, at_option("--camera", camera.spec));
  config::Entry name = node(fmt::format("name: {}\n", camera_node_name)).entries.front();
  name.value.at = source.at;  // errors of the camera refer to this option
  source.entries.push_back(std::move(name));
  for (config::Entry& entry : result.entries) {
    if (entry.key != "nodes") continue;
    entry.value.items.push_back(source);
    entry.value.items.insert(entry.value.items.end(), others.begin(), others.end());
  }
  return result;
}

/// Settings in the graph's form: those without a node refer to the camera's node.
std::vector<std::string> settings_of(const CameraRequest& camera, bool with_capture) {
  std::vector<std::string> result;
  const std::string before = std::string(camera_node_name) + ".", of_capture = std::string(capture_node_name) + ".";
  for (const std::string& setting : camera.settings) {
    const bool names_node = setting.substr(0, setting.find('=')).find('.') != std::string::npos;
    if (with_capture || !setting.starts_with(of_capture)) result.push_back(names_node ? setting : before + setting);
  }
  if (!std::isnan(camera.integration_time))
    result.push_back(fmt::format("{}integration_time={} s", before, camera.integration_time));
  return result;
}

std::unique_ptr<graph::Graph> built(const config::Value& document, const std::vector<std::string>& settings,
                                    const graph::GraphOptions& options) {
  config::Diagnostics diagnostics;
  auto graph = graph::build_graph(document, settings, options, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  if (options.message && !diagnostics.all().empty()) config::print_message(diagnostics.text());
  return graph;
}

}  // namespace

std::unique_ptr<graph::Graph> recording_graph(const CameraRequest& camera, const std::filesystem::path& capture,
                                              const std::string& comment, const std::vector<std::string>& sources,
                                              const graph::GraphOptions& options) {
  std::string text = fmt::format("name: {}\nstage: capture_writer\npath: {}\n", capture_node_name,
                                 config::yaml_word(std::filesystem::absolute(capture).string()));
  if (!comment.empty()) text += fmt::format("comment: {}\n", config::yaml_word(comment));
  if (!sources.empty())
    text += fmt::format("sources: {}\n", config::yaml_word(fmt::format("{}", fmt::join(sources, " "))));
  return built(document(camera, {node(text)}), settings_of(camera, true), options);
}

std::unique_ptr<graph::Graph> looking_graph(const CameraRequest& camera, const graph::GraphOptions& options) {
  return built(document(camera, {node("stage: four_phase_decoder\n"),
                                 node(fmt::format("name: {}\nstage: optimized_bistatic\n", depth_node_name))}),
               settings_of(camera, false), options);
}

CameraIdentity identity_of(const graph::Graph& graph) {
  const graph::Stream& stream = graph.nodes().front()->output();
  CameraIdentity identity;
  if (stream.camera) {
    const tofgraph_camera& camera = stream.camera->view();
    identity.name = camera.name;
    if (camera.profile != nullptr) identity.profile = camera.profile;
  }
  const auto source = nlohmann::json::parse(stream.source, nullptr, false);
  if (source.is_object()) identity.serial = source.value("serial", "");
  return identity;
}

}  // namespace tofgraph::recording
