// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/mixed_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

struct Bounds {
  double least, most;
};
constexpr Bounds jitter_bounds{1e-6, 1}, offset_bounds{1e-6, 1e-2}, light_bounds{1e-6, 0.1};

/// The least value of f over ln x by golden sections.
template <class F> double minimise(F f, Bounds bounds, double centre, double width) {
  constexpr double golden = 0.6180339887498949;
  double low = std::max(std::log(bounds.least), std::log(centre) - width);
  double high = std::min(std::log(bounds.most), std::log(centre) + width);
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double at_a = f(std::exp(a)), at_b = f(std::exp(b));
  while (high - low > 0.02) {
    if (at_a < at_b) {
      high = b, b = a, at_b = at_a;
      a = high - golden * (high - low), at_a = f(std::exp(a));
    } else {
      low = a, a = b, at_a = at_b;
      b = low + golden * (high - low), at_b = f(std::exp(b));
    }
  }
  return std::exp((low + high) / 2);
}

}  // namespace

RandomMatrix woodbury(const RandomMatrix& gram, const Variances& variances, double& log_determinant) {
  const Eigen::Matrix<double, random_directions, 1> scale(variances.jitter, variances.offset, variances.light);
  const RandomMatrix inner = RandomMatrix::Identity() + scale.asDiagonal() * gram * scale.asDiagonal();
  // g and o may be one and the same, many orders beyond the unit matrix: cofactors would lose what is left of them.
  const Eigen::LDLT<RandomMatrix> factors(inner);
  log_determinant = factors.vectorD().array().log().sum();
  return scale.asDiagonal() * factors.solve(RandomMatrix::Identity()) * scale.asDiagonal();
}

Gram marginal(const Gram& gram, const Variances& variances, double& log_determinant) {
  const Eigen::Index g = gram.cols() - gram_tail;
  const RandomMatrix middle =
      woodbury(gram.block<random_directions, random_directions>(g, g), variances, log_determinant);
  const auto random = gram.middleCols<random_directions>(g);
  return gram - random * middle * random.transpose();
}

NormalEquations assemble(std::span<const Gram> marginals, std::span<const double> log_determinants,
                         const Unknowns& unknowns, std::span<const double> weight) {
  const Eigen::Index p = unknowns.effects, light = p + random_directions - 1, residual = p + random_directions,
                     all = p + unknowns.targets;
  NormalEquations sum{Eigen::MatrixXd::Zero(all, all), Eigen::VectorXd::Zero(all), 0, 0};
  for (std::size_t i = 0; i < marginals.size(); ++i) {
    const double w = weight[i];
    if (w == 0) continue;
    const Gram& m = marginals[i];
    sum.information.topLeftCorner(p, p) += w * m.topLeftCorner(p, p);
    sum.score.head(p) += w * m.col(residual).head(p);
    sum.square += w * m(residual, residual);
    sum.log_determinant += w * log_determinants[i];
    if (unknowns.target[i] < 0) continue;
    const Eigen::Index t = p + unknowns.target[i];
    sum.information.col(t).head(p) += w * m.col(light).head(p);
    sum.information.row(t).head(p) += w * m.col(light).head(p).transpose();
    sum.information(t, t) += w * m(light, light);
    sum.score(t) += w * m(light, residual);
  }
  return sum;
}

Solution solve(const NormalEquations& equations, Eigen::Index effects) {
  Eigen::MatrixXd information = equations.information;
  const double prior = 1 / (prior_width * prior_width);
  information.diagonal().array() += prior;
  const Eigen::LDLT<Eigen::MatrixXd> factors(information);
  Solution result;
  result.values = factors.solve(equations.score);
  result.covariance = factors.solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  result.deviance = equations.square - result.values.dot(equations.score) + equations.log_determinant;
  for (Eigen::Index j = 0; j < effects; ++j)
    result.dimension += std::clamp(1 - prior * result.covariance(j, j), 0.0, 1.0);
  return result;
}

Profile profile(std::span<const Gram> grams, const Unknowns& unknowns, std::span<const double> weight,
                const Variances& start) {
  std::vector<Gram> marginals(grams.size());
  std::vector<double> determinants(grams.size());
  const auto at = [&](const Variances& variances) {
    for (std::size_t i = 0; i < grams.size(); ++i) {
      if (weight[i] != 0) marginals[i] = marginal(grams[i], variances, determinants[i]);
    }
    return solve(assemble(marginals, determinants, unknowns, weight), unknowns.effects);
  };
  Variances best = start;
  for (const double width : {3.0, 1.0}) {
    const auto vary = [&](double Variances::*which, Bounds bounds) {
      Variances varied = best;
      const auto deviance = [&](double x) {
        varied.*which = x;
        return at(varied).deviance;
      };
      best.*which = minimise(deviance, bounds, best.*which, width);
    };
    vary(&Variances::jitter, jitter_bounds);
    if (start.offset > 0) vary(&Variances::offset, offset_bounds);
    vary(&Variances::light, light_bounds);
  }
  return {best, at(best)};
}

}  // namespace tofgraph::diagnosis
