// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Plots as SVG, drawn by gnuplot: one look for all reports.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::report {

/// Runs gnuplot on a script and gives what it draws. @throws std::runtime_error when gnuplot is missing or objects
std::string gnuplot_svg(const std::string& script, int width, int height);
/// The same as the bytes of a PNG.
std::string gnuplot_png(const std::string& script, int width, int height);

/// A text in gnuplot's quotes.
std::string quoted(const std::string& text);
/// The palettes of io/palettes.hpp, as gnuplot's commands.
std::string signed_palette();
std::string rising_palette();
/// A data block `$name` for `plot $name matrix`; the first row of values is the top one.
std::string matrix_block(const std::string& name, std::size_t rows, std::size_t columns,
                         std::span<const double> values);
/// The magnitude below which 98 % of the values are; what is not finite does not count.
double percentile_98(std::span<const double> values);

/// An image as colours with a scale. NaN is left grey.
struct HeatMap {
  std::string title, unit;
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;  ///< row by row, the first at the top
  std::string x_label, y_label;
  std::vector<std::string> x_names, y_names;  ///< names of columns and rows; empty: numbers
  bool signed_values = true;                  ///< blue - white - red around 0; otherwise a rising scale
  std::optional<double> limit;                ///< the scale's end; default: 98 % of the values are within
  bool write_values = false;                  ///< the number in each field
  bool logarithmic = false;  ///< of a rising scale: colours by the logarithm; what is not positive is grey
};
std::string heat_map(const HeatMap& map, int width = 330, int height = 270);

/// A line, or points with bars.
struct Curve {
  std::string name;
  std::vector<double> x, y, error;  ///< error: half a bar, or empty
  bool points = false;
};
struct Curves {
  std::string title, x_label, y_label;
  std::vector<Curve> curves;
  bool logarithmic_x = false;
};
std::string curves(const Curves& plot, int width = 520, int height = 300);

}  // namespace tofgraph::report
