// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Charts as SVG in the page's own colours, light and dark, with a tooltip for every mark. What belongs to a condition
/// carries its number in `data-condition`: a page may show more of it at a click.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tofgraph::report {

/// A number for people: so many significant digits, no exponent, "0" and never "-0" for what is below 0.0001.
std::string plain(double value, int digits = 3, bool sign = false);

/// A point with an error bar.
struct Mark {
  double x = 0, y = 0;
  double error = 0;   ///< half a bar
  std::string title;  ///< the tooltip; empty: none
  std::optional<std::size_t> condition = {};
};

/// Colours of the same things in all charts, numbers of io::line_colours.
inline constexpr std::size_t of_measured = 0, of_simulated = 1, of_extended = 2, of_neither = 5;

struct Series {
  enum class Style { points, ticks, line, dashes };
  std::string name;
  Style style = Style::points;
  std::vector<Mark> marks;                 ///< lines join them in this order; what is not finite is left out
  std::optional<std::size_t> colour = {};  ///< index into io::line_colours; nothing: that of its place in the chart

  bool of_marks() const { return style == Style::points || style == Style::ticks; }
};

/// Series over two axes, in the colours of io/palettes.hpp.
struct Chart {
  std::string title, x_label, y_label;
  std::vector<Series> series;
  bool with_zero = false;  ///< 0 is on the y axis, and error bars do not widen it
};
std::string chart(const Chart& chart, int width = 540, int height = 300);

/// A row of a forest plot or of bars.
struct Span {
  std::string label, title;
  double value = 0, low = 0, high = 0;  ///< low and high: ends of the interval
  std::optional<std::size_t> condition = {};
};
/// Values of the extended model with intervals below each other; dashed lines at references.
std::string forest(const std::vector<Span>& spans, const std::string& x_label, const std::vector<double>& references,
                   int width = 540);
/// Bars from 0 to the values below each other.
std::string bars(const std::vector<Span>& spans, const std::string& x_label, int width = 540);

/// Fields in colours with a scale. What is not finite is grey.
struct Field {
  double value = 0;
  std::string title;
  std::optional<std::size_t> condition = {};
};
struct FieldMap {
  std::string title, unit;
  std::size_t rows = 0, columns = 0;
  std::vector<Field> fields;  ///< row by row, the first at the top
  double limit = 1;           ///< the scale goes from -limit to limit
  std::string x_label, y_label;
  std::vector<std::string> x_names, y_names;  ///< names of columns and rows; empty: none
  bool write_values = false;                  ///< the number in each field, two digits
};
std::string field_map(const FieldMap& map, int width = 340, int height = 290);

}  // namespace tofgraph::report
