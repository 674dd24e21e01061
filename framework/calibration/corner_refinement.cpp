// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/corners.hpp"

#include <ceres/jet.h>
#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>
#include <Eigen/LU>

#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tofgraph::calibration {
namespace {

constexpr double max_window = 9;    ///< px; at larger distances the edge curvature is not constant
constexpr double start_blur = 0.5;  ///< px

struct Pixel {
  double u, v, value;
};

/// Pixels around a corner whose lattice coordinates along both lines are within +-reach.
std::vector<Pixel> window_of(const Image& image, const RoughCorner& rough) {
  const auto [ax, ay] = rough.along_row;
  const auto [bx, by] = rough.along_column;
  const double determinant = ax * by - ay * bx;
  const double spacing = std::abs(determinant) / std::max(std::hypot(ax, ay), std::hypot(bx, by));
  const double reach = std::min({1 - std::max(0.2, 1.8 / spacing), max_window / spacing, rough.plain});
  const double half = reach * (std::abs(ax) + std::abs(bx)) + 1, half_v = reach * (std::abs(ay) + std::abs(by)) + 1;
  std::vector<Pixel> pixels;
  const auto first = [](double x) { return std::max(0L, physics::to_integer(std::floor(x), 0L)); };
  const long last_u = std::min(static_cast<long>(image.width) - 1, physics::to_integer(std::ceil(rough.u + half), -1L));
  const long last_v =
      std::min(static_cast<long>(image.height) - 1, physics::to_integer(std::ceil(rough.v + half_v), -1L));
  for (long v = first(rough.v - half_v); v <= last_v; ++v) {
    for (long u = first(rough.u - half); u <= last_u; ++u) {
      const double du = static_cast<double>(u) - rough.u, dv = static_cast<double>(v) - rough.v;
      const double a = (by * du - bx * dv) / determinant, b = (ax * dv - ay * du) / determinant;
      const double value = image.at(u, v);
      if (std::max(std::abs(a), std::abs(b)) <= reach && std::isfinite(value))
        pixels.push_back({static_cast<double>(u), static_cast<double>(v), value});
    }
  }
  return pixels;
}

/// Indices of the fit parameters; lengths in px, position relative to the rough corner.
enum : int { x, y, angle1, angle2, log_blur, mean, contrast, slope_u, slope_v };
constexpr int parameters = 9;

/// Mean over a pixel of an edge blurred by a Gaussian, -1 to 1. Projected onto the edge normal, a square pixel is a box
/// as wide as the larger component of the normal, convolved with one as wide as the smaller. The variance of the latter
/// is added to that of the blur.
template <class T> T edge(const T& across, const T& normal_u, const T& normal_v, const T& log_blur) {
  using std::abs, std::erf, std::exp, std::sqrt;
  const bool flat = abs(normal_u) > abs(normal_v);
  const T width = flat ? abs(normal_u) : abs(normal_v), other = flat ? abs(normal_v) : abs(normal_u);
  constexpr double sharpest = 0.01;  // px^2, lower limit of the variance: sharper edges look the same
  const T a = sqrt(2.0 * (sharpest + exp(2.0 * log_blur) + other * other / 12.0));
  const auto integral = [&a](const T& s) {  // integral of erf(s / a)
    const T x = s / a;
    return s * erf(x) + a * std::numbers::inv_sqrtpi * exp(-x * x);
  };
  return (integral(across + width / 2.0) - integral(across - width / 2.0)) / width;
}

struct Crossing {
  using Scalar = double;
  const std::vector<Pixel>& pixels;
  double u, v, scale;
  std::array<double, 2> curvature;

  int NumResiduals() const { return static_cast<int>(pixels.size()) + 1; }
  template <class T> bool operator()(const T* p, T* residual) const {
    using std::cos, std::sin;
    const T c1 = cos(p[angle1]), s1 = sin(p[angle1]), c2 = cos(p[angle2]), s2 = sin(p[angle2]);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const T du = pixels[i].u - u - p[x], dv = pixels[i].v - v - p[y];
      const T along1 = c1 * du + s1 * dv, along2 = c2 * du + s2 * dv;
      const T across1 = c1 * dv - s1 * du - 0.5 * curvature[0] * along1 * along1;
      const T across2 = c2 * dv - s2 * du - 0.5 * curvature[1] * along2 * along2;
      const T edge1 = edge<T>(across1, s1, c1, p[log_blur]);
      const T edge2 = edge<T>(across2, s2, c2, p[log_blur]);
      const T light = 1.0 + p[slope_u] * du + p[slope_v] * dv;
      residual[i] = pixels[i].value / scale - (p[mean] + p[contrast] * edge1 * edge2) * light;
    }
    // If the pixels do not determine the blur, this weak prior keeps it near a usual value.
    residual[pixels.size()] = 0.01 * (p[log_blur] - std::log(start_blur));
    return true;
  }
};

}  // namespace

double curvature_through(const std::array<double, 2>& a, const std::array<double, 2>& b,
                         const std::array<double, 2>& c) {
  const double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - b[0], vy = c[1] - b[1];
  return 2 * (ux * vy - uy * vx) / (std::hypot(ux, uy) * std::hypot(vx, vy) * std::hypot(ux + vx, uy + vy));
}

void set_noise(const std::vector<RefinedCorner>& refined, double noise, std::vector<Corner>& corners) {
  corners.clear();
  for (const RefinedCorner& r : refined) {
    Corner corner = r.corner;
    for (double& c : corner.covariance) c *= noise * noise;
    corner.covariance[0] += model_sd * model_sd;
    corner.covariance[2] += model_sd * model_sd;
    corners.push_back(corner);
  }
}

double crossing(const std::array<double, 4>& means) {
  const double even = (means[0] + means[2]) / 2, odd = (means[1] + means[3]) / 2;
  const double gap = even > odd ? std::min(means[0], means[2]) - std::max(means[1], means[3])
                                : std::min(means[1], means[3]) - std::max(means[0], means[2]);
  return gap / std::max(std::abs(even - odd), 1e-300);
}

bool quadrants(const Image& image, const RoughCorner& rough, std::array<double, 4>& means) {
  const auto [ax, ay] = rough.along_row;
  const auto [bx, by] = rough.along_column;
  constexpr double signs[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
  for (std::size_t q = 0; q < 4; ++q) {
    double sum = 0;
    int count = 0;
    for (const double a : {0.3, 0.5, 0.7}) {
      for (const double b : {0.3, 0.5, 0.7}) {
        const long u = physics::to_integer(rough.u + rough.plain * (signs[q][0] * a * ax + signs[q][1] * b * bx), -1L);
        const long v = physics::to_integer(rough.v + rough.plain * (signs[q][0] * a * ay + signs[q][1] * b * by), -1L);
        if (u < 0 || v < 0 || u >= static_cast<long>(image.width) || v >= static_cast<long>(image.height)) continue;
        if (!std::isfinite(image.at(u, v))) continue;
        sum += image.at(u, v);
        ++count;
      }
    }
    if (count < 3) return false;
    means[q] = sum / count;
  }
  return true;
}

bool refine(const Image& image, const RoughCorner& rough, RefinedCorner& refined) {
  std::array<double, 4> means{};
  const std::vector<Pixel> pixels = window_of(image, rough);
  if (pixels.size() < 2 * parameters || !quadrants(image, rough, means)) return false;
  const double even = (means[0] + means[2]) / 2, odd = (means[1] + means[3]) / 2;
  const double scale = std::abs(even - odd) / 2;
  if (!(scale > 0)) return false;
  using Function = ceres::TinySolverAutoDiffFunction<Crossing, Eigen::Dynamic, parameters>;
  const Crossing crossing{pixels, rough.u, rough.v, scale, rough.curvature};
  const Function function(crossing);
  ceres::TinySolver<Function> solver;
  solver.options.max_num_iterations = 60;
  Eigen::Matrix<double, parameters, 1> p;
  p << 0, 0, std::atan2(rough.along_row[1], rough.along_row[0]),
      std::atan2(rough.along_column[1], rough.along_column[0]), std::log(start_blur), (even + odd) / (2 * scale),
      // in even quadrants, e.g. right of one edge and below the other, the product of the signed distances is negative
      (odd - even) / (2 * scale), 0, 0;
  solver.Solve(function, &p);
  const double blur = std::exp(p[log_blur]);
  if (!p.allFinite() || !(blur < 3)) return false;
  const auto count = static_cast<Eigen::Index>(pixels.size()) + 1;
  Eigen::VectorXd residual(count);
  Eigen::Matrix<double, Eigen::Dynamic, parameters> jacobian(count, parameters);
  function(p.data(), residual.data(), jacobian.data());
  const Eigen::Matrix<double, parameters, parameters> inverse = (jacobian.transpose() * jacobian).inverse();
  if (!(inverse(x, x) > 0) || !(inverse(y, y) > 0)) return false;
  const double variance = 1 / (scale * scale);
  refined.corner = {rough.point,
                    rough.u + p[x],
                    rough.v + p[y],
                    {inverse(x, x) * variance, inverse(x, y) * variance, inverse(y, y) * variance}};
  refined.contrast = p[contrast] * scale;
  refined.residual = residual.squaredNorm() * scale * scale;
  refined.freedom = static_cast<double>(pixels.size()) - parameters;
  return true;
}

}  // namespace tofgraph::calibration
