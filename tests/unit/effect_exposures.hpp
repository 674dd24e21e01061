// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Cameras with arbitrary exposures that look at two boards, and the samples of their images.
#pragma once

#include <tofgraph/physics/exposures.hpp>

#include <algorithm>

#include "tests/unit/effect_fixture.hpp"

namespace tofgraph::test {

using physics::Exposures;

inline constexpr double degrees = pi / 180, own = 20e6, focal_length = 12.8e-3, integration_time = 2e-3;
inline constexpr std::size_t side = 12, pixels = side * side;
inline constexpr double spacing = 204.0 / side;

/// The CamCube with other exposures.
class ExposedCamera {
 public:
  explicit ExposedCamera(Exposures exposures) : exposures_(std::move(exposures)), view_(camcube()) {
    view_.exposures = exposures_.data();
    view_.exposure_size = sizeof(tofgraph_exposure);
    view_.exposure_count = exposures_.size();
    // As in a profile: a frequency common to all exposures is that of the camera.
    const double first = exposures_[0].frequency;
    const bool one = std::ranges::all_of(exposures_, [&](const auto& e) { return e.frequency == first; });
    if (one && first > 0) view_.modulation_frequency = first;
  }
  ExposedCamera(const ExposedCamera&) = delete;
  const tofgraph_camera& view() const { return view_; }
  const Exposures& exposures() const { return exposures_; }
  double frequency(std::size_t k) const { return exposures_[k].frequency > 0 ? exposures_[k].frequency : own; }

 private:
  Exposures exposures_;
  tofgraph_camera view_;
};

inline Exposures steps(const std::vector<double>& angles, const std::vector<double>& frequencies = {0}) {
  Exposures all;
  for (const double frequency : frequencies) {
    for (const double angle : angles) all.push_back({angle * degrees, frequency});
  }
  return all;
}
inline Exposures three() { return steps({0, 120, 240}); }
inline Exposures nine() { return steps({0, 120, 240}, {80e6, 16e6, 120e6}); }

inline const std::vector<Exposures>& many() {
  static const std::vector<Exposures> all = {
      three(), steps({10, 63, 150, 215, 301}), nine(), steps({0, 270, 180, 90}), steps({0, 90, 180, 270}),
      // One frequency after the other, step by step.
      Exposures{{0, 60e6}, {0, 20e6}, {2 * pi / 3, 60e6}, {2 * pi / 3, 20e6}, {4 * pi / 3, 60e6}, {4 * pi / 3, 20e6}}};
  return all;
}

/// Two boards, the far one on the right: an edge, two distances.
inline constexpr std::array<BoardPose, 2> boards = {{{1, 0.1, -0.2, 0.8}, {2.2, -0.15, 0.1, 0.3}}};
inline bool is_far(const Vector3& ray) { return ray.x + 0.3 * ray.y > 0.01; }

inline View view_of(const ExposedCamera& camera, bool physical = true) {
  View view;
  view.camera = &camera.view();
  view.acquisition = acquisition_of(camera.view(), integration_time);
  view.physical = physical;
  view.acquisition.condition.ambient = "lamp";
  view.acquisition.condition.time_since_power_on = 500;
  const Tracer near_board = board_tracer(focal_length, boards[0]), far_board = board_tracer(focal_length, boards[1]);
  view.tracer = [=](const BoardChange& change, std::span<const Vector3> rays, std::span<Hit> hits) {
    std::vector<Hit> other(rays.size());
    near_board(change, rays, hits);
    far_board(change, rays, other);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!is_far(rays[i])) continue;
      hits[i] = other[i];
      hits[i].object = 1;
    }
  };
  return view;
}

/// Samples of the pixels: [image][pixel].
struct Samples {
  std::vector<std::vector<double>> c, intensity;
  const ExposedCamera* camera;

  /// (2/n) sum c_k e^(-j step) over the images of a frequency: equal steps.
  Complex phasor(std::size_t i, double frequency = own) const {
    Complex sum;
    double count = 0;
    for (std::size_t k = 0; k < c.size(); ++k) {
      if (camera->frequency(k) != frequency) continue;
      sum += c[k][i] * std::polar(1.0, -camera->exposures()[k].phase);
      ++count;
    }
    return 2 / count * sum;
  }
  double mean(std::size_t i) const {
    double sum = 0;
    for (const auto& image : c) sum += image[i];
    return sum / static_cast<double>(c.size());
  }
};

inline Samples samples(const std::string& list, const View& view, const ExposedCamera& camera) {
  const std::vector<double> taps = expected(list, view).taps;
  const std::size_t n = view.pixels.size();
  Samples result{{}, {}, &camera};
  for (std::size_t k = 0; k < camera.exposures().size(); ++k) {
    result.c.emplace_back(n);
    result.intensity.emplace_back(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double a = taps[2 * k * n + i], b = taps[(2 * k + 1) * n + i];
      result.c[k][i] = a - b;
      result.intensity[k][i] = (a + b) / 2;
    }
  }
  return result;
}

}  // namespace tofgraph::test
