// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/files/sequence.hpp"

#include "io/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <set>

namespace tofgraph::simulation {
namespace {

using config::Diagnostics;
using config::Entry;
using config::Position;
using config::Reader;
using config::Value;
namespace fs = std::filesystem;

/// Value of the sequence that replaces one of the scene.
struct Setting {
  const std::string* key;
  const Value* value;
};

using Settings = std::vector<Setting>;

void replace(Value& map, std::string_view key, const Value& value) {
  const auto entry = std::ranges::find(map.entries, key, &Entry::key);
  if (entry != map.entries.end())
    entry->value = value;
  else
    map.entries.push_back({std::string(key), value.at, value});
}

/// Map of the object with the values of this condition.
Value description(const SceneFile& scene, std::size_t index, const Settings& settings) {
  Value map = scene.document.find("objects")->value.items[index];
  for (const Setting& setting : settings) {
    const std::string_view name = object_in(*setting.key);
    if (name == scene.objects[index])
      replace(map, std::string_view(*setting.key).substr(name.size() + 1), *setting.value);
  }
  return map;
}

Objects read_objects(const SceneFile& scene, const Settings& settings, Diagnostics& diagnostics) {
  Objects objects;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    objects.all.push_back(read_object(description(scene, i, settings), diagnostics));
    objects.all.back().name = scene.objects[i];
  }
  return objects;
}

Condition read_condition(const SceneFile& scene, const Settings& settings, Diagnostics& diagnostics) {
  Value map;
  map.kind = Value::Kind::map;
  for (const Setting& setting : settings) {
    if (object_in(*setting.key).empty()) replace(map, *setting.key, *setting.value);
  }
  Condition condition = scene.settings;
  Reader reader(map, diagnostics, "the sequence");
  io::read_settings(reader, map, scene.camera.get(), condition, diagnostics);
  return condition;
}

std::size_t count_conditions(const SceneFile& scene) {
  std::size_t count = 1;
  for (const SequenceStep& step : scene.sequence) count *= step.rows.size();
  return count;
}

/// Values of one condition of the product, the last step varying fastest.
Settings settings_of(const SceneFile& scene, std::size_t condition) {
  Settings settings;
  std::size_t left = count_conditions(scene);
  for (const SequenceStep& step : scene.sequence) {
    left /= step.rows.size();
    const std::vector<Value>& row = step.rows[condition / left % step.rows.size()];
    for (std::size_t k = 0; k < step.keys.size(); ++k) settings.push_back({&step.keys[k], &row[k]});
  }
  return settings;
}

/// Position of the value of an object's key, in the sequence or at the object; otherwise that of the object.
Position place_of(const SceneFile& scene, std::size_t index, const std::string& key, const Settings& settings) {
  const Value map = description(scene, index, settings);
  const Entry* entry = map.find(key);
  return entry != nullptr ? entry->value.at : map.at;
}

/// "500mm_0.5ms": values of the sequence for this condition, valid in file names.
std::string label(const Settings& settings) {
  std::string text;
  for (const Setting& setting : settings) {
    if (!setting.value->is_scalar()) continue;
    text += '_';
    for (const char c : setting.value->text) {
      if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-') text += c;
    }
  }
  return text;
}

/// Sets the ground truth of the board for campaigns; only for scenes that consist of one board.
void state_board(const Objects& objects, Condition& condition) {
  const Object& object = objects.all.front();
  if (objects.all.size() != 1 || object.type != "board") return;
  const Board& board = std::get<Board>(object.form);
  condition.board_distance = board.target.distance;
  condition.board_tilt_x = board.target.tilt_x;
  condition.board_tilt_y = board.target.tilt_y;
  if (std::isfinite(board.width)) condition.board_size = {board.width, board.height};
  condition.reflectivity = object.reflectivity;
  if (condition.target.empty()) condition.target = fmt::format("{}", object.reflectivity);
}

}  // namespace

void check_values(const SceneFile& scene, Diagnostics& diagnostics) {
  for (const SequenceStep& step : scene.sequence) {
    for (const std::vector<Value>& row : step.rows) {
      Settings settings;
      for (std::size_t k = 0; k < step.keys.size(); ++k) settings.push_back({&step.keys[k], &row[k]});
      read_condition(scene, settings, diagnostics);
      // Checks only what this row changes.
      for (std::size_t i = 0; i < scene.objects.size(); ++i) {
        const auto here = [&](const Setting& s) { return object_in(*s.key) == scene.objects[i]; };
        if (std::ranges::any_of(settings, here)) read_object(description(scene, i, settings), diagnostics);
      }
    }
  }
}

void check_geometry(const SceneFile& scene, Diagnostics& diagnostics) {
  const Vector3 lens{0, 0, scene.camera->view().focal_length};
  std::set<std::tuple<std::size_t, std::size_t, std::string>> told;
  for (std::size_t condition = 0; condition < count_conditions(scene); ++condition) {
    const Settings settings = settings_of(scene, condition);
    Diagnostics unused;
    const Objects objects = read_objects(scene, settings, unused);
    for (std::size_t i = 0; i < objects.all.size(); ++i) {
      const Problem problem = problem_of(objects.all[i], lens);
      if (problem.text.empty()) continue;
      const Position at = place_of(scene, i, problem.key, settings);
      if (told.emplace(at.line, at.column, problem.text).second) diagnostics.error(at, problem.text, problem.hint);
    }
  }
}

std::vector<SceneCondition> expand(const SceneFile& scene) {
  std::vector<SceneCondition> conditions;
  for (std::size_t i = 0; i < count_conditions(scene); ++i) {
    const Settings settings = settings_of(scene, i);
    Diagnostics diagnostics;
    SceneCondition condition{read_condition(scene, settings, diagnostics), nullptr};
    auto objects = std::make_shared<Objects>(read_objects(scene, settings, diagnostics));
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    condition.id = fmt::format("{:04}{}", i, label(settings));
    state_board(*objects, condition);
    condition.objects = std::move(objects);
    conditions.push_back(std::move(condition));
  }
  return conditions;
}

config::Value document_of(const SceneFile& scene, std::size_t condition) {
  Value document = scene.document;
  const Settings settings = settings_of(scene, condition);
  const auto objects = std::ranges::find(document.entries, std::string("objects"), &Entry::key);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    Value name;
    name.kind = Value::Kind::scalar;
    name.text = scene.objects[i];
    name.at = objects->at;
    objects->value.items[i] = description(scene, i, settings);
    replace(objects->value.items[i], "name", name);
  }
  for (const Setting& setting : settings) {
    if (object_in(*setting.key).empty()) replace(document, *setting.key, *setting.value);
  }
  std::erase_if(document.entries, [](const Entry& entry) { return entry.key == "sequence"; });
  return document;
}

std::optional<io::Pattern> pattern_of(const SceneFile& scene) {
  std::optional<io::Pattern> pattern;
  Diagnostics unused;
  for (const Object& object : read_objects(scene, {}, unused).all) {
    const auto* board = std::get_if<Chessboard>(&object.form);
    if (board == nullptr) continue;
    if (pattern) return std::nullopt;
    pattern = io::Pattern{board->columns, board->rows, board->square};
  }
  return pattern;
}

std::string camera_name_in(const SceneFile& scene, const fs::path& folder) {
  return io::camera_name_in(scene.document.find("camera")->value, folder);
}

}  // namespace tofgraph::simulation
