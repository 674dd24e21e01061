// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/scene_text.hpp"

#include <fmt/format.h>

namespace tofgraph::simulation {
namespace {

using config::Entry;
using config::Value;

/// Keys whose words are files; a camera may be one.
bool names_file(const Entry& entry) {
  if (entry.key == "camera")
    return entry.value.text.find('/') != std::string::npos || entry.value.text.ends_with(".yaml");
  return entry.key == "file" || entry.key == "image" || entry.key == "model" || entry.key == "table" ||
         entry.key == "map";
}

void make_paths_absolute(Value& value) {
  for (Value& item : value.items) make_paths_absolute(item);
  for (Entry& entry : value.entries) {
    if (entry.value.kind == Value::Kind::scalar && names_file(entry))
      entry.value.text = std::filesystem::absolute(config::path_at(entry.value.text, entry.value.at)).string();
    else
      make_paths_absolute(entry.value);
  }
}

}  // namespace

std::string scene_text(const Value& document) {
  Value scene = document;
  make_paths_absolute(scene);
  std::string text;
  for (const Entry& entry : scene.entries) {
    text += fmt::format("{}:", entry.key);
    if (!entry.value.is_list() || entry.key == "output") {
      text += fmt::format(" {}\n", config::yaml_text(entry.value));
      continue;
    }
    text += "\n";
    for (const Value& item : entry.value.items) text += fmt::format("  - {}\n", config::yaml_text(item));
  }
  return text;
}

}  // namespace tofgraph::simulation
