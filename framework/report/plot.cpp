// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/plot.hpp"

#include "config/child_process.hpp"
#include "config/json_text.hpp"
#include "io/palettes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace tofgraph::report {
namespace {

/// Text of a number for gnuplot; non-finite numbers are missing values.
std::string number(double value) { return std::isfinite(value) ? fmt::format("{:.9g}", value) : "NaN"; }

constexpr const char* plot_style =
    "set encoding utf8\n"
    "set border lc rgb '#555555'\n"
    "set tics textcolor rgb '#333333'\n"
    "set title font ',13'\n"
    "set key top left reverse Left samplen 2\n";

std::string web_colour(io::Colour colour) { return fmt::format("#{:06x}", colour); }

std::string palette(std::span<const io::Colour> steps) {
  std::string text;
  for (std::size_t i = 0; i < steps.size(); ++i)
    text += fmt::format("{}{} '{}'", i == 0 ? "" : ", ", i, web_colour(steps[i]));
  return fmt::format("set palette defined ({})\n", text);
}

std::string names(const char* axis, const std::vector<std::string>& texts, bool from_top) {
  std::string result;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (texts.size() > 16 && i % (texts.size() / 8) != 0) continue;
    std::string text;  // gnuplot interprets the names of tics as formats
    for (const char c : texts[i]) text += c == '%' ? "%%" : std::string(1, c);
    result +=
        fmt::format("{}{} {}", result.empty() ? "" : ", ", report::quoted(text), from_top ? texts.size() - 1 - i : i);
  }
  return texts.empty() ? "" : fmt::format("set {}tics ({}) {}\n", axis, result, *axis == 'x' ? "rotate by -40" : "");
}

/// Standard output of gnuplot for a script.
std::string run_gnuplot(const std::string& whole) {
  config::ChildResult child;
  try {
    // Under this name standard input is read in blocks; with "-" gnuplot makes a system call for each byte, which
    // dominates its run time.
    child = config::run_child({"gnuplot", "/dev/stdin"}, {.input = whole, .keep_errors = true});
  } catch (const std::runtime_error& problem) {
    throw std::runtime_error(fmt::format("cannot start gnuplot: {}; install it (Debian: gnuplot-nox)", problem.what()));
  }
  if (!child.ok()) throw std::runtime_error("gnuplot failed: " + child.errors);
  return child.output;
}

}  // namespace

std::string signed_palette() { return palette(io::signed_colours); }
std::string rising_palette() { return palette(io::rising_colours); }

std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : config::as_utf8(text)) result += c == '\'' ? "''" : std::string(1, c == '\n' ? ' ' : c);
  return result + "'";
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

std::string matrix_block(const std::string& name, std::size_t rows, std::size_t columns,
                         std::span<const double> values) {
  std::string block = fmt::format("${} << END\n", name);
  for (std::size_t r = rows; r-- > 0;) {  // gnuplot's first row is at the bottom
    for (std::size_t c = 0; c < columns; ++c) block += number(values[r * columns + c]) + " ";
    block += "\n";
  }
  return block + "END\n";
}

std::string gnuplot_svg(const std::string& script, int width, int height) {
  const std::string terminal = fmt::format(
      "set terminal svg noenhanced size {},{} font 'sans-serif,11' background rgb 'white'\n", width, height);
  const std::string svg = run_gnuplot(terminal + plot_style + script + "\nunset output\n");
  if (svg.find("</svg>") == std::string::npos) throw std::runtime_error("gnuplot drew nothing");
  return svg.substr(svg.find("<svg"));
}

std::string gnuplot_png(const std::string& script, int width, int height) {
  const std::string terminal =
      fmt::format("set terminal pngcairo noenhanced size {},{} font 'sans,10' background rgb 'white'\n", width, height);
  std::string png = run_gnuplot(terminal + plot_style + script + "\nunset output\n");
  if (!png.starts_with("\x89PNG")) throw std::runtime_error("gnuplot drew nothing");
  return png;
}

std::string heat_map(const HeatMap& map, int width, int height) {
  double limit = map.limit.value_or(percentile_98(map.values));
  if (!(limit > 0)) limit = 1;
  std::string script = fmt::format("set title {}\nset cblabel {}\nunset key\n", quoted(map.title), quoted(map.unit));
  script += map.signed_values ? signed_palette() : rising_palette();
  script += map.signed_values ? fmt::format("set cbrange [{}:{}]\n", number(-limit), number(limit)) : std::string();
  if (!map.signed_values && std::ranges::none_of(map.values, [](double v) { return std::isfinite(v); }))
    script += "set cbrange [0:1]\n";
  if (map.logarithmic && std::ranges::any_of(map.values, [](double v) { return v > 0; }))
    script += "set logscale cb\nset cbtics add autofreq\n";
  script += fmt::format("set xrange [-0.5:{}]\nset yrange [-0.5:{}]\nset tics out nomirror scale 0.5\n",
                        static_cast<double>(map.columns) - 0.5, static_cast<double>(map.rows) - 0.5);
  script += map.x_names.empty() && map.x_label.empty() ? "unset xtics\n" : names("x", map.x_names, false);
  script += map.y_names.empty() && map.y_label.empty() ? "unset ytics\n" : names("y", map.y_names, true);
  script += fmt::format("set xlabel {}\nset ylabel {}\n", quoted(map.x_label), quoted(map.y_label));
  script += fmt::format(
      "set object 1 rectangle from graph 0,0 to graph 1,1 behind fillcolor rgb '{}' fillstyle solid noborder\n",
      web_colour(io::invalid_colour));
  script += matrix_block("values", map.rows, map.columns, map.values);
  // Small images are drawn field by field: viewers blur them when they enlarge them.
  constexpr std::size_t few_fields = 2500;
  script += "plot $values matrix using 1:2:3 with image";
  if (map.rows * map.columns <= few_fields) script += " pixels";
  if (map.write_values) script += ", $values matrix using 1:2:(sprintf('%.2g', $3)) with labels font ',9'";
  return gnuplot_svg(script, width, height);
}

namespace {

bool can_be_drawn(const Curve& curve, bool logarithmic_x) {
  for (std::size_t k = 0; k < curve.x.size(); ++k) {
    if (std::isfinite(curve.x[k]) && std::isfinite(curve.y[k]) && (!logarithmic_x || curve.x[k] > 0)) return true;
  }
  return false;
}

/// True if the axis begins at 0: no x is negative, and the minimum is small compared with the maximum.
bool begins_at_zero(const Curves& plot) {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const Curve& curve : plot.curves) {
    for (const double x : curve.x) {
      if (!std::isfinite(x)) continue;
      least = std::min(least, x);
      most = std::max(most, x);
    }
  }
  return !plot.logarithmic_x && least >= 0 && least < most / 10;
}

/// gnuplot rejects a plot without points.
constexpr const char* no_data =
    "set xrange [0:1]\nset yrange [0:1]\nunset xtics\nunset ytics\nset label 'no data' at graph 0.5,0.5 center\n"
    "plot NaN notitle";

}  // namespace

std::string curves(const Curves& plot, int width, int height) {
  std::string script = fmt::format("set title {}\nset xlabel {}\nset ylabel {}\nset grid lc rgb '#dddddd'\n",
                                   quoted(plot.title), quoted(plot.x_label), quoted(plot.y_label));
  script += "set key outside below horizontal\nset offsets graph 0.02, graph 0.02, graph 0, graph 0\n";
  const auto drawn = [&plot](const Curve& curve) { return can_be_drawn(curve, plot.logarithmic_x); };
  if (std::ranges::none_of(plot.curves, drawn)) return gnuplot_svg(script + no_data, width, height);
  if (plot.logarithmic_x) script += "set logscale x\n";
  if (begins_at_zero(plot)) script += "set xrange [0:*]\n";
  const auto flat = [](const Curve& c) { return std::ranges::all_of(c.y, [](double y) { return y == 0; }); };
  if (std::ranges::all_of(plot.curves, flat)) script += "set yrange [-1:1]\n";
  std::string commands;
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    const Curve& curve = plot.curves[i];
    if (!drawn(curve)) continue;
    script += fmt::format("$curve{} << END\n", i);
    for (std::size_t k = 0; k < curve.x.size(); ++k) {
      script += fmt::format("{} {} {}\n", number(curve.x[k]), number(curve.y[k]),
                            curve.error.empty() ? "0" : number(curve.error[k]));
    }
    script += "END\n";
    const std::string colour = web_colour(io::line_colours.at(i % io::line_colours.size()));
    const std::string how = curve.points && !curve.error.empty() ? "using 1:2:3 with yerrorbars pt 7 ps 0.5"
                            : curve.points                       ? "using 1:2 with points pt 7 ps 0.5"
                                                                 : "using 1:2 with lines lw 2";
    commands += fmt::format("{}$curve{} {} lc rgb '{}' {}", commands.empty() ? "plot " : ", ", i, how, colour,
                            curve.name.empty() ? "notitle" : "title " + quoted(curve.name));
  }
  return gnuplot_svg(script + commands, width, height);
}

}  // namespace tofgraph::report
