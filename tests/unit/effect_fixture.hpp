// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file An effect, applied through the plugin interface to a board, and the signals of its pixels.
#pragma once

#include "graph/plugin.hpp"
#include "io/profile.hpp"
#include "simulation/board.hpp"
#include "simulation/files/model.hpp"
#include "simulation/forward_model.hpp"

#include <array>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

namespace tofgraph::test {

using namespace simulation;
using Complex = std::complex<double>;

inline constexpr double c_light = 299792458.0, pi = 3.14159265358979323846;
inline constexpr double metres_per_radian = c_light / (4 * pi * 20e6);  // K at 20 MHz

inline const tofgraph_camera& camcube() {
  static const auto camera = io::load_profile(io::find_profile("camcube2", {}));
  return camera->view();
}

/// Board and settings of the camera.
struct View {
  BoardPose board{1.3, 0.1, -0.2, 0.6};
  Acquisition acquisition = acquisition_of(camcube(), 2e-3);
  Pixels pixels = superpixels(camcube(), 12, 12);
  bool physical = true;
  const tofgraph_camera* camera = &camcube();
  Tracer tracer;  ///< empty: the board
};

/// Signal of a pixel from its four exposures.
struct Seen {
  std::array<double, 4> c{}, intensity{};
  Complex phasor() const { return {(c[0] - c[2]) / 2, (c[3] - c[1]) / 2}; }
  double amplitude() const { return std::abs(phasor()); }
  double phase() const { return std::arg(phasor()); }
  double light() const { return (intensity[0] + intensity[1] + intensity[2] + intensity[3]) / 4; }
  double null1() const { return (c[0] + c[1] + c[2] + c[3]) / 4; }
  double null2() const { return (c[0] - c[1] + c[2] - c[3]) / 4; }
};

inline std::vector<EffectPtr> effects(const std::string& list, const tofgraph_camera& camera) {
  config::Diagnostics diagnostics;
  const Model model = read_model(config::parse_document("test", "model: 1\neffects: [" + list + "]\n"),
                                 graph::PluginRegistry(graph::plugin_path({})), diagnostics);
  auto result = make_effects(model, camera, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return result;
}

inline Expectation expected(const std::string& list, const View& view) {
  const ForwardModel model(*view.camera, view.physical, effects(list, *view.camera));
  const Tracer tracer = view.tracer ? view.tracer : board_tracer(view.camera->focal_length, view.board);
  Expectation result = model.expect(tracer, view.acquisition, view.pixels);
  if (model.has_readout()) model.read_out(view.acquisition, view.pixels, result.taps);
  return result;
}

/// @param list effects as in a model file, "{effect: motion, displacement: 1 mm}"
inline std::vector<Seen> seen(const std::string& list, const View& view) {
  const Expectation expectation = expected(list, view);
  const std::size_t n = view.pixels.size();
  std::vector<Seen> result(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      const double a = expectation.taps[2 * k * n + i], b = expectation.taps[(2 * k + 1) * n + i];
      result[i].c[k] = a - b;
      result[i].intensity[k] = (a + b) / 2;
    }
  }
  return result;
}

/// The angle from b to a, within +-pi.
inline double turned(const Seen& a, const Seen& b) { return std::arg(a.phasor() * std::conj(b.phasor())); }

}  // namespace tofgraph::test
