// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/scene_text.hpp"

#include <fmt/format.h>

namespace tofgraph::simulation {
namespace {

using core::Entry;
using core::Value;

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return result + "\"";
}

std::string scalar(const Value& value) {
  constexpr const char* special = ",[]{}#:&*!|>'\"%@`\\\n";
  return value.quoted || value.text.empty() || value.text.find_first_of(special) != std::string::npos
             ? quoted(value.text)
             : value.text;
}

/// Keys whose words are files.
bool names_file(std::string_view key) {
  return key == "file" || key == "image" || key == "model" || key == "table" || key == "map";
}

std::string flow(const Value& value, std::string_view key) {
  std::string text;
  if (value.is_list()) {
    for (const Value& item : value.items) text += (text.empty() ? "" : ", ") + flow(item, {});
    return "[" + text + "]";
  }
  if (value.is_map()) {
    for (const Entry& entry : value.entries)
      text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", entry.key, flow(entry.value, entry.key));
    return "{" + text + "}";
  }
  if (!names_file(key) || !value.at.source) return scalar(value);
  return quoted(std::filesystem::absolute(value.at.source->base / value.text).lexically_normal().string());
}

}  // namespace

std::string scene_text(const Value& document) {
  std::string text;
  for (const Entry& entry : document.entries) {
    if (!entry.value.is_list()) {
      // a profile may be a path too
      const bool path = entry.key == "camera" && entry.value.text.find('/') != std::string::npos;
      text += fmt::format("{}: {}\n", entry.key, flow(entry.value, path ? "file" : entry.key));
      continue;
    }
    text += entry.key + ":\n";
    for (const Value& item : entry.value.items) text += "  - " + flow(item, {}) + "\n";
  }
  return text;
}

}  // namespace tofgraph::simulation
