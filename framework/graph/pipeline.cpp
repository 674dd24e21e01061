// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/pipeline.hpp"

#include "graph/camera_spec.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace tofgraph::graph {
namespace {

constexpr std::string_view node_example = "{name: decode, stage: four_phase_decoder}";

bool is_name(const std::string& name) {
  return !name.empty() &&
         std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; });
}

void add_input(std::vector<InputSpec>& inputs, const std::string& port, const config::Value& value,
               config::Diagnostics& diagnostics) {
  if (value.is_scalar())
    inputs.push_back({port, value.text, value.at});
  else
    diagnostics.error(value.at, fmt::format("an input is {}, expected the name of a node", value.described()),
                      "example: inputs: [decode]");
}

std::vector<InputSpec> parse_inputs(const config::Value& value, config::Diagnostics& diagnostics) {
  std::vector<InputSpec> inputs;
  if (value.is_scalar()) add_input(inputs, "", value, diagnostics);
  for (const config::Value& item : value.items) add_input(inputs, "", item, diagnostics);
  for (const config::Entry& entry : value.entries) add_input(inputs, entry.key, entry.value, diagnostics);
  if (inputs.empty())
    diagnostics.error(value.at, "'inputs' is empty",
                      "omit it to read the node above, or name a node: inputs: [decode]");
  return inputs;
}

Queue parse_queue(const config::Value& value, config::Diagnostics& diagnostics) {
  Queue queue;
  queue.at = value.at;
  config::Reader reader(value, diagnostics, "the queue");
  const double capacity = reader.number("capacity", "", "4", 4.0);
  if (capacity >= 1 && capacity <= 1024 && capacity == static_cast<double>(static_cast<int>(capacity))) {
    queue.capacity = static_cast<std::size_t>(capacity);
  } else {
    diagnostics.error(value.at,
                      fmt::format("the queue's capacity is {}, expected a whole number from 1 to 1024", capacity));
  }
  const std::string policy = reader.word("policy", "block");
  if (policy == "drop_oldest")
    queue.policy = QueuePolicy::drop_oldest;
  else if (policy != "block") {
    const std::vector<std::string> known = {"block", "drop_oldest"};
    diagnostics.error(value.find("policy")->value.at, fmt::format("there is no queue policy '{}'", policy),
                      config::suggestion(policy, known, "policies"));
  }
  reader.finish();
  return queue;
}

/// Splits a node's keys: the reserved ones are read here, all others are parameters of the stage.
NodeSpec parse_node(const config::Value& value, config::Diagnostics& diagnostics) {
  NodeSpec node;
  node.at = value.at;
  if (!value.is_map()) {
    diagnostics.error(value.at, fmt::format("a node is {}, expected keys and values", value.described()),
                      fmt::format("example: - {}", node_example));
    return node;
  }
  for (const config::Entry& entry : value.entries) {
    const config::Value& v = entry.value;
    if (entry.key == "inputs")
      node.inputs = parse_inputs(config::without_quotes(v), diagnostics);
    else if (entry.key == "queue")
      node.queue = parse_queue(v, diagnostics);
    else if (entry.key != "name" && entry.key != "stage")
      node.parameters.push_back(entry);
    else if (!v.is_scalar())
      diagnostics.error(v.at, fmt::format("'{}' is {}, expected a word", entry.key, v.described()),
                        fmt::format("example: - {}", node_example));
    else if (entry.key == "name") {
      node.name = v.text;
      node.at = v.at;
    } else {
      node.stage = v.text;
      node.stage_at = v.at;
    }
  }
  if (node.stage.empty())
    diagnostics.error(node.at, "a node has no 'stage'", fmt::format("example: - {}", node_example));
  if (node.name.empty()) {
    node.name = node.stage;
    if (node.stage_at.line > 0) node.at = node.stage_at;
  } else if (!is_name(node.name)) {
    diagnostics.error(node.at, fmt::format("'{}' is not a name: letters, digits, _ and - are allowed", node.name));
  }
  return node;
}

/// Word of the one-line form with its position; quotes protect blanks and !.
struct Word {
  std::string text;
  std::size_t column;
};

std::vector<Word> split_line(const std::string& line, const std::shared_ptr<config::SourceText>& source) {
  std::vector<Word> words;
  int brackets = 0;
  bool inside = false;
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote == 0 && brackets == 0 && (c == ' ' || c == '\t' || c == '\n')) {
      inside = false;
      continue;
    }
    if (!inside) words.push_back({"", i + 1});
    inside = true;
    words.back().text += c;
    if (quote != 0)
      quote = c == quote ? '\0' : quote;
    else if (c == '"' || c == '\'')
      quote = c;
    else if (c == '[' || c == '{')
      ++brackets;
    else if (c == ']' || c == '}')
      --brackets;
  }
  if (quote != 0 || brackets != 0) {
    config::Diagnostics diagnostics;
    diagnostics.error({source, 1, words.back().column, 1},
                      quote != 0 ? "a quote is not closed" : "a bracket is not closed");
    throw config::ConfigurationError(diagnostics);
  }
  return words;
}

config::Value scalar(std::string text, const config::Position& at) {
  config::Value value;
  value.kind = config::Value::Kind::scalar;
  value.text = std::move(text);
  value.at = at;
  return value;
}

/// Node that begins with its stage or with a camera specification such as `replay:FILE`.
config::Value stage_node(const std::string& stage, const config::Position& at) {
  if (is_camera_spec(stage)) return camera_node(stage, at);
  config::Value node;
  node.kind = config::Value::Kind::map;
  node.at = at;
  node.entries.push_back({"stage", at, scalar(stage, at)});
  return node;
}

/// Converts the option --camera to a document entry.
config::Entry camera_entry(const std::string& camera) {
  const auto option =
      std::make_shared<config::SourceText>(config::SourceText{"--camera", camera, std::filesystem::current_path()});
  const config::Position at{option, 1, 1, camera.size()};
  return {"camera", at, scalar(camera, at)};
}

}  // namespace

PipelineSpec parse_pipeline(const config::Value& document, config::Diagnostics& diagnostics) {
  PipelineSpec pipeline;
  pipeline.at = document.at;
  config::check_version(document, "pipeline", 1, diagnostics);
  config::Reader reader(document, diagnostics, "the pipeline");
  reader.take("pipeline");
  pipeline.name = reader.word("name", "");
  if (const config::Entry* camera = reader.take("camera")) pipeline.camera = camera->value;
  if (pipeline.camera && !pipeline.camera->is_scalar()) {
    diagnostics.error(pipeline.camera->at,
                      fmt::format("'camera' is {}, expected a profile's name or path", pipeline.camera->described()),
                      "example: camera: camcube2");
    pipeline.camera.reset();
  }
  const config::Entry* nodes = reader.need("nodes", fmt::format("[{}]", node_example));
  reader.finish();
  if (nodes == nullptr) return pipeline;
  if (!nodes->value.is_list() || nodes->value.items.empty()) {
    diagnostics.error(nodes->value.at,
                      fmt::format("'nodes' is {}, expected a list of nodes",
                                  nodes->value.is_list() ? "empty" : nodes->value.described()),
                      fmt::format("example: - {}", node_example));
  }
  for (const config::Value& item : nodes->value.items) {
    NodeSpec node = parse_node(item, diagnostics);
    const auto twin = std::ranges::find(pipeline.nodes, node.name, &NodeSpec::name);
    if (twin != pipeline.nodes.end() && !node.name.empty()) {
      diagnostics.error(
          node.at, fmt::format("two nodes are called '{}'", node.name),
          fmt::format("the first is in line {}, column {}; give one of them another name: {}", twin->at.line,
                      twin->at.column, config::assignment(node.at, "name", node.name + "_2")));
    }
    pipeline.nodes.push_back(std::move(node));
  }
  return pipeline;
}

config::Value pipeline_from_line(const std::string& line, const std::string& camera) {
  const auto source = std::make_shared<config::SourceText>(
      config::SourceText{"command line", line, std::filesystem::current_path(), true});
  const auto place = [&](std::size_t column, std::size_t length) {
    return config::Position{source, 1, column, length};
  };
  const config::Position start = place(1, line.size());
  config::Diagnostics diagnostics;
  config::Value nodes;
  nodes.kind = config::Value::Kind::list;
  nodes.at = start;
  bool open = false;
  for (const Word& word : split_line(line, source)) {
    const config::Position at = place(word.column, word.text.size());
    if (word.text == "!") {
      if (!open)
        diagnostics.error(at, "a stage is missing before '!'",
                          "example: capture_reader file=a.h5 ! four_phase_decoder");
      open = false;
      continue;
    }
    if (!open) {
      nodes.items.push_back(stage_node(word.text, at));
      open = true;
      continue;
    }
    const auto equals = word.text.find('=');
    if (equals == std::string::npos || equals == 0) {
      diagnostics.error(at, fmt::format("'{}' is not a parameter", word.text),
                        "write parameter=value, values with blanks in quotes: strength='3.91 mm'");
      continue;
    }
    const config::Position value_at = place(word.column + equals + 1, word.text.size() - equals - 1);
    const std::string key = word.text.substr(0, equals);
    if (nodes.items.back().find(key) != nullptr) diagnostics.error(at, fmt::format("'{}' is written twice", key));
    config::Value value = config::parse_value(word.text.substr(equals + 1), value_at);
    nodes.items.back().entries.push_back({key, place(word.column, equals), std::move(value)});
  }
  if (!open)
    diagnostics.error(start, nodes.items.empty() ? "the pipeline is empty" : "a stage is missing after '!'",
                      "example: capture_reader file=a.h5 ! four_phase_decoder");
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  config::Value document;
  document.kind = config::Value::Kind::map;
  document.at = start;
  document.entries.push_back({"pipeline", start, scalar("1", start)});
  if (!camera.empty()) document.entries.push_back(camera_entry(camera));
  document.entries.push_back({"nodes", start, std::move(nodes)});
  return document;
}

config::Value document_of(const std::string& file_or_line, const std::string& camera) {
  std::error_code error;  // a line can be longer than any file name
  const bool file = file_or_line.ends_with(".yaml") || file_or_line.ends_with(".yml") ||
                    std::filesystem::is_regular_file(file_or_line, error);
  if (!file) return pipeline_from_line(file_or_line, camera);
  config::Value document = config::load_document(file_or_line);
  if (camera.empty()) return document;
  std::erase_if(document.entries, [](const config::Entry& entry) { return entry.key == "camera"; });
  document.entries.push_back(camera_entry(camera));
  return document;
}

void apply_setting(PipelineSpec& pipeline, const std::string& setting, config::Diagnostics& diagnostics) {
  const auto source =
      std::make_shared<config::SourceText>(config::SourceText{"--set", setting, std::filesystem::current_path(), true});
  const config::Position at{source, 1, 1, setting.size()};
  const auto equals = setting.find('=');
  const auto dot = setting.substr(0, equals).find('.');
  if (equals == std::string::npos || dot == std::string::npos) {
    diagnostics.error(at, "a setting is NODE.PARAMETER=VALUE", "example: --set denoise.strength='3.91 mm'");
    return;
  }
  const std::string name = setting.substr(0, dot);
  const std::string key = setting.substr(dot + 1, equals - dot - 1);
  std::vector<std::string> names;
  for (const NodeSpec& node : pipeline.nodes) names.push_back(node.name);
  const auto node = std::ranges::find(pipeline.nodes, name, &NodeSpec::name);
  if (node == pipeline.nodes.end()) {
    diagnostics.error({source, 1, 1, name.size()}, fmt::format("there is no node '{}'", name),
                      config::suggestion(name, names, "nodes"));
    return;
  }
  if (key == "name" || key == "stage" || key == "inputs" || key == "queue") {
    diagnostics.error({source, 1, dot + 2, key.size()},
                      fmt::format("'{}' is not a parameter of a stage and cannot be set here", key));
    return;
  }
  std::erase_if(node->parameters, [&](const config::Entry& entry) { return entry.key == key; });
  const config::Position value_at{source, 1, equals + 2, setting.size() - equals - 1};
  config::Value value = config::parse_value(setting.substr(equals + 1), value_at);
  node->parameters.push_back({key, {source, 1, dot + 2, key.size()}, std::move(value)});
}

}  // namespace tofgraph::graph
