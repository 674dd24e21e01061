// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Charts as SVG in the colours of the page, light and dark, with a tooltip for every mark. Marks of a condition have
/// its number in `data-condition`, so that a page can show details on a click.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tofgraph::report {

/// Number for display: this many significant digits, no exponent, "0" and never "-0" for magnitudes below 0.0001.
std::string plain(double value, int digits = 3, bool sign = false);

/// Point with an error bar.
struct Mark {
  double x = 0, y = 0;
  double error = 0;   ///< half the length of the bar
  std::string title;  ///< tooltip; empty: none
  std::optional<std::size_t> condition = {};
};

/// Colours with the same meaning in all charts, indices into io::line_colours.
inline constexpr std::size_t of_measured = 0, of_simulated = 1, of_extended = 2, of_neither = 5;

struct Series {
  enum class Style { points, ticks, line, dashes };
  std::string name;
  Style style = Style::points;
  std::vector<Mark> marks;                 ///< joined by lines in this order; non-finite values are omitted
  std::optional<std::size_t> colour = {};  ///< index into io::line_colours; none: the index of the series

  bool of_marks() const { return style == Style::points || style == Style::ticks; }
};

/// Series over two axes, in the colours of io/palettes.hpp.
struct Chart {
  std::string title, x_label, y_label;
  std::vector<Series> series;
  bool with_zero = false;  ///< the y axis includes 0, and error bars do not extend it
};
std::string chart(const Chart& chart, int width = 540, int height = 300);

/// Row of a forest plot or of a bar chart.
struct Span {
  std::string label, title;
  double value = 0, low = 0, high = 0;  ///< low and high: limits of the interval
  std::optional<std::size_t> condition = {};
};
/// Forest plot: values of the extended model with intervals; dashed lines at references.
std::string forest(const std::vector<Span>& spans, const std::string& x_label, const std::vector<double>& references,
                   int width = 540);
/// Horizontal bars from 0 to the values.
std::string bars(const std::vector<Span>& spans, const std::string& x_label, int width = 540);

/// Heat map with a scale. Non-finite values are grey.
struct Field {
  double value = 0;
  std::string title;
  std::optional<std::size_t> condition = {};
};
struct FieldMap {
  std::string title, unit;
  std::size_t rows = 0, columns = 0;
  std::vector<Field> fields;  ///< row-major, the top row first
  double limit = 1;           ///< the scale goes from -limit to limit
  std::string x_label, y_label;
  std::vector<std::string> x_names, y_names;  ///< names of columns and rows; empty: none
  bool write_values = false;                  ///< writes the number in each field, two digits
};
std::string field_map(const FieldMap& map, int width = 340, int height = 290);

}  // namespace tofgraph::report
