// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/explain.hpp"

#include "config/json_text.hpp"
#include "config/quantity.hpp"

#include <tofgraph/channels.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tofgraph::graph {
namespace {

std::string camera_text(const io::Camera& camera) {
  const tofgraph_camera& c = camera.view();
  std::string text = fmt::format("camera {}: {} x {} px, focal length ", c.name, c.width, c.height);
  text += std::isnan(c.focal_length)
              ? fmt::format("{:.6g} x {:.6g} px", c.focal_px[0], c.focal_px[1])
              : fmt::format("{} ({:.6g} px)", config::format_quantity(c.focal_length, "m"), c.focal_px[0]);
  if (!std::isnan(c.modulation_frequency))
    text += fmt::format(", {}", config::format_quantity(c.modulation_frequency, "Hz"));
  text += fmt::format(", {} light source{}", c.light_count, c.light_count == 1 ? "" : "s");
  text += camera.measured.empty() ? "; every value is nominal"
                                  : fmt::format("; measured: {}", fmt::join(camera.measured, ", "));
  return text + "\n";
}

/// Describes the files of the camera's folder (serial, date, hash) and how the pipeline uses them.
std::string folder_text(const Graph& graph) {
  const io::CameraFolder& folder = *graph.camera_folder();
  std::string text = fmt::format("    from the folder {}{}{}\n", folder.folder.string(),
                                 folder.serial.empty() ? "" : ", serial ", folder.serial);
  for (const io::FolderEntry& entry : folder.entries)
    text += fmt::format("    {}: {}{}{}{}{} ({})\n", entry.kind, entry.files.front().file.generic_string(),
                        entry.serial.empty() ? "" : ", serial ", entry.serial, entry.date.empty() ? "" : ", ",
                        entry.date, "SHA-256 " + entry.files.front().sha256);
  for (const std::string& note : folder.notes) text += fmt::format("    {}\n", note);
  for (const std::string& note : graph.camera_notes()) text += fmt::format("    {}\n", note);
  return text;
}

std::string parameters_text(const Node& node) {
  std::string text;
  for (const auto& [key, value] : node.values().shown().items()) {
    const std::string shown = value.is_string() ? value.get<std::string>() : config::json_text(value);
    text += fmt::format("{}{}={}", text.empty() ? "" : " ", key, shown.empty() ? "''" : shown);
  }
  return text;
}

/// Lists the channels that a node wrote, compared with those of its input.
void add_changes(std::string& text, const Node& node, const Stream* before) {
  for (const Channel& channel : node.output().channels) {
    if (channel.made_by != node.index || channel.name == "rays") continue;
    const bool changed = before != nullptr && before->find(channel.name) != nullptr;
    text += fmt::format("    {} {}\n", changed ? "changes" : "makes  ", channel_text(channel));
  }
  const bool raw = node.output().find("taps") != nullptr || node.output().find("phases") != nullptr;
  if (before == nullptr && raw)
    text += fmt::format("    a frame is {}\n", physics::exposures_text(node.output().all_exposures()));
  if (before == nullptr) return;
  for (const Channel& channel : before->channels) {
    if (node.output().find(channel.name) == nullptr) text += fmt::format("    removes {}\n", channel.name);
  }
  if (node.output().camera != before->camera && node.output().camera)
    text += "    replaces the rays: " + camera_text(*node.output().camera);
}

}  // namespace

std::string channel_text(const Channel& channel) {
  const ChannelInfo* known = known_channel(channel.name);
  std::string text = fmt::format("{} ({})", channel.name, channel.described());
  if (known != nullptr) text += fmt::format(": {}", known->text);
  if (!channel.of.empty()) text += fmt::format(", of {}", channel.of);
  if (!channel.applied.empty()) text += "; applied so far: " + applied_text(channel.applied);
  return text;
}

std::string explain(const Graph& graph) {
  std::string text = graph.name().empty() ? "" : graph.name() + "\n";
  const Stream& first = graph.nodes().front()->output();
  if (first.camera) text += camera_text(*first.camera);
  if (graph.camera_folder() != nullptr) text += folder_text(graph);
  for (const auto& pointer : graph.nodes()) {
    const Node& node = *pointer;
    std::vector<std::string> sources;
    for (const std::size_t input : graph.inputs(node.index)) sources.push_back(graph.nodes()[input]->name);
    text += fmt::format("\n{} = {}{}\n    {}\n", node.name, node.stage().name,
                        sources.empty() ? "" : fmt::format(" of {}", fmt::join(sources, ", ")), node.stage().summary);
    if (const std::string parameters = parameters_text(node); !parameters.empty())
      text += fmt::format("    with {}\n", parameters);
    for (const std::string& note : node.notes()) text += fmt::format("    {}\n", note);
    for (const UsedFile& file : node.files())
      text += fmt::format("    uses {} ({})\n", file.path, "SHA-256 " + file.hash->get());
    if (node.is_sink()) continue;
    add_changes(text, node, sources.empty() ? nullptr : &graph.nodes()[graph.inputs(node.index).front()]->output());
  }
  return text;
}

std::string dot(const Graph& graph) {
  std::string text =
      "digraph pipeline {\n  rankdir=LR;\n  node [shape=box, fontname=\"sans-serif\"];\n  edge "
      "[fontname=\"sans-serif\", fontsize=10];\n";
  for (const auto& node : graph.nodes()) {
    text += fmt::format("  \"{}\" [label=\"{}\\n{}\"{}];\n", node->name, node->name, node->stage().name,
                        node->is_source() || node->is_sink() ? ", style=rounded" : "");
  }
  for (const auto& node : graph.nodes()) {
    for (const std::size_t input : graph.inputs(node->index)) {
      std::vector<std::string> channels;
      for (const Channel& channel : graph.nodes()[input]->output().channels) {
        if (channel.name != "rays") channels.push_back(channel.name);
      }
      text += fmt::format("  \"{}\" -> \"{}\" [label=\"{}\"];\n", graph.nodes()[input]->name, node->name,
                          fmt::join(channels, "\\n"));
    }
  }
  return text + "}\n";
}

}  // namespace tofgraph::graph
