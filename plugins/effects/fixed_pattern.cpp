// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Individual distance offset of each pixel.
#include "plugins/pixel_pattern.hpp"

namespace tofgraph {

/// D += scale (map + spread z + slope_map (D - 2 m)), D unwrapped, z drawn for each pixel. Maps are interpolated
/// between pixels.
struct FixedPattern final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance",
      .confused_with = "lens_distortion principal_point board_tilt source_phase source_position stray_light",
      .experiment = "three distances or more of a flat wall; roll of the camera by 90 or 180 deg"};
  Param<double> scale{
      this, "scale", {.default_value = "0", .min = -100, .max = 100, .text = "of the maps", .off = 0, .typical = 1}};
  Param<Image> map{this, "map", {.unit = "m", .text = "offsets: {file, dataset, unit}, height x width"}};
  Param<Image> slope_map{this, "slope_map", {.text = "m per m: {file, dataset}, height x width"}};
  Param<double> spread{
      this,
      "spread",
      {.unit = "m",
       .default_value = "0 mm",
       .min = 0,
       .max = 1,
       .text = "standard deviation of offsets that are drawn, normal and independent: where no map is known"}};
  Param<std::int64_t> seed{this, "seed", {.default_value = "1", .min = 0, .text = "of the drawn offsets"}};

  void prepare(Setup&) const {
    if (*scale != 0 && map->empty() && slope_map->empty() && *spread == 0)
      throw ConfigError("map",
                        "is missing: without a map there is no pattern, e.g. map: {file: pattern.h5, dataset: map}, or "
                        "spread: 4 mm to draw one");
  }

  void apply(PhaseLevel& light) const {
    if (*scale == 0) return;
    for (std::size_t i = 0; i < light.points(); ++i) {
      const double u = light.state.pixel[2 * i], v = light.state.pixel[2 * i + 1];
      double error = at(*map, u, v) + at(*slope_map, u, v) * (light.distance(i) - 2);
      if (*spread > 0) error += *spread * drawn_pattern(light, i, *seed)[0];
      light.phase_offset(i) += *scale * error * light.radians_per_metre();
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::FixedPattern, "Offsets of the pixels")
