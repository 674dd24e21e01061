// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Stray light: the lens scatters light over the whole image.
#include <tofgraph/effect.hpp>
#include <tofgraph/physics/plane_blur.hpp>

#include <Eigen/Core>

namespace tofgraph {

/// P += fraction [(1 - uniform) G * P + uniform mean(P)], G a Gaussian of this standard deviation with sum 1; dark
/// outside the image. The intensity likewise. On a coarse grid the Gaussian is sampled at its points.
struct StrayLight final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance amplitude intensity",
      .confused_with = "lens_distortion multipath crosstalk",
      .experiment = "half of the scene covered by something bright and near, outside the pixel"};
  Param<double> fraction{this,
                         "fraction",
                         {.default_value = "0",
                          .min = 0,
                          .max = 1,
                          .text = "fraction of the light that is scattered",
                          .off = 0,
                          .typical = 0.03}};
  Param<double> width{
      this,
      "width",
      {.unit = "px", .default_value = "35 px", .min = 0.5, .max = 2000, .text = "standard deviation", .typical = 35}};
  Param<double> uniform{
      this,
      "uniform",
      {.default_value = "0.5", .min = 0, .max = 1, .text = "share that spreads evenly over the image", .typical = 0.5}};

  void apply(PhasorImage& light) const {
    if (*fraction == 0) return;
    const auto rows = static_cast<Eigen::Index>(light.state.rows),
               columns = static_cast<Eigen::Index>(light.state.columns);
    const physics::PlaneBlur blur(rows, columns, *width / light.state.spacing);
    const auto scattered = [&](auto image) {
      using Value = typename decltype(image)::Scalar;
      const Value everywhere = image.sum() / static_cast<double>(image.size());
      return (*fraction * ((1 - *uniform) * blur(image).array() + *uniform * everywhere)).matrix().eval();
    };
    for (std::size_t s = 0; s < light.size(); ++s) {
      const SourceLight source = light[s];
      if (source.from_inside()) continue;
      Eigen::Map<physics::PixelMatrix<std::complex<double>>> phasor(source.phasor, rows, columns);
      Eigen::Map<physics::PixelMatrix<double>> strength(source.strength, rows, columns);
      phasor += scattered(physics::PixelMatrix<std::complex<double>>(phasor));
      strength += scattered(physics::PixelMatrix<double>(strength));
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::StrayLight, "Light that the lens scatters")
