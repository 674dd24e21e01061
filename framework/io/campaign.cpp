// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/campaign.hpp"

#include "config/quantity.hpp"
#include "io/pattern.hpp"
#include "io/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tofgraph::io {
namespace {

using config::Diagnostics;
using config::Entry;
using config::Reader;
using config::Value;

void read_board(const config::Value& value, const io::Camera* camera, Condition& condition,
                config::Diagnostics& diagnostics) {
  const std::size_t errors = diagnostics.errors();
  config::Reader reader(value, diagnostics, "the board");
  if (const config::Entry* distance = value.find("distance")) condition.places["distance"] = distance->value.at;
  condition.board_distance = reader.number("distance", "m", "500 mm", std::nullopt);
  const double most = std::numbers::pi / 2;
  condition.board_tilt_x = reader.number_within("tilt_x", "rad", "10 deg", 0.0, -most, most);
  condition.board_tilt_y = reader.number_within("tilt_y", "rad", "10 deg", 0.0, -most, most);
  if (const config::Entry* size = value.find("size")) {
    const std::vector<double> lengths = reader.numbers("size", "m", "[841 mm, 594 mm]", {1, 1});
    condition.board_size = {lengths[0], lengths[1]};
    if (!(std::min(lengths[0], lengths[1]) > 0))
      diagnostics.error(size->value.at, "'size' must be positive lengths", "example: size: [841 mm, 594 mm]");
  } else {
    reader.take("size");
  }
  reader.finish();
  if (diagnostics.errors() != errors) return;
  const std::string problem = detail::distance_problem(condition.board_distance, camera);
  if (!problem.empty()) diagnostics.error(value.find("distance")->value.at, fmt::format("'distance' {}", problem));
}

/// Reports missing ground truth of a condition.
void check_truth(const Campaign& campaign, const config::Value& map, const Condition& condition,
                 config::Diagnostics& diagnostics) {
  if (!map.is_map() || map.find("board") != nullptr || map.find("scene") != nullptr || campaign.pattern ||
      condition.is_capped())
    return;
  diagnostics.error(map.at,
                    "the condition does not state what was in front of the camera: a board, a scene, or a capped lens",
                    "example: board: {distance: 500 mm}");
}

Condition read_condition(const Campaign& campaign, const config::Value& map, Captures captures,
                         config::Diagnostics& diagnostics) {
  const io::Camera* camera = campaign.camera.get();
  Condition condition;
  condition.at = map.at;
  for (const config::Entry& entry : map.entries) condition.places[entry.key] = entry.value.at;
  config::Reader reader(map, diagnostics, "the condition");
  condition.id = reader.word("id", fmt::format("{}", campaign.conditions.size()));
  condition.capture = reader.input_file("capture", "captures/white_0500.h5", captures == Captures::must_be_there);
  if (const config::Entry* frames = reader.take("frames"))
    condition.frames = read_span(*frames, std::numeric_limits<std::uint64_t>::max(), "[0, 19]", diagnostics);
  if (const config::Entry* board = reader.take("board")) read_board(board->value, camera, condition, diagnostics);
  condition.reflectivity = reader.number_within("reflectivity", "", "0.8", condition.reflectivity, 0, 1);
  read_settings(reader, map, camera, condition, diagnostics);
  if (map.find("scene") != nullptr) condition.scene = reader.input_file("scene", "corner.yaml");
  reader.take("scene");
  if (map.find("order") != nullptr)
    condition.order = static_cast<std::uint64_t>(
        reader.whole_number("order", "3", std::nullopt, 0, std::numeric_limits<std::int64_t>::max()));
  reader.take("order");
  condition.recorded_at = reader.word("recorded_at", "");
  reader.finish();
  check_truth(campaign, map, condition, diagnostics);
  return condition;
}

void read_conditions(const config::Value& list, Campaign& campaign, Captures captures,
                     config::Diagnostics& diagnostics) {
  if (!list.is_list() || list.items.empty()) {
    diagnostics.error(list.at,
                      fmt::format("'conditions' is {}, expected a list of at least one condition",
                                  list.is_list() ? "an empty list" : list.described()),
                      "example: conditions: [{id: white-0500, capture: white_0500.h5, board: {distance: 500 mm}}]");
    return;
  }
  for (const config::Value& item : list.items) {
    Condition condition = read_condition(campaign, item, captures, diagnostics);
    const auto same = std::ranges::find(campaign.conditions, condition.id, &Condition::id);
    if (same != campaign.conditions.end())
      diagnostics.error(item.at, fmt::format("two conditions have the id '{}'", condition.id),
                        fmt::format("the first one is in line {}", same->at.line));
    campaign.conditions.push_back(std::move(condition));
  }
}

void read_charuco(config::Reader& reader, const config::Value& value, Pattern& pattern,
                  config::Diagnostics& diagnostics) {
  pattern.square = reader.number_within("square", "m", "30 mm", std::nullopt, 1e-6, 1e3);
  pattern.marker = reader.number_within("marker", "m", "22 mm", std::nullopt, 1e-6, 1e3);
  pattern.dictionary = reader.choice("dictionary", marker_dictionaries());
  const config::Entry* dictionary = value.is_map() ? value.find("dictionary") : nullptr;
  const std::size_t end = pattern.dictionary.find('_');
  if (dictionary != nullptr && end != std::string::npos) {
    const std::int64_t needed = (pattern.columns + 1) * (pattern.rows + 1) / 2;  // one in each bright square
    const std::int64_t there = std::stoll(pattern.dictionary.substr(end + 1));
    if (needed > there)
      diagnostics.error(dictionary->value.at,
                        fmt::format("a board of {} x {} inner corners has {} markers, the dictionary {} only {}",
                                    pattern.columns, pattern.rows, needed, pattern.dictionary, there),
                        needed <= 1000 ? "take a larger one, as the board was printed with: 4x4_1000 for example"
                                       : "no dictionary has more than 1000");
  }
  if (pattern.marker >= pattern.square && value.is_map() && value.find("marker") != nullptr)
    diagnostics.error(value.find("marker")->value.at, "'marker' must be smaller than the square around it",
                      "example: square: 30 mm, marker: 22 mm");
}

void read_circles(config::Reader& reader, const config::Value& value, Pattern& pattern,
                  config::Diagnostics& diagnostics) {
  pattern.square = reader.number_within("spacing", "m", "30 mm", std::nullopt, 1e-6, 1e3);
  pattern.diameter = reader.number_within("diameter", "m", "20 mm", std::nullopt, 1e-6, 1e3);
  const double limit = pattern.square * (pattern.type == Pattern::Type::circles ? 1 : std::numbers::sqrt2);
  if (pattern.diameter >= limit && value.is_map() && value.find("diameter") != nullptr)
    diagnostics.error(value.find("diameter")->value.at, "'diameter' is so large that the circles touch",
                      "example: spacing: 30 mm, diameter: 20 mm");
}

}  // namespace

Pattern read_pattern(const config::Value& value, config::Diagnostics& diagnostics) {
  static const std::vector<std::string> types = {"chessboard", "charuco", "circles", "asymmetric_circles"};
  config::Reader reader(value, diagnostics, "the pattern");
  Pattern pattern{.at = value.at};
  const std::string type = reader.choice("type", types);
  const auto at = std::ranges::find(types, type);
  if (at != types.end()) pattern.type = static_cast<Pattern::Type>(at - types.begin());
  const std::int64_t least = pattern.type == Pattern::Type::chessboard ? 3 : 2;  // fewer corners give chance matches
  pattern.columns = reader.whole_number("columns", "8", std::nullopt, least, 1000);
  pattern.rows = reader.whole_number("rows", "6", std::nullopt, least, 1000);
  if (pattern.type == Pattern::Type::chessboard)
    pattern.square = reader.number_within("square", "m", "30 mm", std::nullopt, 1e-6, 1e3);
  else if (pattern.type == Pattern::Type::charuco)
    read_charuco(reader, value, pattern, diagnostics);
  else
    read_circles(reader, value, pattern, diagnostics);
  reader.finish();
  return pattern;
}

const std::vector<std::string>& marker_dictionaries() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const char* size : {"4x4", "5x5", "6x6", "7x7"})
      for (const char* count : {"50", "100", "250", "1000"}) list.push_back(fmt::format("{}_{}", size, count));
    return list;
  }();
  return names;
}

std::string detail::distance_problem(double distance, const io::Camera* camera) {
  const double lens = camera != nullptr && camera->view().focal_length > 0 ? camera->view().focal_length : 0;
  if (distance > lens) return {};
  return fmt::format("is {}: the board would be behind the lens, which is {} from the sensor plane",
                     config::format_quantity(distance, "m"), config::format_quantity(lens, "m"));
}

namespace {

/// Text or list of texts.
std::vector<std::string> read_notes(const config::Entry& entry, config::Diagnostics& diagnostics) {
  const config::Value& value = entry.value;
  std::vector<std::string> notes;
  bool right = value.kind == config::Value::Kind::scalar || (value.is_list() && !value.items.empty());
  if (value.kind == config::Value::Kind::scalar) notes.push_back(value.text);
  for (const config::Value& item : value.items) {
    right = right && item.kind == config::Value::Kind::scalar;
    notes.push_back(item.text);
  }
  if (!right)
    diagnostics.error(value.kind == config::Value::Kind::null ? entry.at : value.at,
                      fmt::format("'note' is {}, expected a text or a list of texts", value.described()),
                      "example: note: the board of 2 m was moved by hand");
  return notes;
}

}  // namespace

namespace {

/// Reason why a campaign cannot be joined with others; empty: it can.
std::string joining_problem(const Campaign& all, const Campaign& member) {
  if (!member.camera || !all.camera) return {};  // reported where it is read
  if (std::string_view(member.camera->view().name) != all.camera->view().name)
    return fmt::format("was made with the camera '{}', this one with '{}'", member.camera->view().name,
                       all.camera->view().name);
  if (member.pattern) return "is for the calibration of a lens";
  if (!all.conditions.empty() && member.from_table != all.from_table)
    return "has captures while the others have tables, or the reverse";
  return {};
}

/// Reads and concatenates the conditions of other campaigns. Their ids are prefixed with the file name, which is also
/// the session of conditions that state none, because the setup may have moved between campaigns. If each states a
/// jitter, the largest one applies to all.
void read_members(const config::Value& list, Campaign& campaign, Captures captures, config::Diagnostics& diagnostics) {
  if (!list.is_list() || list.items.empty())
    return diagnostics.error(
        list.at,
        fmt::format("'campaigns' is {}, expected a list of files", list.is_list() ? "an empty list" : list.described()),
        "example: campaigns: [rail.yaml, warm_up.yaml]");
  double jitter = 0;
  for (const config::Value& item : list.items) {
    const std::filesystem::path file = config::path_at(item.text, item.at);
    try {
      const config::Value document = config::load_document(file);
      if (document.find("campaigns") != nullptr) {
        diagnostics.error(item.at, fmt::format("'{}' joins campaigns itself", item.text), "name its members instead");
        continue;
      }
      Campaign member = read_campaign(document, diagnostics, captures);
      if (const std::string problem = joining_problem(campaign, member); !problem.empty())
        diagnostics.error(item.at, fmt::format("the campaign {} {}", item.text, problem));
      const std::string name = file.stem();
      for (Condition& condition : member.conditions) {
        condition.id = fmt::format("{} {}", name, condition.id);
        if (condition.session.empty()) condition.session = name;
        condition.campaign = file;
        condition.order.reset();  // refers to its own campaign only
        const auto same = std::ranges::find(campaign.conditions, condition.id, &Condition::id);
        if (same != campaign.conditions.end())
          return diagnostics.error(item.at, fmt::format("two conditions have the id '{}'", condition.id),
                                   "campaigns that are joined need files with different names");
        campaign.conditions.push_back(std::move(condition));
      }
      campaign.from_table = member.from_table;
      jitter = std::max(jitter, member.jitter);
      for (const std::string& note : member.notes) campaign.notes.push_back(fmt::format("{}: {}", name, note));
    } catch (const config::ConfigurationError& failure) {
      diagnostics.add(failure, item.at);
    }
  }
  if (std::isinf(campaign.jitter)) campaign.jitter = jitter;
}

}  // namespace

Campaign read_campaign(const config::Value& document, config::Diagnostics& diagnostics, Captures captures) {
  Campaign campaign;
  config::check_version(document, "campaign", 1, diagnostics);
  config::Reader reader(document, diagnostics, "the campaign");
  reader.take("campaign");
  campaign.name = reader.word("name", "");
  if (const config::Entry* note = reader.take("note")) campaign.notes = read_notes(*note, diagnostics);
  if (const config::Entry* source = reader.take("source"))  // it may no longer exist
    campaign.source = config::path_at(source->value.text, source->value.at);
  if (const config::Entry* camera = reader.need("camera", "camcube2")) {
    campaign.camera_name = camera->value.text;
    campaign.camera_value = camera->value;
    campaign.camera = find_camera(camera->value, diagnostics);
  }
  if (const config::Entry* pattern = reader.take("pattern"))
    campaign.pattern = read_pattern(pattern->value, diagnostics);
  campaign.jitter = reader.number_within("jitter", "m", "0.5 mm", campaign.jitter, 1e-6, 1);
  const config::Entry* conditions = reader.take("conditions");
  const config::Entry* table = reader.take("table");
  const config::Entry* members = reader.take("campaigns");
  reader.finish();
  if (conditions != nullptr && table != nullptr)
    diagnostics.error(table->at, "a campaign has either 'conditions' or a 'table'");
  else if (members != nullptr && (conditions != nullptr || table != nullptr))
    diagnostics.error(members->at, "a campaign has either 'campaigns' or data of its own");
  else if (members != nullptr)
    read_members(members->value, campaign, captures, diagnostics);
  else if (conditions != nullptr)
    read_conditions(conditions->value, campaign, captures, diagnostics);
  else if (table != nullptr)
    detail::read_table(table->value, campaign, diagnostics);
  else if (document.is_map())
    diagnostics.error(document.at, "the campaign has neither 'conditions' nor a 'table' nor 'campaigns'",
                      "example: conditions: [{id: white-0500, capture: white_0500.h5, board: {distance: 500 mm}}]");
  return campaign;
}

Campaign read_campaign(const std::filesystem::path& file, config::Diagnostics& diagnostics, Captures captures) {
  return read_campaign(config::load_document(file), diagnostics, captures);
}

}  // namespace tofgraph::io
