// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Reads the sequence of a scene.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "simulation/files/sequence.hpp"

namespace tofgraph::simulation {
namespace {

using config::Diagnostics;
using config::Entry;
using config::Reader;
using config::Value;

constexpr std::size_t max_conditions = 100'000;

/// Every key that a sequence can set in this scene, for suggestions.
std::vector<std::string> possible_keys(const SceneFile& scene) {
  std::vector<std::string> keys = io::setting_keys();
  for (const std::string& object : scene.objects) keys.push_back(object + ".reflectivity");
  return keys;
}

void check_key(const Value& key, const SceneFile& scene, std::set<std::string>& seen, Diagnostics& diagnostics) {
  if (!key.is_scalar()) {
    diagnostics.error(key.at, fmt::format("a key of the sequence is {}, expected a word", key.described()),
                      "example: key: board.distance");
    return;
  }
  const std::string_view object = object_in(key.text);
  const auto& settings = io::setting_keys();
  if (!seen.insert(key.text).second) {
    diagnostics.error(key.at, fmt::format("the sequence sets '{}' twice", key.text));
  } else if (!object.empty()) {
    const std::string_view own = std::string_view(key.text).substr(object.size() + 1);
    if (std::ranges::find(scene.objects, object) == scene.objects.end())
      diagnostics.error(key.at, fmt::format("the scene has no object '{}'", object),
                        config::suggestion(object, scene.objects, "objects"));
    if (own == "name" || own == "type")
      diagnostics.error(key.at, fmt::format("a sequence cannot change the {} of an object", own));
  } else if (std::ranges::find(settings, key.text) == settings.end()) {
    diagnostics.error(
        key.at, fmt::format("a sequence cannot set '{}'", key.text),
        config::suggestion(key.text, possible_keys(scene), "keys") + " (or a key of an object: NAME.KEY)");
  }
}

/// Reads a row of a step: a single value, or one per key.
std::vector<Value> read_row(const Value& item, std::size_t keys, bool together, Diagnostics& diagnostics) {
  if (!together) return {item};
  if (!item.is_list() || item.items.size() != keys) {
    diagnostics.error(
        item.at,
        fmt::format("{} where {} keys change together: a list of {} values is expected", item.described(), keys, keys),
        "example: {keys: [target, board.reflectivity], values: [[white, 0.85], [black, 0.1]]}");
    return {};
  }
  return item.items;
}

SequenceStep read_step(const Value& item, const SceneFile& scene, std::set<std::string>& seen,
                       Diagnostics& diagnostics) {
  constexpr std::string_view values_example = "[500 mm, 1000 mm]";
  SequenceStep step;
  Reader reader(item, diagnostics, "a step of the sequence");
  const Entry* together = reader.take("keys");
  const Entry* key = together == nullptr ? reader.need("key", "board.distance") : together;
  if (key == nullptr) return step;
  if (together != nullptr && !together->value.is_list()) {
    diagnostics.error(together->value.at, fmt::format("'keys' is {}, expected a list", together->value.described()),
                      "example: keys: [target, board.reflectivity]");
    return step;
  }
  const std::vector<Value> one = {key->value};
  for (const Value& name : together != nullptr ? together->value.items : one) {
    check_key(name, scene, seen, diagnostics);
    step.keys.push_back(name.text);
  }
  const Entry* values = reader.need("values", values_example);
  reader.finish();
  if (values == nullptr) return step;
  if (!values->value.is_list() || values->value.items.empty()) {
    diagnostics.error(values->value.at,
                      fmt::format("'values' is {}, expected a list of at least one value",
                                  values->value.is_list() ? "an empty list" : values->value.described()),
                      fmt::format("example: values: {}", values_example));
    return step;
  }
  for (const Value& row : values->value.items)
    step.rows.push_back(read_row(row, step.keys.size(), together != nullptr, diagnostics));
  return step;
}

}  // namespace

std::vector<SequenceStep> read_sequence(const Value& list, const SceneFile& scene, Diagnostics& diagnostics) {
  std::vector<SequenceStep> steps;
  if (!list.is_list()) {
    diagnostics.error(list.at, fmt::format("'sequence' is {}, expected a list of steps", list.described()),
                      "example: sequence: [{key: board.distance, values: [500 mm, 1000 mm]}]");
    return steps;
  }
  std::set<std::string> seen;
  std::size_t conditions = 1;
  for (const Value& item : list.items) {
    steps.push_back(read_step(item, scene, seen, diagnostics));
    conditions = std::min(conditions * std::max<std::size_t>(steps.back().rows.size(), 1), max_conditions + 1);
  }
  if (conditions > max_conditions)
    diagnostics.error(list.at, fmt::format("the sequence makes more than {} conditions", max_conditions));
  return steps;
}

}  // namespace tofgraph::simulation
