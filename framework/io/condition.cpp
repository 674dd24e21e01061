// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/condition.hpp"

#include "config/quantity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>

namespace tofgraph::io {
namespace {

using config::Diagnostics;
using config::Reader;
using config::Value;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Reads one of two words; a missing key leaves `result` unchanged.
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

Roi read_roi(const config::Value& value, const io::Camera* camera, config::Diagnostics& diagnostics) {
  config::Reader reader(value, diagnostics, "'roi'");
  const auto last = [&](std::uint32_t size) {
    return camera != nullptr ? size - 1 : std::numeric_limits<std::uint32_t>::max();
  };
  const config::Entry* columns = reader.need("columns", "[0, 203]");
  const config::Entry* rows = reader.need("rows", "[0, 203]");
  reader.finish();
  if (columns == nullptr || rows == nullptr) return {};
  const std::uint32_t width = camera != nullptr ? camera->view().width : 0;
  const std::uint32_t height = camera != nullptr ? camera->view().height : 0;
  const auto c = read_span(*columns, last(width), "[0, 203]", diagnostics);
  const auto r = read_span(*rows, last(height), "[0, 203]", diagnostics);
  if (!c || !r) return {};
  const auto pixel = [](std::uint64_t v) { return static_cast<std::uint32_t>(v); };
  return {pixel(c->at(0)), pixel(c->at(1)), pixel(r->at(0)), pixel(r->at(1))};
}

}  // namespace

std::optional<std::array<std::uint64_t, 2>> read_span(const config::Entry& entry, std::uint64_t max,
                                                      std::string_view example, config::Diagnostics& diagnostics) {
  const config::Value& value = entry.value;
  std::array<std::uint64_t, 2> span{};
  bool right = value.is_list() && value.items.size() == 2;
  for (std::size_t i = 0; right && i < 2; ++i) {
    const auto number = config::parse_quantity(value.items[i].text, "");
    right = value.items[i].is_scalar() && number.ok() && number.value >= 0 && number.value <= 1e15 &&
            number.value == std::floor(number.value);
    if (right) span[i] = static_cast<std::uint64_t>(number.value);
  }
  if (right && span[0] <= span[1] && span[1] <= max) return span;
  const std::string limit = max < std::numeric_limits<std::uint32_t>::max() ? fmt::format(", at most {}", max) : "";
  diagnostics.error(
      value.at, fmt::format("'{}' must be two whole numbers, the first and the last, from 0 on{}", entry.key, limit),
      fmt::format("example: {}: {}", entry.key, example));
  return std::nullopt;
}

void read_source_words(const std::string& words, const config::Position& at, const io::Camera* camera,
                       std::vector<std::string>& sources, config::Diagnostics& diagnostics) {
  std::istringstream in(words);
  std::vector<std::string> names{std::istream_iterator<std::string>(in), {}};
  config::Value value{.kind = config::Value::Kind::list, .at = at};
  for (const std::string& name : names)
    value.items.push_back({.kind = config::Value::Kind::scalar, .text = name, .at = at});
  read_sources(names.size() == 1 ? value.items.front() : value, camera, sources, diagnostics);
}

const std::vector<std::string>& setting_keys() {
  static const std::vector<std::string> keys = {
      "integration_time", "sources", "ambient", "time_since_power_on", "velocity", "target", "roll", "session",
      "reference",        "lens",    "rail",    "temperature",         "roi"};
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
  if (const config::Entry* roi = reader.take("roi")) condition.roi = read_roi(roi->value, camera, diagnostics);
}

}  // namespace tofgraph::io
