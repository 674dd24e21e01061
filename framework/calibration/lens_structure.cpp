// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Detection of patterns in the residuals that the fitted model cannot represent: Rao's score test on further terms.
#include "calibration/lens_linearisation.hpp"
#include "calibration/lens_validation.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <boost/math/special_functions/gamma.hpp>

#include <algorithm>
#include <cmath>
#include <functional>

namespace tofgraph::calibration {
namespace {

/// Terms beyond the model: displacement of a point's image by each of them, px.
struct Terms {
  std::vector<std::string> names;
  std::function<Eigen::MatrixXd(const PointDerivatives&, const BoardPoint&)> columns;  ///< 2 x names
};

/// Sums over all corners: Gram matrix of parameters and terms, and the products of the terms with the residuals.
struct Sums {
  Eigen::MatrixXd gram;
  Eigen::VectorXd product;
  double corners = 0, variance = 0;  ///< px^2, mean variance of the corners
};

Sums sums_of(const Observations& observations, const LensSolution& solution, const Terms& terms) {
  const auto shared = static_cast<Eigen::Index>(solution.layout.lens.size() + solution.layout.warp);
  const auto extra = static_cast<Eigen::Index>(terms.names.size());
  const auto poses = static_cast<Eigen::Index>(6 * solution.views.size()), size = shared + poses + extra;
  Sums sums{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), 0, 0};
  for (std::size_t i = 0; i < solution.views.size(); ++i) {
    const SolvedView& view = solution.views[i];
    const View& seen = observations.views[view.view];
    for (std::size_t k = 0; k < seen.corners.size(); ++k) {
      const Corner& corner = seen.corners[k];
      const BoardPoint& point = observations.points[corner.point];
      PointDerivatives d;
      if (!view.used[k] || !derivatives_of(solution, view.pose, point, warp_basis(observations, point), d)) continue;
      const Eigen::Matrix2d white = whitening(corner, solution.variance_factor);
      Eigen::MatrixXd row = Eigen::MatrixXd::Zero(2, size);
      row.leftCols(shared) = white * d.shared;
      row.middleCols(shared + 6 * static_cast<Eigen::Index>(i), 6) = white * d.pose;
      row.rightCols(extra) = white * terms.columns(d, point);
      const Eigen::Vector2d residual = white * Eigen::Vector2d(view.residuals[k][0], view.residuals[k][1]);
      sums.gram.selfadjointView<Eigen::Lower>().rankUpdate(row.transpose());
      sums.product += row.transpose() * residual;
      sums.corners += 1;
      sums.variance += (corner.covariance[0] + corner.covariance[2]) / 2 * solution.variance_factor;
    }
  }
  sums.gram = sums.gram.selfadjointView<Eigen::Lower>();
  sums.variance /= std::max(sums.corners, 1.0);
  return sums;
}

Structure test(const Observations& observations, const LensSolution& solution, const Terms& terms) {
  const Sums sums = sums_of(observations, solution, terms);
  const auto extra = static_cast<Eigen::Index>(terms.names.size()), rest = sums.gram.rows() - extra;
  const Eigen::VectorXd scale = sums.gram.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd gram = scale.asDiagonal() * sums.gram * scale.asDiagonal();
  const Eigen::VectorXd product = scale.asDiagonal() * sums.product;
  const Eigen::LDLT<Eigen::MatrixXd> known(gram.topLeftCorner(rest, rest));
  const Eigen::MatrixXd across = gram.topRightCorner(rest, extra);
  // Part of the terms that is orthogonal to the parameters, and the projection of the residuals onto it.
  const Eigen::MatrixXd own = gram.bottomRightCorner(extra, extra) - across.transpose() * known.solve(across);
  const Eigen::VectorXd along = product.tail(extra) - across.transpose() * known.solve(product.head(rest));
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(own);
  Structure result;
  for (Eigen::Index i = 0; i < extra; ++i) {
    if (modes.eigenvalues()[i] < 1e-9) continue;  // redundant with the parameters
    result.statistic += std::pow(modes.eigenvectors().col(i).dot(along), 2) / modes.eigenvalues()[i];
    result.terms += 1;
  }
  if (result.terms == 0) return result;
  result.p_value = boost::math::gamma_q(result.terms / 2, result.statistic / 2);
  result.size = std::sqrt(std::max(result.statistic - result.terms, 0.0) / (2 * sums.corners) * sums.variance);
  result.found = result.p_value < structure_p_value && result.size > structure_size;
  double most = 0;
  for (Eigen::Index i = 0; i < extra; ++i) {
    const double single = own(i, i) > 1e-9 ? along[i] * along[i] / own(i, i) : 0;
    if (single <= most) continue;
    most = single;
    result.explanation = fmt::format("{} explains {:.0f} % of it", terms.names[static_cast<std::size_t>(i)],
                                     100 * single / result.statistic);
  }
  return result;
}

}  // namespace

Structure lens_structure(const Observations& observations, const LensSolution& solution) {
  double limit = 0;  // largest observed squared tangent, normalises the terms to about 1
  for (const SolvedView& view : solution.views) {
    for (const Corner& corner : observations.views[view.view].corners) {
      double xy[2];
      if (unproject(solution.lens, corner.u, corner.v, xy)) limit = std::max(limit, xy[0] * xy[0] + xy[1] * xy[1]);
    }
  }
  const double fx = solution.lens[lens::fx], fy = solution.lens[lens::fy];
  const Terms terms{{"a radial term of the seventh order (k3)", "a radial term of the ninth order",
                     "a radial term of order eleven", "a skew of the axes", "a thin prism in x", "a thin prism in y",
                     "a thin prism of higher order in x", "a thin prism of higher order in y"},
                    [=](const PointDerivatives& d, const BoardPoint&) {
                      const double x = d.plane.x(), y = d.plane.y(), s = (x * x + y * y) / limit;
                      Eigen::MatrixXd columns(2, 8);
                      columns.row(0) << x * s * s * s, x * std::pow(s, 4), x * std::pow(s, 5), y, s, 0, s * s, 0;
                      columns.row(1) << y * s * s * s, y * std::pow(s, 4), y * std::pow(s, 5), 0, 0, s, 0, s * s;
                      return Eigen::MatrixXd(Eigen::Vector2d(fx, fy).asDiagonal() * columns);
                    }};
  return test(observations, solution, terms);
}

Structure board_structure(const Observations& observations, const LensSolution& solution) {
  double x = 1e-9, y = 1e-9;
  for (const BoardPoint& p : observations.points) {
    x = std::max(x, std::abs(p.x));
    y = std::max(y, std::abs(p.y));
  }
  const Terms terms{{"an S shape along x", "an S shape along y", "a cubic bend across x", "a cubic bend across y",
                     "a fourth-order bend along x", "a fourth-order bend along y", "a fourth-order bend of both"},
                    [=](const PointDerivatives& d, const BoardPoint& p) {
                      const double a = p.x / x, b = p.y / y;
                      Eigen::RowVectorXd heights(7);
                      heights << a * a * a, b * b * b, a * a * b, a * b * b, a * a * a * a, b * b * b * b,
                          a * a * b * b;
                      return Eigen::MatrixXd(d.height * heights);
                    }};
  return test(observations, solution, terms);
}

}  // namespace tofgraph::calibration
