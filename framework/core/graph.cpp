// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "core/graph.hpp"

#include "core/outputs.hpp"
#include "core/paths.hpp"
#include "io/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <set>

namespace tofgraph::core {

/// What is known of the written nodes before they are ordered.
struct Graph::Building {
  const PipelineSpec& pipeline;
  std::vector<const tofgraph_descriptor*> stages;  ///< null: not known
  std::vector<std::vector<InputSpec>> inputs;
  std::vector<std::string> names;

  bool is(std::size_t node, std::string_view kind) const {
    return stages[node] != nullptr && kind == stages[node]->kind;
  }
  std::size_t index_of(const std::string& name) const {
    return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
  }
};

namespace {

const tofgraph_descriptor* find_stage(const NodeSpec& node, const Catalogue& catalogue, Diagnostics& diagnostics) {
  if (node.stage.empty()) return nullptr;
  const PluginFile* file = catalogue.find(node.stage);
  if (file == nullptr || file->kind == "effect") {
    const std::string what = file != nullptr ? fmt::format("'{}' is an effect of the simulator, no stage", node.stage)
                                             : fmt::format("there is no stage '{}'", node.stage);
    diagnostics.error(node.stage_at, what, suggestion(node.stage, catalogue.names(), "stages"));
    return nullptr;
  }
  try {
    return &catalogue.load(*file);
  } catch (const PluginError& error) {
    diagnostics.error(node.stage_at, error.what());
    return nullptr;
  }
}

std::vector<const Entry*> pointers(const std::vector<Entry>& entries) {
  std::vector<const Entry*> result;
  for (const Entry& entry : entries) result.push_back(&entry);
  return result;
}

}  // namespace

Graph::~Graph() = default;

Graph::Graph(const PipelineSpec& pipeline, const GraphOptions& options, Diagnostics& diagnostics)
    : name_(pipeline.name) {
  host_.overwrite = options.overwrite;
  host_.message = options.message;
  host_.version = TOFGRAPH_VERSION;
  const Catalogue catalogue(options.plugin_folders);
  Building building{pipeline, {}, {}, {}};
  for (const NodeSpec& node : pipeline.nodes) {
    building.stages.push_back(find_stage(node, catalogue, diagnostics));
    building.names.push_back(node.name);
  }
  if (pipeline.camera) camera_ = io::find_camera(*pipeline.camera, diagnostics);
  order(building, diagnostics);
  prepare(diagnostics);
  check_outputs(nodes_, diagnostics);
}

/// Resolves the inputs, then makes the nodes in topological order.
void Graph::order(Building& b, Diagnostics& diagnostics) {
  const auto& specs = b.pipeline.nodes;
  std::size_t sources = 0;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const NodeSpec& node = specs[i];
    std::vector<InputSpec>& inputs = b.inputs.emplace_back(node.inputs.value_or(std::vector<InputSpec>{}));
    if (node.queue && b.stages[i] != nullptr && !b.is(i, "source")) {
      diagnostics.error(node.queue->at, fmt::format("node '{}' is no source: only a source has a queue", node.name),
                        "frames are dropped at the source's exit only, so that branches never miss each other");
    }
    if (b.is(i, "source")) {
      if (node.inputs)
        diagnostics.error(node.at,
                          fmt::format("node '{}' ({}) is a source and takes no inputs", node.name, node.stage));
      if (++sources > 1)
        diagnostics.error(node.at, fmt::format("node '{}' is a second source; a pipeline has one", node.name));
      if (node.queue) queue_ = *node.queue;
      inputs.clear();
      continue;
    }
    if (!node.inputs) {
      for (std::size_t k = i; k-- > 0 && inputs.empty();) {
        if (!b.is(k, "sink")) inputs.push_back({"", specs[k].name, node.at});
      }
      if (inputs.empty() && b.stages[i] != nullptr)
        diagnostics.error(node.at,
                          fmt::format("node '{}' has nothing to read: no node above it gives frames", node.name),
                          "the first node is a source, e.g. {stage: capture_reader, file: recording.h5}");
    }
    for (const InputSpec& input : inputs) {
      const std::size_t k = b.index_of(input.node);
      if (k == specs.size())
        diagnostics.error(input.at, fmt::format("node '{}' reads '{}', which is no node", node.name, input.node),
                          suggestion(input.node, b.names, "nodes"));
      else if (b.is(k, "sink"))
        diagnostics.error(
            input.at, fmt::format("node '{}' reads '{}', which is a sink and gives nothing", node.name, input.node));
    }
    std::erase_if(inputs, [&](const InputSpec& input) { return b.index_of(input.node) == specs.size(); });
  }
  if (sources == 0 && std::ranges::all_of(b.stages, [](auto* stage) { return stage != nullptr; }) && !specs.empty()) {
    diagnostics.error(specs.front().at, "the pipeline has no source",
                      "example: - {name: grab, stage: capture_reader, file: recording.h5}");
  }

  std::vector<std::size_t> place(specs.size(), specs.size());  // of a written node in the order
  for (bool moved = true; moved;) {
    moved = false;
    for (std::size_t i = 0; i < specs.size(); ++i) {
      const bool ready = std::ranges::all_of(
          b.inputs[i], [&](const InputSpec& in) { return place[b.index_of(in.node)] < specs.size(); });
      if (place[i] < specs.size() || !ready || b.stages[i] == nullptr) continue;
      const std::size_t index = place[i] = nodes_.size();
      const std::size_t errors = diagnostics.errors();
      ParameterValues values(*b.stages[i], pointers(specs[i].parameters), specs[i].at, diagnostics);
      usable_.push_back(diagnostics.errors() == errors);
      nodes_.push_back(
          std::make_unique<Node>(index, specs[i].name, specs[i].at, *b.stages[i], std::move(values), host_));
      auto& inputs = inputs_.emplace_back();
      for (const InputSpec& input : b.inputs[i]) inputs.push_back(place[b.index_of(input.node)]);
      input_specs_.push_back(b.inputs[i]);
      moved = true;
    }
  }
  for (std::size_t i = 0; i < specs.size(); ++i) {
    // What waits for a node that is not known has been told already; what waits for itself has not.
    std::set<std::size_t> seen;
    std::deque<std::size_t> open = {i};
    bool cycle = false;
    while (!open.empty() && !cycle) {
      for (const InputSpec& in : b.inputs[open.front()]) {
        const std::size_t k = b.index_of(in.node);
        cycle = cycle || k == i;
        if (seen.insert(k).second) open.push_back(k);
      }
      open.pop_front();
    }
    if (cycle)
      diagnostics.error(specs[i].at,
                        fmt::format("node '{}' is part of a cycle: it waits for its own result", specs[i].name),
                        "change its inputs");
  }
}

Stream Graph::joined(std::size_t node, Diagnostics& diagnostics, bool& right) const {
  Stream all = nodes_[inputs_[node].front()]->output();
  const Node& self = *nodes_[node];
  for (std::size_t k = 1; k < inputs_[node].size(); ++k) {
    const Node& other = *nodes_[inputs_[node][k]];
    for (const Channel& channel : other.output().channels) {
      const Channel* mine = all.find(channel.name);
      if (mine == nullptr) {
        all.channels.push_back(channel);
      } else if (mine->made_by != channel.made_by) {
        diagnostics.error(input_specs_[node][k].at,
                          fmt::format("node '{}' joins two different '{}': of node '{}' and of node '{}'", self.name,
                                      channel.name, nodes_[mine->made_by]->name, nodes_[channel.made_by]->name),
                          "read only one of the two, or take the other one out with a stage before the join");
        right = false;
      }
    }
    for (const std::size_t step : other.output().history) {
      if (std::ranges::find(all.history, step) == all.history.end()) all.history.push_back(step);
    }
    std::ranges::sort(all.history);
    all.known &= other.output().known;
    if (other.output().camera_made_by != all.camera_made_by) {
      diagnostics.error(input_specs_[node][k].at,
                        fmt::format("node '{}' joins frames of two different cameras or lenses", self.name));
      right = false;
    }
  }
  for (std::size_t k = 0; k < inputs_[node].size(); ++k) {  // {port: node}: the node must give what the port reads
    const InputSpec& input = input_specs_[node][k];
    if (input.port.empty()) continue;
    std::vector<std::string> ports;
    const tofgraph_port* port = nullptr;
    for (std::uint64_t i = 0; i < self.stage().port_count; ++i) {
      const tofgraph_port& candidate = self.stage().ports[i];
      if (candidate.direction == TOFGRAPH_OUT) continue;
      ports.emplace_back(candidate.name);
      if (input.port == candidate.name) port = &candidate;
    }
    std::string channels = port != nullptr ? port->channel : "";
    std::ranges::replace(channels, '|', ' ');
    const auto has = [&](const std::string& channel) {
      return nodes_[inputs_[node][k]]->output().find(channel) != nullptr;
    };
    if (port == nullptr) {
      diagnostics.error(input.at, fmt::format("the stage {} has no input '{}'", self.stage().name, input.port),
                        suggestion(input.port, ports, "inputs"));
    } else if (std::ranges::none_of(split_words(channels), has)) {
      diagnostics.error(input.at, fmt::format("node '{}' gives no {} for the input '{}' of '{}'", input.node,
                                              port->channel, input.port, self.name));
    } else {
      continue;
    }
    right = false;
  }
  return all;
}

/// Creates and prepares node by node; what reads a node that failed is passed over, so that a mistake is told once.
void Graph::prepare(Diagnostics& diagnostics) {
  std::vector<bool> good(nodes_.size(), false);
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Node& node = *nodes_[i];
    const bool reachable = std::ranges::all_of(inputs_[i], [&](std::size_t k) { return good[k]; });
    if (!reachable || (!node.is_source() && inputs_[i].empty())) continue;
    if (!usable_[i] || !node.create(diagnostics)) continue;
    std::vector<Stream> joined_streams;
    std::vector<const Stream*> streams;
    std::vector<std::string> names;
    bool right = true;
    if (node.is_source()) {
      Stream& empty = joined_streams.emplace_back();
      empty.camera = camera_;
    } else if (!node.many_inputs()) {
      joined_streams.push_back(joined(i, diagnostics, right));
    }
    for (const Stream& stream : joined_streams) streams.push_back(&stream);
    for (const std::size_t k : inputs_[i]) {
      if (node.many_inputs()) streams.push_back(&nodes_[k]->output());
      names.push_back(nodes_[k]->name);
    }
    names.resize(std::max(names.size(), streams.size()), "");
    good[i] = right && node.prepare(streams, names, diagnostics);
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    nodes_[i]->set_provenance(good[i] ? provenance(i).dump(2) : "{}");
    const bool read =
        std::ranges::any_of(inputs_, [&](const auto& in) { return std::ranges::find(in, i) != in.end(); });
    if (!read && !nodes_[i]->is_sink() && diagnostics.ok()) {
      diagnostics.warning(nodes_[i]->at,
                          fmt::format("nothing reads node '{}': what it makes is thrown away", nodes_[i]->name));
    }
  }
}

nlohmann::json Graph::provenance(std::size_t node) const {
  nlohmann::json stages = nlohmann::json::array();
  std::set<std::size_t> steps(nodes_[node]->output().history.begin(), nodes_[node]->output().history.end());
  for (const std::size_t input : inputs_[node])
    steps.insert(nodes_[input]->output().history.begin(), nodes_[input]->output().history.end());
  for (const std::size_t i : steps) {
    const Node& step = *nodes_[i];
    nlohmann::json files = nlohmann::json::array();
    for (const UsedFile& file : step.files())
      files.push_back(
          {{"path", file.path}, {"sha256", file.sha256.empty() ? nlohmann::json() : nlohmann::json(file.sha256)}});
    stages.push_back({{"node", step.name},
                      {"stage", step.stage().name},
                      {"version", step.stage().version},
                      {"parameters", step.values().shown()},
                      {"files", std::move(files)}});
  }
  nlohmann::json json = {{"format", "tofgraph-provenance"},
                         {"version", 1},
                         {"program", "tofgraph " + host_.version},
                         {"pipeline", name_},
                         {"stages", std::move(stages)}};
  const Stream& out = nodes_[node]->output();
  if (out.camera) {
    json["camera"] = {{"name", out.camera->view().name}, {"measured", out.camera->measured}};
    if (!out.camera->file.empty()) {
      json["camera"]["profile"] = out.camera->file.string();
      json["camera"]["sha256"] = sha256_of_file(out.camera->file);
    }
  }
  return json;
}

std::unique_ptr<Graph> build_graph(const Value& document, const std::vector<std::string>& settings,
                                   const GraphOptions& options, Diagnostics& diagnostics) {
  PipelineSpec pipeline = parse_pipeline(document, diagnostics);
  for (const std::string& setting : settings) apply_setting(pipeline, setting, diagnostics);
  return std::make_unique<Graph>(pipeline, options, diagnostics);
}

}  // namespace tofgraph::core
