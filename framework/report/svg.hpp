// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Elements of the charts: text, lines, axes and the picture around them.
#pragma once

#include "io/palettes.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tofgraph::report::svg {

inline constexpr double letter = 6.6;  ///< px, average width of a letter
// Attributes apply to stand-alone pictures; the style of a page overrides them with its own colours.
inline constexpr const char* rule = R"(class="rule" stroke="#dddddd")";
inline constexpr const char* axis = R"(class="axis" stroke="#555555" fill="none")";

/// "#rrggbb".
std::string colour_text(io::Colour colour);
std::string text(double x, double y, std::string_view words, std::string_view anchor = "middle",
                 const std::string& more = "");
std::string line(double x1, double y1, double x2, double y2, const std::string& style);
/// Tooltip of an element; empty without a title.
std::string tooltip(const std::string& title);
/// Attribute that links all marks of a condition.
std::string linked(const std::optional<std::size_t>& condition);
/// Whole picture around a body.
std::string picture(int width, int height, const std::string& title, const std::string& body);

/// Image of 8-bit rgb values, row-major, the top row first; pixels stay sharp. @throws std::runtime_error
std::string image(double x, double y, double width, double height, std::span<const std::uint8_t> rgb,
                  std::size_t columns, std::size_t rows);

/// Rectangle of the data within a picture, px.
struct Frame {
  double left, top, right, bottom;
};

/// Minimum and maximum of the finite numbers.
struct Range {
  double low = INFINITY, high = -INFINITY;
  void add(double value);
};

/// Axis: maps values to pixels, with ticks at round numbers.
class Axis {
 public:
  /// @param range of the values; empty or of no width: a range around it is used
  /// @param from, to position of its ends, px
  /// @param logarithmic the range is positive
  Axis(Range range, double from, double to, bool logarithmic = false);

  double at(double value) const;
  std::vector<double> ticks() const;
  /// Ticks and their numbers, with the digits that distinguish them.
  std::vector<std::pair<double, std::string>> named_ticks() const;
  /// Pixels per unit of a linear axis.
  double scale() const { return (to_ - from_) / (high_ - low_); }

 private:
  double low_, high_, from_, to_;  // low_ and high_ are logarithms (base 10) on a logarithmic axis
  bool logarithmic_;
};

}  // namespace tofgraph::report::svg
