// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Individual sensitivity and dark signal of each pixel.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// A, B *= 1 + scale map, then += scale (dark_map + dark_rate_map t_int). Maps are interpolated between pixels.
struct PixelResponse final : Effect {
  static constexpr EffectInfo info{.touches = "amplitude intensity",
                                   .confused_with = "beam_profile vignetting",
                                   .experiment = "dark frames; a uniform source"};
  Param<double> scale{
      this, "scale", {.default_value = "0", .min = -100, .max = 100, .text = "of the maps", .off = 0, .typical = 1}};
  Param<Image> map{this, "map", {.text = "relative sensitivity minus 1: {file, dataset}, height x width"}};
  Param<Image> dark_map{this, "dark_map", {.unit = "counts", .text = "{file, dataset, unit}, height x width"}};
  Param<Image> dark_rate_map{
      this, "dark_rate_map", {.unit = "counts/s", .text = "{file, dataset, unit}, height x width"}};

  void prepare(Setup&) const {
    if (*scale != 0 && map->empty() && dark_map->empty() && dark_rate_map->empty())
      throw ConfigError(
          "map", "is missing: without a map all pixels are the same, e.g. map: {file: response.h5, dataset: map}");
  }

  void apply(TapsLevel& light) const {
    if (*scale == 0) return;
    for (std::size_t i = 0; i < light.points(); ++i) {
      const double u = light.state.pixel[2 * i], v = light.state.pixel[2 * i + 1];
      const double factor = 1 + *scale * at(*map, u, v);
      const double dark =
          *scale * (at(*dark_map, u, v) + at(*dark_rate_map, u, v) * light.condition().integration_time);
      for (std::size_t k = 0; k < light.exposures(); ++k) {
        light.a(k, i) = light.a(k, i) * factor + dark;
        light.b(k, i) = light.b(k, i) * factor + dark;
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::PixelResponse, "Sensitivity and dark signal of the pixels")
