// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Optimized bistatic model in single precision: tables computed before the first frame. u is the ray of a pixel,
/// L the lens centre, S a source and b = L - S. The stage `optimized_bistatic` contains the solver and explains its
/// form.
#pragma once

#include <tofgraph/physics/geometry.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace tofgraph::physics {

/// Largest distance that is solved: beyond it, squares exceed the range of single precision.
inline constexpr float max_distance = 1e9F;  // m

/// A source's constants.
struct BistaticSource {
  float weight, square;  ///< share of the light, |b|^2
  const float* along;    ///< per pixel: u . b
};

/// Values common to all sources.
struct BistaticCamera {
  float focal_length, closest, mean_square;  ///< f, mean |b|, mean |b|^2
  float safe_distance;                       ///< beyond it the corrected closed form is the solution
  const float* sensor_path;                  ///< per pixel: D_sen
  const float* foreshortening;               ///< per pixel: 1 - cos(theta)
  const float* mean_along;                   ///< per pixel: mean u . b
};

/// Owner of the tables. Rays that are NaN give NaN.
class BistaticTables {
 public:
  BistaticTables(const Geometry& geometry, std::span<const Vector3> rays)
      : along_(rays.size() * geometry.sources.size()) {
    double closest = 0, mean_square = 0;
    Vector3 middle;  // mean b
    for (float* along = along_.data(); const auto& [position, weight] : geometry.sources) {
      const Vector3 b = geometry.lens_centre() - position;
      middle = middle + weight * b;
      closest += weight * norm(b);
      mean_square += weight * dot(b, b);
      sources_.push_back({static_cast<float>(weight), static_cast<float>(dot(b, b)), along});
      for (const Vector3& ray : rays) *along++ = static_cast<float>(dot(ray, b));
    }
    for (const Vector3& ray : rays) {
      sensor_path_.push_back(static_cast<float>(physics::sensor_path(geometry, ray)));
      mean_along_.push_back(static_cast<float>(dot(ray, middle)));
      // 1 - cos, without the cancellation near the axis
      foreshortening_.push_back(static_cast<float>((ray.x * ray.x + ray.y * ray.y) / (1 + ray.z)));
    }
    camera_ = {static_cast<float>(geometry.focal_length),
               static_cast<float>(closest),
               static_cast<float>(mean_square),
               static_cast<float>(safe_distance()),
               sensor_path_.data(),
               foreshortening_.data(),
               mean_along_.data()};
  }
  BistaticTables(const BistaticTables&) = delete;
  BistaticTables& operator=(const BistaticTables&) = delete;

  const BistaticCamera& camera() const { return camera_; }
  std::span<const BistaticSource> sources() const { return sources_; }

 private:
  /// Distance from which the variance of the paths may be evaluated at the uncorrected point with an error of at most
  /// 50 nm. Beyond it all sources are on the near side of the surface, so that the slopes of their paths differ by at
  /// most max|b|^2 / nearest^2, and a path differs from D_ref by at most |b|.
  double safe_distance() const {
    const auto [least, most] = std::ranges::minmax(sources_, {}, &BistaticSource::square);
    const double farthest = std::sqrt(double{most.square});
    double across = 0, sensor = 0;
    for (std::size_t i = 0; i < sensor_path_.size(); ++i) {
      if (std::isnan(sensor_path_[i])) continue;
      const auto along = [i](const BistaticSource& source) { return source.along[i]; };
      const auto [low, high] = std::ranges::minmax(sources_, {}, along);
      across = std::max(across, double{along(high)} - along(low));
      sensor = std::max(sensor, double{sensor_path_[i]});
    }
    double distance = farthest + sensor;
    for (; distance < max_distance; distance *= 1.02) {
      const double nearest = distance - (farthest + sensor) / 2 - farthest;  // bound of all D_i and of D_ref + u.b
      if (nearest <= 0) continue;
      const double width = (2 * distance * across + most.square - least.square) / (2 * nearest);  // of the paths
      const double inverse = 1 / (2 * distance - sensor - farthest);
      const double change = width * width / 4 * inverse / 2;
      if (change * inverse * (width / 2) * (most.square / (nearest * nearest) / 2) < 50e-9) break;
    }
    return distance;
  }

  std::vector<float> along_, mean_along_, sensor_path_, foreshortening_;
  std::vector<BistaticSource> sources_;
  BistaticCamera camera_{};
};

}  // namespace tofgraph::physics
