// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/lens_distances.hpp"

#include "calibration/lens_model.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <boost/math/distributions/chi_squared.hpp>
#include <tofgraph/physics/geometry.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tofgraph::calibration {

bool DistanceCheck::plausible_scale() const { return std::abs(range_scale) < 3 * range_scale_prior; }

std::string DistanceCheck::reason() const {
  if (!same_lens())
    return fmt::format("the lens would change by more than its uncertainties: chi-square {:.1f} of {:.0f}, p = {:.1g}",
                       statistic, terms, p_value);
  if (!plausible_scale()) return fmt::format("they would be {:+.1f} % too long", range_scale * 100);
  return {};
}

DistanceCheck check_distances(const LensSolution& corners, const LensSolution& joint) {
  DistanceCheck check{.done = true, .range_scale = joint.range_scale};
  const auto n = static_cast<Eigen::Index>(corners.layout.lens.size());
  Eigen::VectorXd difference(n), unit(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t parameter = corners.layout.lens[static_cast<std::size_t>(i)];
    unit[i] = 1 / std::max(corners.sd(parameter), 1e-300);
    difference[i] = (joint.lens[parameter] - corners.lens[parameter]) * unit[i];
  }
  const Eigen::MatrixXd gain = unit.asDiagonal() *
                               (corners.covariance.topLeftCorner(n, n) - joint.covariance.topLeftCorner(n, n)) *
                               unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gain);
  // Below it, both covariances are equal except for rounding and linearisation; relative to the corners' variances.
  constexpr double least = 0.05;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double variance = eigen.eigenvalues()[i];
    if (!(variance > least)) continue;
    check.statistic += std::pow(eigen.eigenvectors().col(i).dot(difference), 2) / variance;
    check.terms += 1;
  }
  if (check.terms > 0)
    check.p_value = boost::math::cdf(
        boost::math::complement(boost::math::chi_squared(check.terms), std::min(check.statistic, 1e9)));
  return check;
}

namespace {

/// Half path to the flat board along a pixel's ray, by a lens fitted to corners only; NaN outside the lens model.
double half_path_by_corners(const LensSolution& corners, const SolvedView& view, const LightPaths& light, double u,
                            double v) {
  double xy[2];
  if (!unproject(corners.lens, u, v, xy)) return std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector3d ray = Eigen::Vector3d(xy[0], xy[1], 1).normalized();
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(view.pose.rotation.data());
  const Eigen::Vector3d normal = rotation.col(2), centre(view.pose.translation.data());
  const double range = normal.dot(centre) / normal.dot(ray);
  const physics::Geometry geometry{
      (corners.lens[lens::fx] * light.pitch[0] + corners.lens[lens::fy] * light.pitch[1]) / 2, light.sources};
  return physics::distance_at(geometry, {ray[0], ray[1], ray[2]}, range);
}

/// Least squares of y = offset + slope x.
std::array<double, 2> straight_line(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double mx = 0, my = 0, xx = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mx += x[i] / n;
    my += y[i] / n;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mx) * (x[i] - mx);
    xy += (x[i] - mx) * (y[i] - my);
  }
  const double slope = xy / xx;
  return {my - slope * mx, slope};
}

}  // namespace

std::string square_problem(const LensSolution& corners, const Observations& observations, double square) {
  constexpr double max_scale = 0.08;   // a cyclic error of 8 mm at 20 MHz changes the local scale by 3 %
  constexpr double min_spread = 1.15;  // ratio of the views' ranges that separates scale from offset
  constexpr double max_offset = 0.1;   // relative to the range, if the scale is unknown
  if (!observations.light) return {};
  std::vector<double> measured, predicted;  // m, means of the views
  for (const SolvedView& view : corners.views) {
    double sum = 0, expected = 0, count = 0;
    for (const BoardDistance& d : observations.views[view.view].distances) {
      const double path = half_path_by_corners(corners, view, *observations.light, d.u, d.v);
      if (!std::isfinite(path)) continue;
      sum += d.distance;
      expected += path;
      count += 1;
    }
    if (count == 0) continue;
    measured.push_back(sum / count);
    predicted.push_back(expected / count);
  }
  if (measured.size() < 3) return {};
  const auto [low, high] = std::ranges::minmax(predicted);
  const std::array<double, 2> line = straight_line(predicted, measured);
  const bool scale_known = high > min_spread * low;
  double mean = 0, expected = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    mean += measured[i] / static_cast<double>(measured.size());
    expected += predicted[i] / static_cast<double>(measured.size());
  }
  const double factor = scale_known ? line[1] : mean / expected;
  if (!(std::abs(factor - 1) > (scale_known ? max_scale : max_offset))) return {};
  return fmt::format(
      "the measured distances grow {:.2f} times as much as the board's size gives ({:.0f} mm for {:.0f} mm): is the "
      "size of "
      "the squares right? Squares of {} would fit the distances, the campaign says {}; the lens does not depend on it, "
      "distances and poses do",
      factor, mean * 1e3, expected * 1e3, config::format_quantity(std::round(square * factor * 1e3) / 1e3, "m"),
      config::format_quantity(square, "m"));
}

}  // namespace tofgraph::calibration
