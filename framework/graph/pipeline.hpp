// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A pipeline as written: nodes, their inputs and parameters. Nothing is loaded here.
#pragma once

#include "config/document.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::graph {

enum class QueuePolicy { block, drop_oldest };

/// Capacity of the queue at a source's output, and policy for a full queue.
struct Queue {
  std::size_t capacity = 4;
  QueuePolicy policy = QueuePolicy::block;
  config::Position at;
};

struct InputSpec {
  std::string port;  ///< empty: the whole frame
  std::string node;
  config::Position at;
};

struct NodeSpec {
  std::string name, stage;
  config::Position at, stage_at;
  std::vector<config::Entry> parameters;
  std::optional<std::vector<InputSpec>> inputs;  ///< none: the nearest preceding node that is not a sink
  std::optional<Queue> queue;
};

struct PipelineSpec {
  std::string name;
  std::optional<config::Value> camera;
  config::Position at;
  std::vector<NodeSpec> nodes;
};

/// Reads the grammar of a pipeline file; errors go to the diagnostics.
PipelineSpec parse_pipeline(const config::Value& document, config::Diagnostics& diagnostics);

/// Converts the one-line form, "reader file=a.h5 ! decoder ! writer path=b.pcd", to the equivalent document.
/// @param camera a profile's name or path, may be empty. @throws ConfigurationError
config::Value pipeline_from_line(const std::string& line, const std::string& camera);

/// Reads a pipeline file, or the one-line form if there is no such file and the text does not end in .yaml.
/// @param camera takes precedence over the file's; may be empty. @throws ConfigurationError
config::Value document_of(const std::string& file_or_line, const std::string& camera);

/// Replaces or adds a parameter: "NODE.PARAMETER=VALUE", as on the command line.
void apply_setting(PipelineSpec& pipeline, const std::string& setting, config::Diagnostics& diagnostics);

}  // namespace tofgraph::graph
