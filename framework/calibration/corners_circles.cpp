// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Grids of circles, located by the centres of the ellipses in the image.
#include "calibration/corner_images.hpp"

#include <ceres/jet.h>
#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>
#include <fmt/format.h>
#include <Eigen/LU>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tofgraph::calibration {
namespace {

constexpr double min_circle_contrast = 2;  ///< half of bright minus dark over pixel noise
constexpr double min_radius = 1.5;         ///< px

struct CirclePixel {
  double u, v, value;
};

/// Indices of the fit parameters: centre, shape matrix q (inside: |q d| < 1), logarithm of the blur, brightness and its
/// gradient.
enum : int { centre_x, centre_y, q00, q01, q11, rim_log_blur, grey_mean, grey_contrast, light_slope_u, light_slope_v };
constexpr int circle_parameters = 10;

/// Blurred ellipse: I = (m + c erf(s / (sqrt(2) b))) (1 + h d), s approximately the distance outside the rim.
struct Ellipse {
  using Scalar = double;
  const std::vector<CirclePixel>& pixels;
  double u, v, scale;

  int NumResiduals() const { return static_cast<int>(pixels.size()); }
  template <class T> bool operator()(const T* p, T* residual) const {
    using std::erf, std::exp, std::sqrt;
    const T sharpness = exp(-p[rim_log_blur]) * (1 / std::numbers::sqrt2);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const T du = pixels[i].u - u - p[centre_x], dv = pixels[i].v - v - p[centre_y];
      const T a = p[q00] * du + p[q01] * dv, b = p[q01] * du + p[q11] * dv;
      const T level = sqrt(a * a + b * b + 1e-9);
      // Dividing by the gradient of the level at the rim gives a distance.
      const T ga = (a * p[q00] + b * p[q01]) / level, gb = (a * p[q01] + b * p[q11]) / level;
      const T beyond = (level - 1.0) / sqrt(ga * ga + gb * gb + 1e-12);
      const T light = 1.0 + p[light_slope_u] * du + p[light_slope_v] * dv;
      residual[i] = pixels[i].value / scale - (p[grey_mean] + p[grey_contrast] * erf(beyond * sharpness)) * light;
    }
    return true;
  }
};

std::vector<CirclePixel> window_of(const Image& image, const cv::Point2d& centre, double reach) {
  std::vector<CirclePixel> pixels;
  const auto first = [](double x) { return std::max(0L, physics::to_integer(x, 0L)); };
  const long last_u = std::min(static_cast<long>(image.width) - 1, physics::to_integer(centre.x + reach, -1L));
  const long last_v = std::min(static_cast<long>(image.height) - 1, physics::to_integer(centre.y + reach, -1L));
  for (long v = first(centre.y - reach); v <= last_v; ++v) {
    for (long u = first(centre.x - reach); u <= last_u; ++u) {
      const auto du = static_cast<double>(u) - centre.x, dv = static_cast<double>(v) - centre.y;
      if (std::isfinite(image.at(u, v)) && std::hypot(du, dv) <= reach)
        pixels.push_back({static_cast<double>(u), static_cast<double>(v), image.at(u, v)});
    }
  }
  return pixels;
}

/// @param spacing distance to the nearest circle, px @param ratio diameter divided by spacing
bool refine(const Image& image, std::size_t point, const cv::Point2d& centre, double spacing, double ratio,
            RefinedCorner& refined) {
  const double radius = ratio * spacing / 2, reach = spacing * (1 - ratio / 2) * 0.9;
  const std::vector<CirclePixel> pixels = window_of(image, centre, std::max(reach, radius + 1));
  if (pixels.size() < 2 * circle_parameters || radius < min_radius) return false;
  double low = pixels[0].value, high = low;
  for (const CirclePixel& p : pixels) {
    low = std::min(low, p.value);
    high = std::max(high, p.value);
  }
  const double scale = (high - low) / 2;
  if (!(scale > 0)) return false;
  const double inside = image.at(physics::to_integer(centre.x, 0L), physics::to_integer(centre.y, 0L));
  using Function = ceres::TinySolverAutoDiffFunction<Ellipse, Eigen::Dynamic, circle_parameters>;
  const Ellipse ellipse{pixels, centre.x, centre.y, scale};
  const Function function(ellipse);
  ceres::TinySolver<Function> solver;
  solver.options.max_num_iterations = 80;
  Eigen::Matrix<double, circle_parameters, 1> p;
  p << 0, 0, 1 / radius, 0, 1 / radius, std::log(0.7), (high + low) / (2 * scale),
      inside < (high + low) / 2 ? 1.0 : -1.0, 0, 0;
  solver.Solve(function, &p);
  if (!p.allFinite() || std::hypot(p[centre_x], p[centre_y]) > 0.4 * radius + 0.5) return false;
  const auto count = static_cast<Eigen::Index>(pixels.size());
  Eigen::VectorXd residual(count);
  Eigen::Matrix<double, Eigen::Dynamic, circle_parameters> jacobian(count, circle_parameters);
  function(p.data(), residual.data(), jacobian.data());
  const Eigen::Matrix<double, circle_parameters, circle_parameters> inverse =
      (jacobian.transpose() * jacobian).inverse();
  if (!(inverse(centre_x, centre_x) > 0) || !(inverse(centre_y, centre_y) > 0)) return false;
  const double variance = 1 / (scale * scale);
  refined.corner = {point,
                    centre.x + p[centre_x],
                    centre.y + p[centre_y],
                    {inverse(centre_x, centre_x) * variance, inverse(centre_x, centre_y) * variance,
                     inverse(centre_y, centre_y) * variance}};
  refined.contrast = p[grey_contrast] * scale;
  refined.residual = residual.squaredNorm() * scale * scale;
  refined.freedom = static_cast<double>(pixels.size()) - circle_parameters;
  return true;
}

std::vector<cv::Point2d> detect(const Image& image, const io::Pattern& pattern, Tones tones, bool bright) {
  const int scale = scale_for(image);
  cv::Mat picture = enlarged(image, scale, tones);
  if (bright) picture = 255 - picture;
  cv::SimpleBlobDetector::Params params;
  params.minArea = static_cast<float>(std::numbers::pi * std::pow(min_radius * scale, 2));
  params.maxArea = static_cast<float>(picture.total()) / 16;
  params.minDistBetweenBlobs = static_cast<float>(2 * scale);
  const int flags =
      pattern.type == io::Pattern::Type::circles ? cv::CALIB_CB_SYMMETRIC_GRID : cv::CALIB_CB_ASYMMETRIC_GRID;
  const cv::Size size(static_cast<int>(pattern.columns), static_cast<int>(pattern.rows));
  std::vector<cv::Point2f> centres;
  std::vector<cv::Point2d> places;
  if (!cv::findCirclesGrid(picture, size, centres, flags, cv::SimpleBlobDetector::create(params)) &&
      !cv::findCirclesGrid(picture, size, centres, flags | cv::CALIB_CB_CLUSTERING,
                           cv::SimpleBlobDetector::create(params)))
    return places;
  for (const cv::Point2f& p : centres) places.push_back(to_image(p, scale));
  const auto columns = static_cast<std::size_t>(size.width);
  const cv::Point2d a = places[columns - 1] - places[0], b = places[places.size() - columns] - places[0];
  if (a.x * b.y - a.y * b.x < 0 && pattern.type == io::Pattern::Type::circles)
    for (std::size_t row = 0; row * columns < places.size(); ++row)
      std::reverse(places.begin() + static_cast<std::ptrdiff_t>(row * columns),
                   places.begin() + static_cast<std::ptrdiff_t>((row + 1) * columns));
  return places;
}

BoardSearch checked(const Image& image, const io::Pattern& pattern, const std::vector<cv::Point2d>& places) {
  BoardSearch result;
  std::vector<RefinedCorner> circles(places.size());
  const double ratio =
      pattern.diameter / (pattern.square * (pattern.type == io::Pattern::Type::circles ? 1 : std::numbers::sqrt2));
  double squares = 0, freedom = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    double spacing = 1e9;
    for (std::size_t k = 0; k < places.size(); ++k)
      if (k != i) spacing = std::min(spacing, cv::norm(places[k] - places[i]));
    if (!refine(image, i, places[i], spacing, ratio, circles[i])) {
      result.reason = "a circle could not be located";
      return result;
    }
    squares += circles[i].residual;
    freedom += circles[i].freedom;
  }
  result.pixel_noise = std::sqrt(squares / freedom);
  for (const RefinedCorner& circle : circles) {
    if (circle.contrast * circles[0].contrast > 0 &&
        std::abs(circle.contrast) > min_circle_contrast * result.pixel_noise)
      continue;
    result.reason = "its circles do not stand out alike";
    return result;
  }
  const double noise = std::isfinite(image.noise) ? std::max(image.noise, result.pixel_noise) : result.pixel_noise;
  set_noise(circles, noise, result.corners);
  return result;
}

}  // namespace

BoardSearch find_circles(const Image& image, const io::Pattern& pattern) {
  BoardSearch result;
  result.reason = "not found";
  for (const Tones tones : {Tones::linear, Tones::root, Tones::local}) {
    for (const bool bright : {false, true}) {
      const std::vector<cv::Point2d> places = detect(image, pattern, tones, bright);
      if (places.empty()) continue;
      result = checked(image, pattern, places);
      if (result.found()) return result;
    }
  }
  return result;
}

}  // namespace tofgraph::calibration
