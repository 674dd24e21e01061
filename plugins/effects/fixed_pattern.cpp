// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Every pixel has an offset of its own.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// D += scale (map + slope_map (D - 2 m)), D not wrapped. Between pixels the maps are interpolated.
struct FixedPattern final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance",
      .confused_with = "lens_distortion principal_point board_tilt source_phase source_position stray_light",
      .experiment = "three distances or more of a flat wall; roll of the camera by 90 or 180 deg"};
  Param<double> scale{
      this, "scale", {.default_value = "0", .min = -100, .max = 100, .text = "of the maps", .off = 0, .typical = 1}};
  Param<Image> map{this, "map", {.unit = "m", .text = "offsets: {file, dataset, unit}, height x width"}};
  Param<Image> slope_map{this, "slope_map", {.text = "m per m: {file, dataset}, height x width"}};

  void prepare(Setup&) const {
    if (*scale != 0 && map->empty() && slope_map->empty())
      throw ConfigError("map",
                        "is missing: without a map there is no pattern, e.g. map: {file: pattern.h5, dataset: map}");
  }

  void apply(PhaseLevel& light) const {
    if (*scale == 0) return;
    for (std::size_t i = 0; i < light.points(); ++i) {
      const double u = light.state.pixel[2 * i], v = light.state.pixel[2 * i + 1];
      const double error = at(*map, u, v) + at(*slope_map, u, v) * (light.distance(i) - 2);
      light.phase_offset(i) += *scale * error * light.radians_per_metre();
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::FixedPattern, "Offsets of the pixels")
