// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/gnuplot.hpp"

#include "config/child_process.hpp"
#include "config/json_text.hpp"
#include "io/palettes.hpp"

#include <fmt/format.h>

#include <cmath>
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

std::string matrix_block(const std::string& name, std::size_t rows, std::size_t columns,
                         std::span<const double> values) {
  std::string block = fmt::format("${} << END\n", name);
  for (std::size_t r = rows; r-- > 0;) {  // gnuplot's first row is at the bottom
    for (std::size_t c = 0; c < columns; ++c) block += number(values[r * columns + c]) + " ";
    block += "\n";
  }
  return block + "END\n";
}

std::string gnuplot_png(const std::string& script, int width, int height) {
  const std::string terminal =
      fmt::format("set terminal pngcairo noenhanced size {},{} font 'sans,10' background rgb 'white'\n", width, height);
  std::string png = run_gnuplot(terminal + plot_style + script + "\nunset output\n");
  if (!png.starts_with("\x89PNG")) throw std::runtime_error("gnuplot drew nothing");
  return png;
}

}  // namespace tofgraph::report
