// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Images of boards from a camera with large pixels: area-sampled, blurred, noisy. Independent implementation.
#pragma once

#include "calibration/corners.hpp"
#include "tests/unit/lens_truth.hpp"

#include <random>
#include <vector>

namespace test {

constexpr int subsamples = 5;  ///< per pixel along each side

/// Rays of all subsamples, with the distortion undone iteratively.
inline std::vector<Eigen::Vector2d> subpixel_rays(const TrueLens& lens, int size) {
  std::vector<Eigen::Vector2d> rays;
  rays.reserve(static_cast<std::size_t>(size * subsamples * size * subsamples));
  for (int v = 0; v < size * subsamples; ++v) {
    for (int u = 0; u < size * subsamples; ++u) {
      const Eigen::Vector2d pixel((u + 0.5) / subsamples - 0.5, (v + 0.5) / subsamples - 0.5);
      Eigen::Vector2d p((pixel.x() - lens.cx) / lens.fx, (pixel.y() - lens.cy) / lens.fy);
      Eigen::Vector2d miss(1, 1);  // px
      for (int i = 0; i < 25 && miss.squaredNorm() > 1e-20; ++i) {
        miss = pixel - lens.image({p.x(), p.y(), 1});
        const double slope = lens.fisheye ? 1 + p.squaredNorm() : 1;  // derivative of tan
        p += slope * Eigen::Vector2d(miss.x() / lens.fx, miss.y() / lens.fy);
      }
      rays.push_back(p);
    }
  }
  return rays;
}

struct Light {
  double bright = 0.85, dark = 0.1, wall = 0.3, wall_distance = 2.5;
  double scale = 700;  ///< counts at reflectivity 1 and 1 m, falling with the square of the distance
  double blur = 0.6;   ///< px
  double noise = 6;    ///< counts
};

/// Reflectivity at a point of the board, m from its centre; NaN: off the board.
using Texture = std::function<double(double x, double y)>;

inline Texture chessboard(const TrueBoard& board, const Light& light) {
  return [board, light](double x, double y) {
    const double a = x / board.square + (board.columns + 1) / 2.0, b = y / board.square + (board.rows + 1) / 2.0;
    if (a < -1 || b < -1 || a > board.columns + 2 || b > board.rows + 2) return std::nan("");
    if (a < 0 || b < 0 || a > board.columns + 1 || b > board.rows + 1) return light.bright;  // the margin
    return (int(a) + int(b)) % 2 == 0 ? light.dark : light.bright;
  };
}

inline tofgraph::calibration::Image rendered(const std::vector<Eigen::Vector2d>& rays, int size, const TruePose& pose,
                                             const Texture& texture, const Light& light, unsigned seed) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(std::max(pose.turn.norm(), 1e-12), pose.turn.normalized()).toRotationMatrix();
  const Eigen::Vector3d normal = turn.col(2);
  std::vector<double> fine(static_cast<std::size_t>(size * size), 0.0);
  for (int v = 0; v < size * subsamples; ++v) {
    for (int u = 0; u < size * subsamples; ++u) {
      const Eigen::Vector2d& r = rays[static_cast<std::size_t>(v * size * subsamples + u)];
      const Eigen::Vector3d ray(r.x(), r.y(), 1);
      const double along = normal.dot(pose.place) / normal.dot(ray);
      const Eigen::Vector3d at = along * ray, on_board = turn.transpose() * (at - pose.place);
      double value = texture(on_board.x(), on_board.y());
      const bool board = along > 0 && !std::isnan(value);
      const double distance2 = board ? at.squaredNorm() : (light.wall_distance * ray).squaredNorm();
      value = light.scale * (board ? value : light.wall) / distance2;
      fine[static_cast<std::size_t>(v / subsamples * size + u / subsamples)] += value / (subsamples * subsamples);
    }
  }
  std::vector<double> blurred = fine;
  std::vector<double> kernel;
  for (int i = -4; i <= 4; ++i) kernel.push_back(std::exp(-i * i / (2 * light.blur * light.blur)));
  for (const bool rows : {true, false}) {
    std::vector<double> out(fine.size());
    for (int v = 0; v < size; ++v)
      for (int u = 0; u < size; ++u) {
        double sum = 0, weight = 0;
        for (int i = -4; i <= 4; ++i) {
          const int a = rows ? u + i : u, b = rows ? v : v + i;
          if (a < 0 || b < 0 || a >= size || b >= size) continue;
          sum += kernel[static_cast<std::size_t>(i + 4)] * blurred[static_cast<std::size_t>(b * size + a)];
          weight += kernel[static_cast<std::size_t>(i + 4)];
        }
        out[static_cast<std::size_t>(v * size + u)] = sum / weight;
      }
    blurred = out;
  }
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, light.noise);
  tofgraph::calibration::Image image{static_cast<std::size_t>(size), static_cast<std::size_t>(size), blurred};
  for (double& value : image.values) value = std::abs(value + noise(random));  // an amplitude is never negative
  return image;
}

}  // namespace test
