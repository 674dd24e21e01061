// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Every pixel has an offset of its own.
#include <tofgraph/effect.hpp>

#include "plugins/effects/pixel_map.hpp"

namespace tofgraph {

/// D += scale (map + slope_map (D - 2 m)), D not wrapped. Between pixels the maps are interpolated.
struct FixedPattern final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance",
      .confused_with = "lens_distortion principal_point board_tilt source_phase source_position stray_light",
      .experiment = "three distances or more of a flat wall; roll of the camera by 90 or 180 deg"};
  Param<double> scale{
      this, "scale", {.fallback = "0", .min = -100, .max = 100, .text = "of the maps", .off = 0, .typical = 1}};
  Param<InputFile> map{this, "map", {.text = "offsets in m: {file, dataset}, HDF5, height x width"}};
  Param<std::string> map_dataset{this, "map_dataset", {.fallback = "map", .text = "its dataset"}};
  Param<InputFile> slope_map{this, "slope_map", {.text = "m per m: {file, dataset}, HDF5, height x width"}};
  Param<std::string> slope_map_dataset{this, "slope_map_dataset", {.fallback = "map", .text = "its dataset"}};

  void prepare(Setup& setup) {
    if (*scale != 0 && map->empty() && slope_map->empty())
      throw ConfigError("map",
                        "is missing: without a map there is no pattern, e.g. map: {file: pattern.h5, dataset: map}");
    map_ = PixelMap::read(setup, "map", *map, *map_dataset);
    slope_ = PixelMap::read(setup, "slope_map", *slope_map, *slope_map_dataset);
  }

  void apply(PhaseLevel& light) const {
    if (*scale == 0) return;
    for (std::size_t i = 0; i < light.points(); ++i) {
      const double u = light.state.pixel[2 * i], v = light.state.pixel[2 * i + 1];
      const double error = map_.at(u, v) + slope_.at(u, v) * (light.distance(i) - 2);
      light.turn(i) += *scale * error * light.radians_per_metre();
    }
  }

 private:
  PixelMap map_, slope_;
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::FixedPattern, "Offsets of the pixels")
