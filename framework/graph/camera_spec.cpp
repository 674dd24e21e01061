// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/camera_spec.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace tofgraph::graph {
namespace {

/// Text after the colon and the parameters that it sets.
struct Kind {
  std::string_view name, backend, file_parameter, example;
};
constexpr Kind kinds[] = {{"camcube", "", "", ""},
                          {"replay", "replay", "file", "replay:board.h5"},
                          {"simulated", "simulated", "scene", "simulated:pipelines/scenes/board.yaml"}};

config::Value word(const std::string& text, config::Position at, std::size_t offset) {
  at.column += offset;
  at.length = std::max<std::size_t>(text.size(), 1);
  config::Value value;
  value.kind = config::Value::Kind::scalar;
  value.text = text;
  value.at = at;
  return value;
}

/// Quotes a file name with blanks for the one-line form.
std::string unquoted(std::string text) {
  const bool quoted = text.size() > 1 && text.front() == text.back() && (text.front() == '\'' || text.front() == '"');
  return quoted ? text.substr(1, text.size() - 2) : text;
}

[[noreturn]] void refuse(const config::Position& at, std::string message, std::string hint) {
  config::Diagnostics diagnostics;
  diagnostics.error(at, std::move(message), std::move(hint));
  throw config::ConfigurationError(diagnostics);
}

}  // namespace

bool is_camera_spec(std::string_view word) { return word.find(':') != std::string_view::npos; }

config::Value camera_node(const std::string& spec, const config::Position& at) {
  const auto colon = std::min(spec.find(':'), spec.size());
  const std::string name = spec.substr(0, colon), rest = unquoted(colon < spec.size() ? spec.substr(colon + 1) : "");
  const auto kind = std::ranges::find(kinds, name, &Kind::name);
  if (kind == std::end(kinds)) {
    std::vector<std::string> names;
    for (const Kind& known : kinds) names.emplace_back(known.name);
    const std::string near = config::nearest(name, names);
    refuse(at, fmt::format("there is no camera '{}'", spec),
           fmt::format("{}a camera is one of {}", near.empty() ? "" : fmt::format("did you mean '{}'? ", near),
                       camera_specs));
  }
  config::Value node;
  node.kind = config::Value::Kind::map;
  node.at = at;
  const auto add = [&](const char* key, const std::string& text, std::size_t offset) {
    config::Value value = word(text, at, offset);
    node.entries.push_back({key, value.at, value});
  };
  add("stage", "camcube", 0);
  if (kind->file_parameter.empty()) {
    if (colon == spec.size()) return node;
    if (rest != "usb" && rest != "pmdsdk")
      refuse(at, fmt::format("a camcube is reached by usb or pmdsdk, not by '{}'", rest), "example: camcube:usb");
    add("backend", rest, colon + 1);
    return node;
  }
  if (rest.empty()) refuse(at, fmt::format("'{}' names no file", spec), fmt::format("example: {}", kind->example));
  add("backend", std::string(kind->backend), 0);
  add(std::string(kind->file_parameter).c_str(), rest, colon + 1);
  return node;
}

}  // namespace tofgraph::graph
