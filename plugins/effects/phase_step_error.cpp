// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The phase steps deviate from their nominal values.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Image k is taken at its step + step_k; image 0 is the reference. An error of 10 mrad in one of four steps causes an
/// offset of 2.98 mm and a 2-cycle error of the same amplitude.
struct PhaseStepError final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude null1 null2",
                                   .confused_with = "motion phase_gain fixed_pattern",
                                   .experiment = "the raw samples; a static repeat; another readout time"};
  Param<double> step1{this,
                      "step1",
                      {.unit = "rad",
                       .default_value = "0 rad",
                       .min = -0.5,
                       .max = 0.5,
                       .text = "error of image 1",
                       .off = 0,
                       .typical = 5e-3}};
  Param<double> step2{this,
                      "step2",
                      {.unit = "rad",
                       .default_value = "0 rad",
                       .min = -0.5,
                       .max = 0.5,
                       .text = "error of image 2",
                       .off = 0,
                       .typical = 5e-3}};
  Param<double> step3{this,
                      "step3",
                      {.unit = "rad",
                       .default_value = "0 rad",
                       .min = -0.5,
                       .max = 0.5,
                       .text = "error of image 3",
                       .off = 0,
                       .typical = 5e-3}};

  Param<std::vector<double>> further{
      this, "further", {.unit = "rad", .min = -0.5, .max = 0.5, .text = "the same for the images from 4 on"}};

  void prepare(Setup& setup) {
    const std::size_t images = setup.exposures().size;
    if (images < 4 && *step3 != 0)
      throw ConfigError("step3",
                        "is that of image 3, but the camera takes " + std::to_string(images) + " images, 0 to 2");
    if (further->size() + 4 > std::max<std::size_t>(images, 4))
      throw ConfigError("further", "has " + std::to_string(further->size()) + " values, but the camera takes " +
                                       std::to_string(images) + " images, and these are for the images from 4 on");
  }

  void apply(SamplesLevel& light) const {
    const double errors[] = {0, *step1, *step2, *step3};
    for (std::size_t k = 1; k < light.exposures(); ++k) {
      if (k < 4) light.step(k) += errors[k];
      if (k >= 4 && k - 4 < further->size()) light.step(k) += (*further)[k - 4];
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::PhaseStepError, "Errors of the phase steps")
