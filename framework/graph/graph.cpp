// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/graph.hpp"

#include "config/json_text.hpp"
#include "config/paths.hpp"
#include "graph/checking.hpp"
#include "graph/device_calibrations.hpp"
#include "graph/known_stages.hpp"
#include "graph/outputs.hpp"
#include "graph/resolved_pipeline.hpp"
#include "io/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <set>
#include <span>

namespace tofgraph::graph {

namespace {

bool checking = false;

/// A live device cannot wait: a full queue drops its oldest frame for the newest.
Queue default_queue(const Stream& stream) {
  const auto source = nlohmann::json::parse(stream.source);
  Queue queue;
  if (source.contains("live") && source["live"] == true) queue.policy = QueuePolicy::drop_oldest;
  return queue;
}

std::vector<const config::Entry*> pointers(const std::vector<config::Entry>& entries) {
  std::vector<const config::Entry*> result;
  for (const config::Entry& entry : entries) result.push_back(&entry);
  return result;
}

/// Sets `overwrite: true` for every sink, so that existing outputs may be replaced.
bool take_overwrite(std::vector<const config::Entry*>& entries, config::Diagnostics& diagnostics) {
  const auto found = std::ranges::find(entries, "overwrite", [](const config::Entry* entry) { return entry->key; });
  if (found == entries.end()) return false;
  const config::Value& value = (*found)->value;
  bool allowed = false;
  if (!value.is_scalar() || !parse_bool(value.text, allowed))
    diagnostics.error(value.at, fmt::format("'overwrite' is {}: it is neither true nor false", value.described()),
                      "example: " + config::assignment(value.at, "overwrite", "true"));
  entries.erase(found);
  return allowed;
}

/// Sets `other_serial` for a stage that has this parameter, unless the pipeline sets it.
std::optional<config::Entry> other_serial_entry(const NodeSpec& spec, const Plugin& stage) {
  constexpr const char* key = "other_serial";
  const bool written = std::ranges::find(spec.parameters, key, &config::Entry::key) != spec.parameters.end();
  const auto is_it = [&](const tofgraph_parameter& p) { return std::string_view(p.name) == key; };
  if (written || std::ranges::none_of(stage.own_parameters, is_it)) return std::nullopt;
  return config::Entry{key, spec.at, config::parse_value("true", spec.at)};
}

/// Hash of a library, computed once: libraries do not change while they are loaded.
const std::string& library_hash(const Plugin& plugin) {
  if (!plugin.hash.empty()) return plugin.hash;
  static std::mutex mutex;
  static std::map<std::string, std::string> hashes;
  const std::scoped_lock lock(mutex);
  std::string& hash = hashes[plugin.file.path.string()];
  if (hash.empty()) hash = io::sha256_of_file(plugin.file.path);
  return hash;
}

}  // namespace

bool only_checking() { return checking; }
void set_only_checking() { checking = true; }

Graph::~Graph() = default;

Graph::Graph(PipelineSpec pipeline, const GraphOptions& options, config::Diagnostics& diagnostics)
    : name_(pipeline.name), camera_at_(pipeline.camera ? pipeline.camera->at : pipeline.at) {
  host_.overwrite = options.overwrite;
  host_.stopping = checking;
  host_.message = options.message;
  host_.version = TOFGRAPH_VERSION;
  host_.plugin_path = config::joined_path(options.plugin_folders);
  const PluginRegistry registry(options.plugin_folders, options.own_stages);
  if (pipeline.camera) camera_ = io::find_camera(*pipeline.camera, diagnostics);
  if (camera_ && camera_->folder)
    camera_notes_ = insert_corrections(pipeline, *camera_->folder, registry, camera_at_, diagnostics);
  const KnownStages known_stages(registry, pipeline.nodes);
  host_.known_stages = &known_stages;
  const ResolvedPipeline written(pipeline, registry, diagnostics);
  for (const auto& [hidden, before] : registry.hidden()) {
    const auto used = [&name = hidden.name](const NodeSpec& node) { return node.stage == name; };
    if (host_.message && std::ranges::any_of(pipeline.nodes, used))
      host_.message(hidden.name, fmt::format("{} is used; it hides {}", before.path.string(), hidden.path.string()),
                    true);
  }
  make_nodes(written, options, diagnostics);
  if (camera_ && !camera_->file.empty()) host_.inputs.push_back(camera_->file);
  if (camera_ && !camera_->bad_pixels_file.empty()) host_.inputs.push_back(camera_->bad_pixels_file);
  for (const auto& node : nodes_) std::ranges::copy(node->values().files(), std::back_inserter(host_.inputs));
  // Without the named camera, every stage that needs one would report an error too.
  if (!pipeline.camera || camera_) prepare(options, diagnostics);
  check_outputs(nodes_, diagnostics);
  host_.known_stages = nullptr;
}

void Graph::make_nodes(const ResolvedPipeline& written, const GraphOptions& options, config::Diagnostics& diagnostics) {
  std::map<std::string, std::size_t> made;
  for (const std::size_t i : written.order(diagnostics)) {
    const NodeSpec& spec = written.spec(i);
    const std::size_t index = made[spec.name] = nodes_.size();
    const std::size_t errors = diagnostics.errors();
    std::vector<const config::Entry*> entries = pointers(spec.parameters);
    std::vector<config::Entry> from_folder;
    if (camera_ && camera_->folder) from_folder = calibration_entries(spec, *written.stage(i), *camera_->folder);
    for (const config::Entry& entry : from_folder) entries.push_back(&entry);
    std::optional<config::Entry> other_serial;
    if (options.other_serial) other_serial = other_serial_entry(spec, *written.stage(i));
    if (other_serial) entries.push_back(&*other_serial);
    const bool overwrite = written.stage(i)->file.kind == "sink" && take_overwrite(entries, diagnostics);
    ParameterValues values(*written.stage(i), std::move(entries), spec.at, diagnostics);
    usable_.push_back(diagnostics.errors() == errors);
    nodes_.push_back(std::make_unique<Node>(index, spec.name, spec.at, *written.stage(i), std::move(values), host_));
    nodes_.back()->set_overwrite(overwrite);
    if (nodes_.back()->is_source()) written_queue_ = spec.queue;
    auto& inputs = inputs_.emplace_back();
    for (const InputSpec& input : written.inputs(i)) inputs.push_back(made.at(input.node));
    input_specs_.push_back(written.inputs(i));
    aliases_.emplace_back(inputs.size());
  }
}

/// Adds a channel of the k-th input to the existing ones. With named ports each reads its own.
bool Graph::join_channel(std::size_t node, std::size_t k, const Channel& channel, Stream& all) {
  const Channel* mine = all.find(channel.name);
  const InputSpec& input = input_specs_[node][k];
  if (mine == nullptr) {
    all.channels.push_back(channel);
  } else if (mine->made_by != channel.made_by && !input.port.empty()) {
    const Node& self = *nodes_[node];
    const auto reads = [&](const tofgraph_port& port) {
      const std::vector<std::string> names = alternatives(port);
      return input.port == port.name && std::ranges::find(names, channel.name) != names.end();
    };
    if (std::ranges::none_of(self.stage().own_ports, reads)) return true;  // the frame of the first input is used
    Channel own = channel;
    own.name = alias_of(channel.name, input.port);
    aliases_[node][k].emplace_back(channel.name, own.name);
    all.channels.push_back(std::move(own));
  } else if (mine->made_by != channel.made_by) {
    return false;
  }
  return true;
}

/// Reports the channels that two inputs have in common, in one message.
void Graph::tell_collisions(std::size_t node, std::size_t k, const Stream& all, const std::vector<std::string>& names,
                            config::Diagnostics& diagnostics) const {
  const InputSpec& input = input_specs_[node][k];
  const Stream& other = nodes_[inputs_[node][k]]->output();
  diagnostics.error(input.at,
                    fmt::format("node '{}' joins two different '{}': of node '{}' and of node '{}'", nodes_[node]->name,
                                fmt::join(names, "', '"), nodes_[all.find(names.front())->made_by]->name,
                                nodes_[other.find(names.front())->made_by]->name),
                    fmt::format("remove or rename them before the join, e.g. with the stage channels and {}",
                                config::assignment(input.at, "drop", fmt::format("[{}]", fmt::join(names, ", ")))));
}

Stream Graph::joined(std::size_t node, config::Diagnostics& diagnostics, bool& right) {
  Stream all = nodes_[inputs_[node].front()]->output();
  const Node& self = *nodes_[node];
  for (std::size_t k = 1; k < inputs_[node].size(); ++k) {
    const Node& other = *nodes_[inputs_[node][k]];
    std::vector<std::string> collisions;
    for (const Channel& channel : other.output().channels) {
      if (!join_channel(node, k, channel, all)) collisions.push_back(channel.name);
    }
    if (!collisions.empty()) tell_collisions(node, k, all, collisions, diagnostics);
    right = right && collisions.empty();
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
  return all;
}

/// Checks {port: node}: the node must provide the channels that the port reads.
bool Graph::ports_are_served(std::size_t node, config::Diagnostics& diagnostics) const {
  const Node& self = *nodes_[node];
  bool right = true;
  for (std::size_t k = 0; k < inputs_[node].size(); ++k) {
    const InputSpec& input = input_specs_[node][k];
    if (input.port.empty()) continue;
    std::vector<std::string> ports;
    const tofgraph_port* port = nullptr;
    for (const tofgraph_port& candidate : self.stage().own_ports) {
      if (candidate.direction == TOFGRAPH_DIRECTION_OUT) continue;
      ports.emplace_back(candidate.name);
      if (input.port == candidate.name) port = &candidate;
    }
    const auto has = [&](const std::string& channel) {
      return nodes_[inputs_[node][k]]->output().find(channel) != nullptr;
    };
    if (port == nullptr) {
      diagnostics.error(input.at, fmt::format("the stage {} has no input '{}'", self.stage().name, input.port),
                        config::suggestion(input.port, ports, "inputs"));
    } else if (std::ranges::none_of(alternatives(*port), has)) {
      diagnostics.error(
          input.at,
          fmt::format("node '{}' has no {} for the input '{}' of '{}'", input.node,
                      fmt::join(alternatives(*port), " or "), input.port, self.name),
          host_.known_stages->way_to(alternatives(*port), nodes_[inputs_[node][k]]->output(), self.stage().name));
    } else {
      continue;
    }
    right = false;
  }
  return right;
}

/// Creates and prepares the nodes in order. Readers of a failed node are skipped, so that an error is reported once.
void Graph::prepare(const GraphOptions& options, config::Diagnostics& diagnostics) {
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
      right = ports_are_served(i, diagnostics) && right;
    }
    for (const Stream& stream : joined_streams) streams.push_back(&stream);
    for (const std::size_t k : inputs_[i]) {
      if (node.many_inputs()) streams.push_back(&nodes_[k]->output());
      names.push_back(nodes_[k]->name);
    }
    names.resize(std::max(names.size(), streams.size()), "");
    good[i] = right && node.prepare(streams, names, diagnostics);
    if (node.is_source() && good[i] && camera_ && camera_->folder)
      check_recording(*camera_->folder, node.output().source, options.other_serial, camera_at_, diagnostics);
    if (node.is_source() && good[i]) queue_ = written_queue_.value_or(default_queue(node.output()));
    for (const UsedFile& file : node.files()) host_.inputs.emplace_back(file.path);
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    nodes_[i]->set_provenance(
        [this, i, whole = static_cast<bool>(good[i])] { return whole ? config::json_text(provenance(i), 2) : "{}"; });
    const bool read =
        std::ranges::any_of(inputs_, [&](const auto& in) { return std::ranges::find(in, i) != in.end(); });
    if (!read && !nodes_[i]->is_sink() && diagnostics.ok()) {
      diagnostics.warning(nodes_[i]->at,
                          fmt::format("nothing reads node '{}': its result is discarded", nodes_[i]->name));
    }
  }
}

std::set<std::size_t> Graph::steps_to(std::size_t node) const {
  std::set<std::size_t> steps(nodes_[node]->output().history.begin(), nodes_[node]->output().history.end());
  for (const std::size_t input : inputs_[node])
    steps.insert(nodes_[input]->output().history.begin(), nodes_[input]->output().history.end());
  return steps;
}

nlohmann::json Graph::provenance(std::size_t node) const {
  nlohmann::json stages = nlohmann::json::array();
  std::set<std::size_t> steps = steps_to(node);
  for (const std::size_t other : nodes_with_same_companion(nodes_, node)) steps.merge(steps_to(other));
  for (const std::size_t i : steps) {
    const Node& step = *nodes_[i];
    nlohmann::json files = nlohmann::json::array();
    for (const UsedFile& file : step.files()) {
      const std::string& hash = file.hash->get([this] { return !host_.wants_hashes(); });
      if (hash.empty() && host_.message)
        host_.message(
            step.name,
            fmt::format("the hash of {} is not in the provenance: the run did not end in order, or the file is gone",
                        file.path),
            true);
      files.push_back({{"path", file.path}, {"sha256", hash.empty() ? nlohmann::json() : nlohmann::json(hash)}});
    }
    stages.push_back({{"node", step.name},
                      {"stage", step.stage().name},
                      {"version", step.stage().version},
                      {"library", {{"path", step.stage().file.path.string()}, {"sha256", library_hash(step.stage())}}},
                      {"parameters", step.first_parameters()},
                      {"files", std::move(files)}});
    if (!step.changes().empty()) stages.back()["changes"] = step.changes();
  }
  nlohmann::json json = {{"format", "tofgraph-provenance"},
                         {"version", 1},
                         {"program", "tofgraph " + host_.version},
                         {"pipeline", name_},
                         {"stages", std::move(stages)}};
  const Stream& out = nodes_[node]->output();
  if (out.source != "{}") json["source"] = nlohmann::json::parse(out.source);
  if (out.camera) {
    json["camera"] = {{"name", out.camera->view().name}, {"measured", out.camera->measured}};
    if (!out.camera->file.empty()) {
      json["camera"]["profile"] = out.camera->file.string();
      json["camera"]["sha256"] = io::sha256_of_file(out.camera->file);
    }
  }
  return json;
}

std::unique_ptr<Graph> build_graph(const config::Value& document, const std::vector<std::string>& settings,
                                   const GraphOptions& options, config::Diagnostics& diagnostics) {
  PipelineSpec pipeline = parse_pipeline(document, diagnostics);
  for (const std::string& setting : settings) apply_setting(pipeline, setting, diagnostics);
  return std::make_unique<Graph>(pipeline, options, diagnostics);
}

}  // namespace tofgraph::graph
