// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Plots as SVG, drawn by gnuplot in one style for all reports.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::report {

/// Runs gnuplot on a script and returns its drawing. @throws std::runtime_error if gnuplot is missing or fails
std::string gnuplot_svg(const std::string& script, int width, int height);
/// The same as PNG data.
std::string gnuplot_png(const std::string& script, int width, int height);

/// Text in gnuplot's quotes.
std::string quoted(const std::string& text);
/// Palettes of io/palettes.hpp as gnuplot commands.
std::string signed_palette();
std::string rising_palette();
/// Data block `$name` for `plot $name matrix`; the first row of values is the top one.
std::string matrix_block(const std::string& name, std::size_t rows, std::size_t columns,
                         std::span<const double> values);
/// Magnitude not exceeded by 98 % of the values; non-finite values are ignored.
double percentile_98(std::span<const double> values);

/// Image in colours with a scale. NaN is grey.
struct HeatMap {
  std::string title, unit;
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;  ///< row-major, the top row first
  std::string x_label, y_label;
  std::vector<std::string> x_names, y_names;  ///< names of columns and rows; empty: numbers
  bool signed_values = true;                  ///< blue - white - red around 0; otherwise an ascending scale
  std::optional<double> limit;                ///< end of the scale; default: it includes 98 % of the values
  bool write_values = false;                  ///< writes the number in each field
  bool logarithmic = false;                   ///< for an ascending scale: logarithmic colours; values <= 0 are grey
};
std::string heat_map(const HeatMap& map, int width = 330, int height = 270);

/// Line, or points with error bars.
struct Curve {
  std::string name;
  std::vector<double> x, y, error;  ///< error: half the length of the bar, or empty
  bool points = false;
};
struct Curves {
  std::string title, x_label, y_label;
  std::vector<Curve> curves;
  bool logarithmic_x = false;
};
std::string curves(const Curves& plot, int width = 520, int height = 300);

}  // namespace tofgraph::report
