// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Charts as SVG in the colours of the page, light and dark, with a tooltip for every mark. Marks of a condition have
/// its number in `data-condition`: a page marks that condition in all its charts, and can show details on a click.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::report {

/// Number for display: this many significant digits, no exponent, "0" and never "-0" for magnitudes below 0.0001.
std::string plain(double value, int digits = 3, bool sign = false);

/// Point with an error bar.
struct Mark {
  double x = 0, y = 0;
  double error = 0;        ///< half the length of the bar
  std::string title = {};  ///< tooltip; empty: none
  std::optional<std::size_t> condition = {};
};

/// Colours with the same meaning in all charts, indices into io::line_colours.
inline constexpr std::size_t of_measured = 0, of_simulated = 1, of_extended = 2, of_neither = 5;

struct Series {
  enum class Style { points, ticks, line, dashes, thin_line };
  std::string name = {};  ///< of the legend; empty: not in the legend
  Style style = Style::line;
  std::vector<Mark> marks = {};            ///< joined by lines in this order; a non-finite value interrupts the line
  std::optional<std::size_t> colour = {};  ///< index into io::line_colours; none: the index of the series

  bool of_marks() const { return style == Style::points || style == Style::ticks; }
  void add(double x, double y, double error = 0) { marks.push_back({.x = x, .y = y, .error = error}); }
};

/// Series over two axes, in the colours of io/palettes.hpp.
struct Chart {
  std::string title, x_label, y_label;
  std::vector<Series> series = {};
  bool with_zero = false;      ///< the y axis includes 0, and error bars do not extend it
  bool logarithmic_x = false;  ///< marks with x <= 0 are omitted
  bool y_down = false;         ///< as in an image
  bool equal_scales = false;   ///< a unit of x is as long as a unit of y
};
/// "no data" in place of a chart without finite values.
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

/// Rectangle of a heat map.
struct Field {
  double value = 0;        ///< non-finite: grey
  std::string title = {};  ///< tooltip; empty: none
  std::optional<std::size_t> condition = {};
};
std::vector<Field> fields_of(std::span<const double> values);

/// Heat map with a scale.
struct FieldMap {
  std::string title, unit = {};
  std::size_t rows = 0, columns = 0;
  std::vector<Field> fields = {};          ///< row-major, the top row first
  std::string x_label = {}, y_label = {};  ///< with a label but without names, columns and rows are numbered from 0
  std::vector<std::string> x_names = {}, y_names = {};  ///< names of columns and rows; empty: none
  bool signed_values = true;                            ///< blue - white - red around 0; otherwise an ascending scale
  std::optional<double> limit = {};  ///< upper end of the scale; default: of 98 % of signed values, of all others
  bool write_values = false;         ///< writes the number in each field
  bool logarithmic = false;          ///< of an ascending scale; values <= 0 are grey
};
/// Map of one value per pixel, row-major, with axes in px.
FieldMap pixel_map(std::string title, std::string unit, std::size_t rows, std::size_t columns,
                   std::span<const double> values, bool signed_values);
/// Fields have tooltips unless the map is large; a large map is an image.
std::string field_map(const FieldMap& map, int width = 340, int height = 290);

/// Magnitude not exceeded by 98 % of the values; non-finite values are ignored. 1 without a finite value.
double percentile_98(std::span<const double> values);

}  // namespace tofgraph::report
