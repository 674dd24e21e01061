// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/lens_distances.hpp"

#include "calibration/lens_judgement.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <boost/math/distributions/chi_squared.hpp>

#include <cmath>

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
  // Below, both covariances are the same but for rounding and linearisation; in units of the corners' variances.
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

std::string square_problem(const LensSolution& joint, double square) {
  const double range = typical_range(joint);
  const double excess = joint.range_offset + joint.range_scale * range;
  if (std::abs(joint.range_offset) <= std::min(0.1, 0.1 * range)) return {};
  return fmt::format(
      "the measured distances are {:.0f} mm {} than the board's size gives at {:.0f} mm: is the size right? Squares of "
      "{} would fit the distances, the campaign says {}",
      std::abs(excess) * 1e3, excess > 0 ? "longer" : "shorter", range * 1e3,
      config::format_quantity(std::round(square * (1 + excess / range) * 1e4) / 1e4, "m"),
      config::format_quantity(square, "m"));
}

}  // namespace tofgraph::calibration
