// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/condition.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tofgraph::io {
namespace {

using config::Diagnostics;
using config::Reader;
using config::Value;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// One of two words, or nothing.
void read_choice(config::Reader& reader, const config::Value& map, std::string_view key,
                 const std::array<std::string, 2>& words, std::string& result) {
  if (map.find(key) == nullptr)
    reader.take(key);
  else
    result = reader.choice(key, words);
}

void add_source(const config::Value& name, const io::Camera* camera, std::vector<std::string>& sources,
                config::Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (std::uint64_t i = 0; camera != nullptr && i < camera->view().light_count; ++i)
    names.emplace_back(camera->view().lights[i].name);
  if (!name.is_scalar() || (camera != nullptr && std::ranges::find(names, name.text) == names.end())) {
    diagnostics.error(name.at, fmt::format("'sources' names {}, which the camera does not have", name.described()),
                      config::suggestion(name.text, names, "sources of the camera") + " (or both: all of them)");
  } else if (std::ranges::find(sources, name.text) != sources.end()) {
    diagnostics.error(name.at, fmt::format("'sources' names '{}' twice", name.text));
  } else {
    sources.push_back(name.text);
  }
}

void read_sources(const config::Value& value, const io::Camera* camera, std::vector<std::string>& sources,
                  config::Diagnostics& diagnostics) {
  sources.clear();
  if (value.is_scalar() && value.text == "both") return;
  if (!value.is_list()) return add_source(value, camera, sources, diagnostics);
  if (value.items.empty())
    diagnostics.error(value.at, "'sources' is an empty list: at least one source must be on", "example: sources: both");
  for (const config::Value& item : value.items) add_source(item, camera, sources, diagnostics);
}

}  // namespace

const std::vector<std::string>& setting_keys() {
  static const std::vector<std::string> keys = {"integration_time", "sources", "ambient", "time_since_power_on",
                                                "velocity",         "target",  "roll",    "session",
                                                "reference",        "lens",    "rail",    "temperature"};
  return keys;
}

void read_settings(config::Reader& reader, const config::Value& map, const io::Camera* camera, Condition& condition,
                   config::Diagnostics& diagnostics) {
  condition.target = reader.word("target", condition.target);
  condition.integration_time =
      reader.number_within("integration_time", "s", "1 ms", condition.integration_time, 1e-9, 1e3);
  if (const config::Entry* sources = reader.take("sources"))
    read_sources(sources->value, camera, condition.sources, diagnostics);
  condition.ambient = reader.word("ambient", condition.ambient);
  condition.time_since_power_on =
      reader.number_within("time_since_power_on", "s", "3600 s", condition.time_since_power_on, 0, infinity);
  condition.roll = reader.number("roll", "rad", "180 deg", condition.roll);
  condition.velocity = reader.number("velocity", "m/s", "100 mm/s", condition.velocity);
  condition.temperature = reader.number_within("temperature", "K", "25 degC", condition.temperature, 0, infinity);
  condition.session = reader.word("session", condition.session);
  read_choice(reader, map, "reference", {"rail", "laser"}, condition.reference);
  read_choice(reader, map, "lens", {"open", "capped"}, condition.lens);
  read_choice(reader, map, "rail", {"bare", "covered"}, condition.rail);
}

}  // namespace tofgraph::io
