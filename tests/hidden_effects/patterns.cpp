// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/patterns.hpp"

#include "config/quantity.hpp"
#include "tests/hidden_effects/plain_camera.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace tofgraph::hidden {
namespace {

constexpr double middle = 101.5;  // px, of the array

double sawtooth(double x) { return 2 * (x - std::floor(x)) - 1; }

}  // namespace

const std::vector<PatternKind>& pattern_catalogue() {
  static const std::vector<PatternKind> kinds = {
      {"angular_ripple", "m", 3e-3, "five-fold in the image, turning by a fifth for each metre of distance"},
      {"depth_step", "m", 5e-3, "the distance jumps where the board is more than 2.6 m away"},
      {"column_sawtooth", "m", 3e-3, "teeth of 34 columns that wander across the image with distance"},
      {"log_time_distance", "m", 4e-3, "logarithm of integration time (1 ms) times board distance (2 m)"},
      {"hysteresis", "m", 4e-3, "plus after the board came nearer, minus after it went away, in the order measured"},
      {"ring_burst", "m", 4e-3, "a ring whose radius grows with integration time"},
      {"reflectivity_ripple", "", 0.02, "amplitude: stripes along the diagonal that wander with distance"},
  };
  return kinds;
}

Pattern parse_pattern(std::string_view text, double size) {
  const std::size_t colon = text.find(':');
  const std::string_view name = text.substr(0, colon);
  for (const PatternKind& kind : pattern_catalogue()) {
    if (kind.name != name) continue;
    if (colon == std::string_view::npos) return {kind.name, kind.typical * size};
    const config::Quantity quantity = config::parse_quantity(text.substr(colon + 1), kind.unit);
    if (!quantity.ok()) throw std::invalid_argument(fmt::format("size of {}: {}", name, quantity.problem));
    return {kind.name, quantity.value};
  }
  throw std::invalid_argument(fmt::format("there is no pattern '{}'; --list shows all", name));
}

double distance_error(const Pattern& pattern, const View& view, int column, int row) {
  const double x = column - middle, y = row - middle, z = view.distance;
  if (pattern.name == "angular_ripple") return pattern.size * std::sin(5 * std::atan2(y, x) + 2 * M_PI * z);
  if (pattern.name == "depth_step") return z > 2.6 ? pattern.size : 0;
  if (pattern.name == "column_sawtooth") return pattern.size * sawtooth((column + 60 * z) / 34);
  if (pattern.name == "log_time_distance") return pattern.size * std::log(view.integration_time / 1e-3) * z / 2;
  if (pattern.name == "hysteresis")
    return z == view.earlier_distance ? 0 : std::copysign(pattern.size, view.earlier_distance - z);
  if (pattern.name == "ring_burst") {
    const double radius = 40 + 20 * std::log(view.integration_time / 1e-3), off = (std::hypot(x, y) - radius) / 15;
    return pattern.size * std::exp(-off * off);
  }
  return 0;
}

double light_factor(const Pattern& pattern, const View& view, int column, int row) {
  if (pattern.name != "reflectivity_ripple") return 1;
  return 1 + pattern.size * std::sin(2 * M_PI * ((column + row) / 60.0 + view.distance / 0.7));
}

}  // namespace tofgraph::hidden
