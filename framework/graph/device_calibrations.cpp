// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/device_calibrations.hpp"

#include "graph/stream.hpp"
#include "io/serial.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <limits>

namespace tofgraph::graph {
namespace {

/// Distance corrections in the order of their application.
constexpr const char* model_stage = "model_correction";
constexpr const char* offset_stage = "offset_correction";

bool names_stage(const PipelineSpec& pipeline, std::string_view stage) {
  return std::ranges::find(pipeline.nodes, stage, &NodeSpec::stage) != pipeline.nodes.end();
}

/// Returns the stage of a node; null if it is unknown or cannot be loaded, which the graph reports.
const Plugin* stage_of(const NodeSpec& node, const PluginRegistry& registry) {
  const PluginFile* file = registry.find(node.stage);
  if (file == nullptr || !file->is_stage()) return nullptr;
  try {
    return &registry.load(*file);
  } catch (const PluginError&) {
    return nullptr;
  }
}

bool is_sink(const NodeSpec& node, const PluginRegistry& registry) {
  const PluginFile* file = registry.find(node.stage);
  return file != nullptr && file->kind == "sink";
}

bool makes_distance(const Plugin& stage) {
  return stage.file.kind == "filter" && std::ranges::any_of(stage.own_ports, [](const tofgraph_port& port) {
           return port.direction == TOFGRAPH_DIRECTION_OUT && std::string_view(port.channel) == "distance";
         });
}

bool needs_distance(const Plugin& stage) {
  return std::ranges::any_of(stage.own_ports, [](const tofgraph_port& port) {
    return port.direction != TOFGRAPH_DIRECTION_OUT && std::string_view(port.channel) == "distance" &&
           (port.flags & TOFGRAPH_PORT_OPTIONAL) == 0;
  });
}

/// Names of the nodes behind which the corrections are inserted.
std::vector<std::string> nodes_to_correct(const PipelineSpec& pipeline, const PluginRegistry& registry) {
  std::vector<std::string> decoders;
  for (const NodeSpec& node : pipeline.nodes) {
    const Plugin* stage = stage_of(node, registry);
    if (stage != nullptr && makes_distance(*stage)) decoders.push_back(node.name);
  }
  if (!decoders.empty()) return decoders;
  std::string above;
  for (const NodeSpec& node : pipeline.nodes) {
    const Plugin* stage = stage_of(node, registry);
    if (stage != nullptr && needs_distance(*stage)) {
      const std::string& read = node.inputs ? node.inputs->front().node : above;
      return read.empty() ? std::vector<std::string>{} : std::vector<std::string>{read};
    }
    if (!is_sink(node, registry)) above = node.name;
  }
  return {};
}

std::string free_name(const PipelineSpec& pipeline, const std::string& stage, const std::string& behind) {
  const auto taken = [&](const std::string& name) {
    return std::ranges::find(pipeline.nodes, name, &NodeSpec::name) != pipeline.nodes.end();
  };
  std::string name = stage;
  if (taken(name)) name = fmt::format("{}_{}", behind, stage);
  while (taken(name)) name += "_";
  return name;
}

/// Inserts a node behind another one and redirects the readers of that node to the new one.
std::string insert_behind(PipelineSpec& pipeline, const std::string& behind, const std::string& stage,
                          const config::Position& at) {
  NodeSpec node;
  node.name = free_name(pipeline, stage, behind);
  node.stage = stage;
  node.at = node.stage_at = at;
  node.inputs = std::vector<InputSpec>{{"", behind, at}};
  if (stage == offset_stage) {  // the boards of a camera's calibration stand close together
    config::Value path;
    path.kind = config::Value::Kind::scalar;
    path.text = "per_path";
    path.at = at;
    node.parameters.push_back({"method", at, std::move(path)});
  }
  for (NodeSpec& other : pipeline.nodes) {
    if (!other.inputs) continue;
    for (InputSpec& input : *other.inputs)
      if (input.node == behind) input.node = node.name;
  }
  const auto place = std::ranges::find(pipeline.nodes, behind, &NodeSpec::name);
  std::string name = node.name;
  pipeline.nodes.insert(place == pipeline.nodes.end() ? place : place + 1, std::move(node));
  return name;
}

std::string today() { return fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::chrono::system_clock::now())); }

}  // namespace

std::vector<std::string> insert_corrections(PipelineSpec& pipeline, const io::CameraFolder& folder,
                                            const PluginRegistry& registry, const config::Position& at,
                                            config::Diagnostics& diagnostics) {
  std::vector<std::string> stages, notes;
  if (folder.has_model()) stages.emplace_back(model_stage);
  if (folder.find("offset") != nullptr) stages.emplace_back(offset_stage);
  const bool own = names_stage(pipeline, model_stage) || names_stage(pipeline, offset_stage);
  const std::vector<std::string> nodes =
      own || stages.empty() ? std::vector<std::string>{} : nodes_to_correct(pipeline, registry);
  for (const std::string& node : nodes) {
    std::vector<std::string> inserted;
    for (const std::string& stage : stages)
      inserted.push_back(insert_behind(pipeline, inserted.empty() ? node : inserted.back(), stage, at));
    notes.push_back(fmt::format("inserts {} behind {}", fmt::join(inserted, ", "), node));
  }
  if (!nodes.empty()) return notes;
  for (const std::string& stage : stages) {
    if (names_stage(pipeline, stage)) continue;
    notes.push_back(
        fmt::format("the folder of the camera has what {} takes, but no node of the pipeline is one: it is "
                    "not applied",
                    stage));
    diagnostics.warning(at, notes.back(), fmt::format("add - {{stage: {}}} before the distance model", stage));
  }
  return notes;
}

std::vector<config::Entry> calibration_entries(const NodeSpec& node, const Plugin& stage,
                                               const io::CameraFolder& folder) {
  std::vector<config::Entry> entries;
  for (const tofgraph_parameter& p : stage.own_parameters) {
    const bool written = std::ranges::find(node.parameters, p.name, &config::Entry::key) != node.parameters.end();
    if (p.kind != TOFGRAPH_KIND_INPUT_FILE || written) continue;
    for (const std::string& kind : split_words(p.choices)) {
      const std::filesystem::path file = folder.file_of(kind);
      if (file.empty()) continue;
      config::Value value;
      value.kind = config::Value::Kind::scalar;
      value.text = file.string();
      value.quoted = true;
      value.at = node.at;
      entries.push_back({p.name, node.at, std::move(value)});
      break;
    }
  }
  return entries;
}

void check_recording(const io::CameraFolder& folder, const std::string& source, bool other_serial,
                     const config::Position& at, config::Diagnostics& diagnostics) {
  const auto known = nlohmann::json::parse(source, nullptr, false);
  const auto word = [&](const char* key) { return known.is_object() ? known.value(key, "") : std::string(); };
  if (const std::string problem = io::serial_problem(folder.serial, word("serial"), "the frames"); !problem.empty()) {
    const std::string text = fmt::format("the folder {} {}", folder.folder.string(), problem);
    if (other_serial)
      diagnostics.warning(at, text + ": it is used nevertheless");
    else
      diagnostics.error(at, text, "give the folder of that camera, or --other-serial uses this one");
  }
  std::array<double, 2> temperature = {std::numeric_limits<double>::quiet_NaN(),
                                       std::numeric_limits<double>::quiet_NaN()};
  if (known.is_object() && known.contains("temperature") && known["temperature"].size() == 2)
    temperature = {known["temperature"][0], known["temperature"][1]};
  const std::string date = word("recorded_at").substr(0, 10);
  for (const std::string& message : io::expired_calibrations(folder, date.empty() ? today() : date, temperature))
    diagnostics.warning(at, message, "calibrate again, and add the new calibration with --force");
}

}  // namespace tofgraph::graph
