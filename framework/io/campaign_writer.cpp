// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/campaign.hpp"

#include "config/quantity.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

namespace tofgraph::io {
namespace {

struct Scale {
  std::string_view unit;
  double factor;
  double offset = 0;
};

constexpr Scale lengths[] = {{"m", 1}, {"mm", 1e3}};
constexpr Scale times[] = {{"s", 1}, {"ms", 1e3}, {"us", 1e6}};
constexpr Scale angles[] = {{"rad", 1}, {"deg", 180 / M_PI}};
constexpr Scale velocities[] = {{"m/s", 1}, {"mm/s", 1e3}};
constexpr Scale temperatures[] = {{"K", 1}, {"degC", 1, -273.15}};

/// Value with the fewest digits that reproduce it exactly; the first scale is SI, which can write any number.
std::string quantity(double value, std::span<const Scale> scales) {
  std::string best;
  std::size_t digits = 0;
  for (const Scale& scale : scales) {
    const double scaled = value * scale.factor + scale.offset;
    for (const std::string& number : {fmt::format("{}", scaled), fmt::format("{:.10g}", scaled)}) {
      std::string text = fmt::format("{} {}", number, scale.unit);
      const auto again = config::parse_quantity(text, scales.front().unit);
      if (!again.ok() || again.value != value || (!best.empty() && number.size() > digits)) continue;
      best = std::move(text);
      digits = number.size();
    }
  }
  return best;
}

std::string relative_to(const std::filesystem::path& folder, const std::filesystem::path& file) {
  return config::yaml_word(
      std::filesystem::absolute(file).lexically_normal().lexically_proximate(folder).generic_string());
}

/// Lines "key: value" of one condition; unknown values are omitted.
class ConditionText {
 public:
  explicit ConditionText(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::string of(const Condition& c) {
    text_.clear();
    word("id", c.id);
    file("capture", c.capture);
    if (c.frames) add("frames", fmt::format("[{}, {}]", c.frames->at(0), c.frames->at(1)));
    if (c.has_board()) add("board", board(c));
    word("target", c.target);
    if (!std::isnan(c.reflectivity)) add("reflectivity", fmt::format("{}", c.reflectivity));
    number("integration_time", c.integration_time, times);
    add("sources", sources(c.sources));
    word("ambient", c.ambient);
    number("time_since_power_on", c.time_since_power_on, times);
    if (c.roll != 0) number("roll", c.roll, angles);
    number("velocity", c.velocity, velocities);
    word("session", c.session);
    word("reference", c.reference);
    word("lens", c.lens);
    word("rail", c.rail);
    number("temperature", c.temperature, temperatures);
    file("scene", c.scene);
    if (c.roi)
      add("roi", fmt::format("{{columns: [{}, {}], rows: [{}, {}]}}", c.roi->first_column, c.roi->last_column,
                             c.roi->first_row, c.roi->last_row));
    if (c.order) add("order", fmt::format("{}", *c.order));
    word("recorded_at", c.recorded_at);
    return text_;
  }

 private:
  void add(std::string_view key, const std::string& value) {
    text_ += fmt::format("{}{}: {}\n", text_.empty() ? "  - " : "    ", key, value);
  }
  void word(std::string_view key, const std::string& value) {
    if (!value.empty()) add(key, config::yaml_word(value));
  }
  void file(std::string_view key, const std::filesystem::path& value) {
    if (!value.empty()) add(key, relative_to(folder_, value));
  }
  void number(std::string_view key, double value, std::span<const Scale> scales) {
    if (!std::isnan(value)) add(key, quantity(value, scales));
  }
  static std::string board(const Condition& c) {
    std::string text = fmt::format("{{distance: {}", quantity(c.board_distance, lengths));
    if (!std::isnan(c.board_tilt_x)) text += fmt::format(", tilt_x: {}", quantity(c.board_tilt_x, angles));
    if (!std::isnan(c.board_tilt_y)) text += fmt::format(", tilt_y: {}", quantity(c.board_tilt_y, angles));
    if (c.board_size)
      text += fmt::format(", size: [{}, {}]", quantity(c.board_size->at(0), lengths),
                          quantity(c.board_size->at(1), lengths));
    return text + "}";
  }
  static std::string sources(const std::vector<std::string>& names) {
    if (names.empty()) return "both";
    std::vector<std::string> words;
    for (const std::string& name : names) words.push_back(config::yaml_word(name));
    return fmt::format("[{}]", fmt::join(words, ", "));
  }

  std::filesystem::path folder_;
  std::string text_;
};

std::string pattern_text(const Pattern& p) {
  static constexpr std::array<const char*, 4> types = {"chessboard", "charuco", "circles", "asymmetric_circles"};
  const bool circles = p.type == Pattern::Type::circles || p.type == Pattern::Type::asymmetric_circles;
  std::string text =
      fmt::format("pattern: {{type: {}, columns: {}, rows: {}, {}: {}", types[static_cast<std::size_t>(p.type)],
                  p.columns, p.rows, circles ? "spacing" : "square", quantity(p.square, lengths));
  if (circles) text += ", diameter: " + quantity(p.diameter, lengths);
  if (p.type == Pattern::Type::charuco)
    text += fmt::format(", marker: {}, dictionary: {}", quantity(p.marker, lengths), p.dictionary);
  return text + "}\n";
}

}  // namespace

void write_campaign(const Campaign& campaign, const std::filesystem::path& file) {
  if (campaign.from_table)
    throw std::invalid_argument("a campaign of statistics is written as a table, not as captures");
  std::string text = "campaign: 1\n";
  if (!campaign.name.empty()) text += fmt::format("name: {}\n", config::yaml_word(campaign.name));
  if (!campaign.notes.empty()) text += "note:\n";
  for (const std::string& note : campaign.notes) text += fmt::format("  - {}\n", config::yaml_word(note));
  const std::filesystem::path folder = std::filesystem::absolute(file).lexically_normal().parent_path();
  if (!campaign.source.empty()) text += fmt::format("source: {}\n", relative_to(folder, campaign.source));
  text += fmt::format("camera: {}\n", config::yaml_word(campaign.camera_name));
  if (campaign.pattern) text += pattern_text(*campaign.pattern);
  if (std::isfinite(campaign.jitter)) text += fmt::format("jitter: {}\n", quantity(campaign.jitter, lengths));
  text += "conditions:\n";
  ConditionText condition_text(folder);
  for (const Condition& condition : campaign.conditions) text += condition_text.of(condition);
  write_file(file, text);
}

}  // namespace tofgraph::io
