// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Errors that are in no catalogue and that a search must report as unknown.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::hidden {

struct View;

struct Pattern {
  std::string name;
  double size = 0;  ///< m; for reflectivity_ripple a fraction of the amplitude
};

struct PatternKind {
  std::string name, unit;
  double typical;
  std::string text;
};
const std::vector<PatternKind>& pattern_catalogue();

/// "angular_ripple:3mm", or a name alone for its typical amplitude. @throws std::invalid_argument
Pattern parse_pattern(std::string_view text, double size);

/// Contribution to the distance of a pixel, m.
double distance_error(const Pattern& pattern, const View& view, int column, int row);
/// Factor on the light of a pixel.
double light_factor(const Pattern& pattern, const View& view, int column, int row);

}  // namespace tofgraph::hidden
