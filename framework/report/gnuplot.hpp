// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Pictures (PNG) drawn by gnuplot. The figures of reports are drawn by chart.hpp.
#pragma once

#include <span>
#include <string>

namespace tofgraph::report {

/// Runs gnuplot on a script. @returns PNG data @throws std::runtime_error if gnuplot is missing or fails
std::string gnuplot_png(const std::string& script, int width, int height);

/// Text in gnuplot's quotes.
std::string quoted(const std::string& text);
/// Palettes of io/palettes.hpp as gnuplot commands.
std::string signed_palette();
std::string rising_palette();
/// Data block `$name` for `plot $name matrix`; the first row of values is the top one.
std::string matrix_block(const std::string& name, std::size_t rows, std::size_t columns,
                         std::span<const double> values);

}  // namespace tofgraph::report
