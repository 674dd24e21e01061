// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/palettes.hpp"
#include "report/chart.hpp"
#include "report/svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace tofgraph::report {
namespace {

using svg::Frame, svg::letter, svg::picture, svg::Range, svg::text;

constexpr double before_scale = 10, of_scale = 16;  ///< px: between a map and its colour bar, and its numbers
constexpr std::size_t max_drawn = 2500;             ///< fields of a map that is not an image

/// Colours of a map's values.
class ColourScale {
 public:
  explicit ColourScale(const FieldMap& map) : signed_(map.signed_values), logarithmic_(map.logarithmic) {
    Range range;
    std::vector<double> values;
    for (const Field& field : map.fields) {
      if (logarithmic_ && !(field.value > 0)) continue;
      range.add(field.value);
      values.push_back(field.value);
    }
    high_ = map.limit.value_or(signed_ ? percentile_98(values) : range.high);
    low_ = signed_ ? -high_ : range.low;
    if (!std::isfinite(low_)) low_ = 0;
    if (!(high_ > low_)) high_ = low_ > 0 && logarithmic_ ? 2 * low_ : low_ + 1;
    if (signed_) low_ = -high_;
  }

  /// Position of a value on the scale, from 0 to 1.
  double share(double value) const {
    return logarithmic_ ? std::log(value / low_) / std::log(high_ / low_) : (value - low_) / (high_ - low_);
  }
  io::Colour colour(double value) const {
    if (!std::isfinite(value) || (logarithmic_ && !(value > 0))) return io::invalid_colour;
    return colour_at(share(value));
  }
  io::Colour colour_at(double share) const {
    return signed_ ? io::colour_at(io::signed_colours, share) : io::colour_at(io::rising_colours, share);
  }
  /// Numbers of the lower end, the middle and the upper end.
  std::array<std::string, 3> numbers() const {
    const double middle = signed_ ? 0 : logarithmic_ ? std::sqrt(low_ * high_) : (low_ + high_) / 2;
    return {number(low_), number(middle), number(high_)};
  }

 private:
  std::string number(double value) const { return signed_ ? plain(value, 2, true) : plain(value, 3); }

  bool signed_, logarithmic_;
  double low_ = 0, high_ = 1;
};

std::string colour_bar(const ColourScale& scale, const std::string& unit, double left, double top, double bottom) {
  constexpr int steps = 24;
  std::string body;
  const double height = (bottom - top) / steps;
  for (int k = 0; k < steps; ++k)
    body += fmt::format(R"(<rect x="{:.1f}" y="{:.2f}" width="12" height="{:.2f}" fill="{}"/>)", left, top + height * k,
                        height + 0.3, svg::colour_text(scale.colour_at(1 - (k + 0.5) / steps)));
  const auto [low, middle, high] = scale.numbers();
  body += text(left + of_scale, top + 10, high, "start") +
          text(left + of_scale, (top + bottom) / 2 + 4, middle, "start") + text(left + of_scale, bottom, low, "start");
  return body + text(left + 6, top - 8, unit, "middle");
}

/// Names of columns or rows and their indices: those given, or numbers if the axis has a label.
std::vector<std::pair<std::size_t, std::string>> names_of(const std::vector<std::string>& given, bool labelled,
                                                          std::size_t count, double size) {
  std::vector<std::pair<std::size_t, std::string>> names;
  if (!given.empty()) {  // skips names that would overlap
    const auto every = static_cast<std::size_t>(std::max(1.0, std::ceil(14 / size)));
    for (std::size_t i = 0; i < given.size(); i += every) names.emplace_back(i, given[i]);
  } else if (labelled && count > 1) {
    for (const double tick : svg::Axis({0, static_cast<double>(count - 1)}, 0, 1).ticks()) {
      if (tick >= 0 && tick < static_cast<double>(count) && tick == std::floor(tick))
        names.emplace_back(static_cast<std::size_t>(tick), fmt::format("{:g}", tick));
    }
  }
  return names;
}

std::size_t longest_of(const std::vector<std::string>& names, bool labelled, std::size_t count) {
  std::size_t longest = labelled ? fmt::format("{}", count).size() : 0;
  if (!names.empty()) longest = std::ranges::max(names, {}, &std::string::size).size();
  return longest;
}

/// Fields as an image, one pixel each.
std::string field_image(const FieldMap& map, const ColourScale& scale, const Frame& f) {
  std::vector<std::uint8_t> rgb;
  rgb.reserve(3 * map.fields.size());
  for (const Field& field : map.fields) {
    const io::Colour colour = scale.colour(field.value);
    for (const unsigned shift : {16U, 8U, 0U}) rgb.push_back(static_cast<std::uint8_t>(colour >> shift & 0xffU));
  }
  return svg::image(f.left, f.top, f.right - f.left, f.bottom - f.top, rgb, map.columns, map.rows);
}

std::string number_in(const Field& field, io::Colour colour, double x, double y) {
  const unsigned brightness = 3 * (colour >> 16U & 0xffU) + 6 * (colour >> 8U & 0xffU) + (colour & 0xffU);
  const std::string number = std::abs(field.value) < 0.005  // avoids "-0.00"
                                 ? "0"
                                 : fmt::format("{:.{}g}", field.value, std::abs(field.value) < 1 ? 2 : 3);
  return fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle" font-size="11" fill="{}">{}</text>)", x, y,
                     brightness < 1300 ? "#ffffff" : "#222222", number);
}

/// Rectangles with tooltips.
std::string rectangles(const FieldMap& map, const ColourScale& scale, const Frame& f) {
  const double w = (f.right - f.left) / static_cast<double>(std::max<std::size_t>(map.columns, 1)),
               h = (f.bottom - f.top) / static_cast<double>(std::max<std::size_t>(map.rows, 1));
  std::string body;
  for (std::size_t k = 0; k < map.fields.size(); ++k) {
    const Field& field = map.fields[k];
    const std::size_t row = k / map.columns, column = k % map.columns;
    const double x = f.left + w * static_cast<double>(column), y = f.top + h * static_cast<double>(row);
    const io::Colour colour = scale.colour(field.value);
    body += fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.2f}" height="{:.2f}" )"
                        R"(shape-rendering="crispEdges" fill="{}"{}>{}</rect>)",
                        x, y, w + 0.3, h + 0.3, svg::colour_text(colour), svg::linked(field.condition),
                        svg::tooltip(field.title));
    if (map.write_values && std::isfinite(field.value)) body += number_in(field, colour, x + w / 2, y + h / 2 + 4);
  }
  return body;
}

}  // namespace

std::vector<Field> fields_of(std::span<const double> values) {
  std::vector<Field> fields;
  for (const double value : values) fields.push_back({.value = value});
  return fields;
}

FieldMap pixel_map(std::string title, std::string unit, std::size_t rows, std::size_t columns,
                   std::span<const double> values, bool signed_values) {
  return {.title = std::move(title),
          .unit = std::move(unit),
          .rows = rows,
          .columns = columns,
          .fields = fields_of(values),
          .x_label = "column, px",
          .y_label = "row, px",
          .signed_values = signed_values};
}

double percentile_98(std::span<const double> values) {
  std::vector<double> sizes;
  for (const double v : values) {
    if (std::isfinite(v)) sizes.push_back(std::abs(v));
  }
  if (sizes.empty()) return 1;
  const auto place = sizes.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(sizes.size() - 1));
  std::ranges::nth_element(sizes, place);
  return *place > 0 ? *place : *std::ranges::max_element(sizes);
}

std::string field_map(const FieldMap& map, int width, int height) {
  const ColourScale scale(map);
  const std::size_t longest = longest_of(map.y_names, !map.y_label.empty(), map.rows);
  const std::size_t widest = longest_of(map.x_names, false, map.columns);
  const bool numbered = map.x_names.empty() && !map.x_label.empty();
  const double left = 10 + letter * static_cast<double>(longest) + (map.y_label.empty() ? 0 : 4);
  const double below = (widest > 0 ? 14 + 0.6 * letter * static_cast<double>(widest)
                        : numbered ? 20
                                   : 8) +
                       (map.x_label.empty() ? 0 : 16);
  std::size_t digits = 3;
  for (const std::string& number : scale.numbers()) digits = std::max(digits, number.size());
  const Frame f{left, 42, width - before_scale - of_scale - letter * static_cast<double>(digits) - 6, height - below};
  std::string body = text(width / 2.0, 16, map.title, "middle", "font-weight=\"600\"");
  body += map.fields.size() > max_drawn && !map.write_values ? field_image(map, scale, f) : rectangles(map, scale, f);
  const double w = (f.right - f.left) / static_cast<double>(std::max<std::size_t>(map.columns, 1)),
               h = (f.bottom - f.top) / static_cast<double>(std::max<std::size_t>(map.rows, 1));
  for (const auto& [r, name] : names_of(map.y_names, !map.y_label.empty(), map.rows, h))
    body += text(f.left - 5, f.top + h * (static_cast<double>(r) + 0.5) + 4, name, "end");
  for (const auto& [c, name] : names_of(map.x_names, !map.x_label.empty(), map.columns, w)) {
    const double x = f.left + w * (static_cast<double>(c) + 0.5), y = f.bottom + (numbered ? 14 : 12);
    body += numbered ? text(x, y, name)
                     : text(x, y, name, "end", fmt::format("transform=\"rotate(-40 {:.1f} {:.1f})\"", x, y));
  }
  if (!map.x_label.empty()) body += text((f.left + f.right) / 2, height - 6.0, map.x_label);
  if (!map.y_label.empty()) body += text(f.left - 5, f.top - 8, map.y_label, map.y_label.size() > 6 ? "start" : "end");
  return picture(width, height, map.title, body + colour_bar(scale, map.unit, f.right + before_scale, f.top, f.bottom));
}

}  // namespace tofgraph::report
