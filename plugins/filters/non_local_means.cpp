// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Non-local means of a depth image.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/non_local_means.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <tofgraph/physics/four_phase.hpp>

#include "plugins/filters/patch_vector.hpp"
#include "plugins/filters/window_filter.hpp"
#include "plugins/filters/window_images.hpp"
#include "plugins/filters/window_vector.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

void FilterPatches(const WindowFrame& frame, const Tile& tile) {
  frame.patch.robust ? FilterTile<FlooredPatchWeights>(frame, tile) : FilterTile<PatchWeights>(frame, tile);
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tofgraph {

HWY_EXPORT(FilterPatches);

/// Equation (7.7): the weight of a pixel of the search window is exp(-D / h^2), with the mean squared difference D of
/// the patches around it and around the central pixel, over the positions that are valid in both. Windows and patches
/// are clipped at the image's border.
///
/// Weights g of this mean: Gaussian, uniform or robust: the Gaussian times exp(-(s_x^2 + s_y^2) / (4 h)^2), s the
/// length difference between a patch's centre and its pixel, so that pixels across an edge weigh less (after Huhle et
/// al. 2008). With sigma, robust also subtracts the expected effect of noise: D - 2 sigma^2 if that is positive.
///
/// guide: amplitude replaces d^2 / h^2 by the mean of it and of the corresponding term for amplitudes,
/// (2 sigma^2 / h^2) (A - A')^2 / (s^2 + s'^2), with the standard deviation s = A sigma 4 pi f_mod / c of an amplitude.
/// The length and the amplitude are measured independently: noise rarely hides or mimics an edge in both.
struct NonLocalMeans final : WindowFilter {
  In<float> amplitude{this, "amplitude", {.optional = true, .text = "for guide: amplitude"}};
  Param<std::int64_t> search{
      this, "search", {.default_value = "7", .min = 1, .max = 63, .text = "side of the square window in pixels, odd"}};
  Param<std::int64_t> patch{
      this,
      "patch",
      {.default_value = "3", .min = 1, .max = 21, .text = "side of the patches in pixels, odd, at most `search`"}};
  Param<Choice> patch_weights{
      this,
      "patch_weights",
      {.default_value = "gaussian",
       .choices = "gaussian uniform robust",
       .text = "weights of a patch's pixels; robust: pixels across an edge count less, in a time that "
               "grows with the square of the side"}};
  Param<double> patch_sigma{
      this,
      "patch_sigma",
      {.unit = "px", .default_value = "1 px", .min = 0.1, .max = 1e3, .text = "a, the width of the patch's Gaussian"}};
  Param<Choice> guide{this,
                      "guide",
                      {.default_value = "none",
                       .choices = "none amplitude",
                       .text = "amplitude: patches must also agree in amplitude, as far as its noise allows"}};

  void prepare(Setup& setup) {
    prepare_window(setup, "search", *search);
    check_window(*setup.find(image.channel()), "patch", *patch);
    if (*patch > *search) {
      throw ConfigError("patch", "is " + std::to_string(*patch) + " pixels, greater than search, which is " +
                                     std::to_string(*search));
    }
    if (patch_sigma.given() && *patch_weights == "uniform")
      throw ConfigError("patch_sigma", "has no meaning with patch_weights: uniform");
    uses_noise_ = sigma.present() && (guided() || *patch_weights == "robust");
    if (guided()) check_guide(setup);
    const std::int64_t radius = *patch / 2;
    for (std::int64_t k = -radius; k <= radius; ++k) {
      const double distance = static_cast<double>(k) / *patch_sigma;
      factors_.push_back(static_cast<float>(*patch_weights == "uniform" ? 1 : std::exp(-distance * distance / 2)));
    }
    float sum = 0;
    for (const float factor : factors_) sum += factor;
    for (float& factor : factors_) factor /= sum;
  }

  void process(Frame& frame) const {
    const std::ptrdiff_t border = *patch / 2 + 1;
    const auto extend = [&](WindowFrame& f, double h, double noise) { set_patch(f, frame, border, h, noise); };
    filter(frame, border, extend, [](const WindowFrame& f, const Tile& tile) {
      HWY_DYNAMIC_DISPATCH(FilterPatches)(f, tile);
    });
  }

 private:
  static constexpr float edge = 4;  // length step at which the weight of a patch's pixel is 1/e, in units of h

  bool guided() const { return *guide == "amplitude"; }

  void check_guide(const Setup& setup) const {
    if (!amplitude.present()) throw ConfigError("guide", "what arrives has no amplitude");
    if (!sigma.present()) {
      throw ConfigError("guide",
                        "amplitude needs the channel sigma, from which the noise of the amplitude follows: let the "
                        "decoder know the noise (a camera profile with it, or its parameters)");
    }
    if (!setup.knows(TOFGRAPH_KNOWS_MODULATION_FREQUENCY))
      throw ConfigError("guide", "amplitude needs to know the modulation frequency, which the frames do not have");
  }

  void set_patch(WindowFrame& f, const Frame& frame, std::ptrdiff_t border, double h, double noise) const {
    const auto noise_exponent = static_cast<float>(2 * noise * noise / (h * h) * std::numbers::log2e);
    f.patch = {.radius = *patch / 2,
               .factors = factors_,
               .uniform = *patch_weights == "uniform",
               .robust = *patch_weights == "robust",
               .closeness = 1 / (edge * edge),
               .floor = *patch_weights == "robust" ? noise_exponent : 0,
               .guide_scale = guided() ? noise_exponent : 0};
    if (!guided()) return;
    const double frequency = frame.metadata().modulation_frequency;
    if (!(frequency > 0)) throw std::runtime_error("the modulation frequency of the frame is unknown");
    const auto per_metre = static_cast<float>(1 / physics::metres_per_radian(frequency));
    const Array<const float> light = amplitude(frame);
    const std::ptrdiff_t all = 3 * window_radius() + border;
    const auto value = [&](std::size_t i) { return std::isfinite(light[i]) ? light[i] : 0; };
    pad(f, f.guide, all, 0, value);
    pad(f, f.guide_variance, all, 1, [&](std::size_t i) {
      const float deviation = value(i) * f.sigma[i] * per_metre;
      return deviation > min_deviation ? deviation * deviation : min_deviation * min_deviation;
    });
  }

  static constexpr float min_deviation = 1e-3F;  // counts; used also without light or sigma
  std::vector<float> factors_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::NonLocalMeans, "Averages each pixel with those nearby whose surroundings look alike")
#endif
