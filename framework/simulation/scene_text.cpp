// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/scene_text.hpp"

#include <fmt/format.h>

namespace tofgraph::simulation {

using config::Entry;
using config::Value;

std::string scene_text(const Value& document) {
  const Value scene = config::with_absolute_paths(document);
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
