// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The image is slightly blurred: at edges a pixel receives light from both sides.
#include <tofgraph/effect.hpp>
#include <tofgraph/physics/plane_blur.hpp>

#include <Eigen/Core>

namespace tofgraph {

/// P = G * P with a Gaussian G of this standard deviation; at the image's border normalised over the pixels inside.
struct MixedPixels final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude intensity variance",
                                   .confused_with = "stray_light",
                                   .experiment = "edges alone; the scene shifted by half a pixel"};
  Param<double> blur{this,
                     "blur",
                     {.unit = "px",
                      .default_value = "0 px",
                      .min = 0,
                      .max = 50,
                      .text = "standard deviation",
                      .off = 0,
                      .typical = 0.7}};

  void apply(PhasorImage& light) const {
    if (*blur == 0) return;
    const auto rows = static_cast<Eigen::Index>(light.state.rows),
               columns = static_cast<Eigen::Index>(light.state.columns);
    const physics::PlaneBlur gaussian(rows, columns, *blur / light.state.spacing);
    const physics::PixelMatrix<double> seen =
        gaussian(physics::PixelMatrix<double>(physics::PixelMatrix<double>::Ones(rows, columns)));
    for (std::size_t s = 0; s < light.size(); ++s) {
      const SourceLight source = light[s];
      if (source.from_inside()) continue;
      Eigen::Map<physics::PixelMatrix<std::complex<double>>> phasor(source.phasor, rows, columns);
      Eigen::Map<physics::PixelMatrix<double>> strength(source.strength, rows, columns);
      phasor = gaussian(physics::PixelMatrix<std::complex<double>>(phasor))
                   .cwiseQuotient(seen.cast<std::complex<double>>())
                   .eval();
      strength = gaussian(physics::PixelMatrix<double>(strength)).cwiseQuotient(seen).eval();
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::MixedPixels, "A slight blur, which mixes light at edges")
