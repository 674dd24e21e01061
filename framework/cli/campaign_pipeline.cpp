// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/campaign_pipeline.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* result_name = "result.h5";

config::Value word_at(std::string text, const config::Position& at) {
  config::Value value;
  value.kind = config::Value::Kind::scalar;
  value.text = std::move(text);
  value.quoted = true;
  value.at = at;
  return value;
}

/// Replaces or adds a parameter.
void set_parameter(graph::NodeSpec& node, const std::string& key, config::Value value) {
  std::erase_if(node.parameters, [&](const config::Entry& entry) { return entry.key == key; });
  const config::Position at = value.at;
  node.parameters.push_back({key, at, std::move(value)});
}

/// Path of an output below a condition's folder: as written, without parts that lead out of the pipeline's folder.
fs::path below(const fs::path& folder, const fs::path& written) {
  if (written.is_absolute()) return folder / written.filename();
  fs::path kept;
  for (const fs::path& part : written.lexically_normal())
    if (part != "..") kept /= part;
  return folder / kept;
}

}  // namespace

std::string folder_name(const std::string& id) {
  std::string name = id;
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_' && c != '.') c = '_';
  return name.empty() || name.front() == '.' ? "_" + name : name;
}

CampaignPipeline::CampaignPipeline(graph::PipelineSpec pipeline, fs::path out,
                                   const std::vector<fs::path>& plugin_folders)
    : pipeline_(std::move(pipeline)), out_(std::move(out)), registry_(plugin_folders) {
  const auto reader = std::ranges::find(pipeline_.nodes, "capture_reader", &graph::NodeSpec::stage);
  if (reader == pipeline_.nodes.end())
    throw config::ConfigurationError(
        "--campaign: error: the pipeline has no capture_reader, which reads the captures of the conditions");
  source_ = static_cast<std::size_t>(reader - pipeline_.nodes.begin());
}

/// Keys of a stage's parameters that name output files.
std::vector<std::string> CampaignPipeline::output_keys(const std::string& stage) const {
  const graph::PluginFile* file = registry_.find(stage);
  if (file == nullptr || !file->is_stage()) return {};  // reported by the graph
  std::vector<std::string> keys;
  for (const tofgraph_parameter& p : registry_.load(*file).own_parameters)
    if (p.kind == TOFGRAPH_KIND_OUTPUT_FILE || p.kind == TOFGRAPH_KIND_FRAME_FILES) keys.emplace_back(p.name);
  return keys;
}

graph::PipelineSpec CampaignPipeline::of(const io::Condition& condition) const {
  graph::PipelineSpec pipeline = pipeline_;
  graph::NodeSpec& source = pipeline.nodes[source_];
  set_parameter(source, "file", word_at(fs::absolute(condition.capture).string(), source.at));
  if (condition.frames) {
    config::Value frames;
    frames.kind = config::Value::Kind::list;
    frames.at = source.at;
    for (const std::uint64_t frame : *condition.frames)
      frames.items.push_back(word_at(fmt::format("{}", frame), source.at));
    set_parameter(source, "frames", std::move(frames));
  }
  if (!condition.sources.empty())
    set_parameter(source, "sources", word_at(fmt::format("{}", fmt::join(condition.sources, " ")), source.at));
  const fs::path folder = out_ / folder_name(condition.id);
  for (graph::NodeSpec& node : pipeline.nodes) {
    for (const std::string& key : output_keys(node.stage)) {
      const auto entry = std::ranges::find(node.parameters, key, &config::Entry::key);
      if (entry != node.parameters.end()) entry->value.text = below(folder, entry->value.text).string();
    }
  }
  if (recorded_) pipeline.nodes.push_back(recorder(folder));
  return pipeline;
}

graph::NodeSpec CampaignPipeline::recorder(const fs::path& folder) const {
  const config::Position& at = pipeline_.at;
  graph::NodeSpec node;
  node.name = "campaign_result";
  node.stage = "capture_writer";
  node.at = node.stage_at = at;
  node.inputs = std::vector<graph::InputSpec>{{"", recorded_->node, at}};
  set_parameter(node, "channels", word_at(fmt::format("{}", fmt::join(recorded_->channels, " ")), at));
  set_parameter(node, "path", word_at((folder / result_name).string(), at));
  return node;
}

bool CampaignPipeline::add_recorder(const graph::Graph& graph) {
  for (const auto& node : graph.nodes()) {
    if (node->is_sink() || !node->output().camera) continue;
    const tofgraph_camera& camera = node->output().camera->view();
    Recordable here{node->name, {}};
    bool length = false;
    for (const graph::Channel& channel : node->output().channels) {
      if (channel.rank != 2 || channel.extent[0] != camera.height || channel.extent[1] != camera.width) continue;
      here.channels.push_back(channel.name);
      length = length || channel.name == "depth" || channel.name == "range" || channel.name == "distance";
    }
    if (length) recorded_ = std::move(here);
  }
  return recorded_.has_value();
}

}  // namespace tofgraph::cli
