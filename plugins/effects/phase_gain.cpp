// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The phase images receive different amounts of light.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Image k receives 1 + gain_k times the light of image 0, which scales c_k and the intensity of that image.
struct PhaseGain final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude intensity null1 null2",
                                   .confused_with = "phase_step_error ambient_light",
                                   .experiment = "N1 and N2; a series of ambient light"};
  Param<double> gain1{
      this,
      "gain1",
      {.default_value = "0", .min = -0.5, .max = 0.5, .text = "image 1 gets more light", .off = 0, .typical = 5e-3}};
  Param<double> gain2{
      this,
      "gain2",
      {.default_value = "0", .min = -0.5, .max = 0.5, .text = "image 2 gets more light", .off = 0, .typical = 5e-3}};
  Param<double> gain3{
      this,
      "gain3",
      {.default_value = "0", .min = -0.5, .max = 0.5, .text = "image 3 gets more light", .off = 0, .typical = 5e-3}};

  Param<std::vector<double>> further{
      this, "further", {.min = -0.5, .max = 0.5, .text = "the same for the images from 4 on"}};

  void prepare(Setup& setup) {
    const std::size_t images = setup.exposures().size;
    if (images < 4 && *gain3 != 0)
      throw ConfigError("gain3",
                        "is that of image 3, but the camera takes " + std::to_string(images) + " images, 0 to 2");
    if (further->size() + 4 > std::max<std::size_t>(images, 4))
      throw ConfigError("further", "has " + std::to_string(further->size()) + " values, but the camera takes " +
                                       std::to_string(images) + " images, and these are for the images from 4 on");
  }

  void apply(SamplesLevel& light) const {
    const double gains[] = {0, *gain1, *gain2, *gain3};
    for (std::size_t k = 1; k < light.exposures(); ++k) {
      const double gain = k < 4 ? gains[k] : k - 4 < further->size() ? (*further)[k - 4] : 0;
      if (gain == 0) continue;
      const double factor = 1 + gain;
      for (std::size_t i = 0; i < light.points(); ++i) {
        light.phasor(k, i) *= factor;
        light.extra(k, i) *= factor;
        light.intensity(k, i) *= factor;
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::PhaseGain, "Unequal exposures of the phase images")
