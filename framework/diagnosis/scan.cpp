// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/scan.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph::diagnosis {
namespace {

/// A condition's Gram with the targets' columns put in: [own, targets, tried, residual].
Gram with_targets(const Gram& gram, int target, Eigen::Index own, Eigen::Index targets) {
  const Eigen::Index all = gram.cols() - gram_tail, tried = all - own, light = all + 1, residual = all + 2;
  const Eigen::Index size = own + targets + tried + 1;
  // Which column of the Gram stands at each place; the light's where this condition's target is.
  std::vector<Eigen::Index> to, from;
  const auto place = [&](Eigen::Index at, Eigen::Index source) {
    to.push_back(at);
    from.push_back(source);
  };
  for (Eigen::Index c = 0; c < own; ++c) place(c, c);
  if (target >= 0) place(own + target, light);
  for (Eigen::Index c = 0; c < tried; ++c) place(own + targets + c, own + c);
  place(size - 1, residual);
  Gram result = Gram::Zero(size, size);
  result(to, to) = gram(from, from);
  return result;
}

/// Scores of the tried columns, one row a condition, with own columns and targets taken out.
struct Projected {
  Eigen::MatrixXd scores;       ///< conditions x columns
  Eigen::MatrixXd information;  ///< columns x columns
  double square = 0;
};

Projected project(const std::vector<Gram>& grams, Eigen::Index unknowns) {
  const Eigen::Index size = grams.front().cols(), tried = size - unknowns - 1;
  Gram sum = Gram::Zero(size, size);
  for (const Gram& gram : grams) sum += gram;
  Eigen::MatrixXd held = sum.topLeftCorner(unknowns, unknowns);
  held.diagonal().array() += 1 / (prior_width * prior_width);
  const Eigen::LDLT<Eigen::MatrixXd> factors(held);
  const Eigen::MatrixXd taken = unknowns > 0
                                    ? Eigen::MatrixXd(factors.solve(sum.block(0, unknowns, unknowns, tried + 1)))
                                    : Eigen::MatrixXd(0, tried + 1);
  Projected result;
  result.information =
      sum.block(unknowns, unknowns, tried, tried) - sum.block(unknowns, 0, tried, unknowns) * taken.leftCols(tried);
  result.square = sum(size - 1, size - 1) - sum.row(size - 1).head(unknowns).dot(taken.col(tried));
  result.scores.resize(static_cast<Eigen::Index>(grams.size()), tried);
  const Eigen::MatrixXd change = taken.leftCols(tried);
  const Eigen::VectorXd fitted = taken.col(tried);
  for (std::size_t i = 0; i < grams.size(); ++i) {
    const Gram& g = grams[i];
    const Eigen::VectorXd own = g.col(size - 1).head(unknowns) - g.topLeftCorner(unknowns, unknowns) * fitted;
    result.scores.row(static_cast<Eigen::Index>(i)) =
        (g.col(size - 1).segment(unknowns, tried) - g.block(unknowns, 0, tried, unknowns) * fitted -
         change.transpose() * own)
            .transpose();
  }
  return result;
}

/// A group's columns in coordinates in which its information is the unit matrix.
struct Whitened {
  Eigen::MatrixXd scores;  ///< conditions x columns
  double statistic(const Eigen::VectorXd& signs) const { return (scores.transpose() * signs).norm(); }
};

Whitened whiten(const Projected& projected, Eigen::Index first, Eigen::Index count, Score& score) {
  const Eigen::MatrixXd information = projected.information.block(first, first, count, count);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(information);
  const double prior = 1 / (prior_width * prior_width);
  const Eigen::ArrayXd values = solver.eigenvalues().array().max(0);
  score.dimension = (values / (values + prior)).sum();
  score.norm = std::sqrt(values.maxCoeff());
  const Eigen::MatrixXd root = solver.eigenvectors() * (values + prior).sqrt().inverse().matrix().asDiagonal();
  Whitened result{projected.scores.middleCols(first, count) * root};
  const Eigen::VectorXd total = result.scores.colwise().sum();
  score.gain = total.squaredNorm();
  score.values = root * total;
  // What each condition adds along the direction that was found.
  const Eigen::ArrayXd shares = (result.scores * total).array() / std::max(score.gain, 1e-300);
  score.carriers = 1 / std::max(shares.square().sum(), 1e-300);
  return result;
}

void flip(const std::vector<Whitened>& groups, std::vector<Score>& scores, std::size_t draws, std::uint64_t seed) {
  const std::size_t n = groups.size();
  std::vector<std::vector<double>> drawn(draws, std::vector<double>(n));
  std::mt19937_64 generator(seed);
  std::vector<Eigen::VectorXd> signs(draws, Eigen::VectorXd(groups.front().scores.rows()));
  for (Eigen::VectorXd& s : signs) {
    for (double& sign : s) sign = (generator() & 1U) != 0 ? 1 : -1;
  }
  // Groups of different size are compared by how far they are beyond what noise gives.
  const auto beyond = [&](std::size_t g, double statistic) { return statistic - std::sqrt(scores[g].dimension); };
  tbb::parallel_for(std::size_t{0}, draws, [&](std::size_t d) {
    for (std::size_t g = 0; g < n; ++g) drawn[d][g] = beyond(g, groups[g].statistic(signs[d]));
  });
  for (std::size_t g = 0; g < n; ++g) {
    const double seen = beyond(g, std::sqrt(scores[g].gain));
    std::size_t any = 1, own = 1;
    for (const std::vector<double>& draw : drawn) {
      any += *std::ranges::max_element(draw) >= seen ? 1U : 0U;
      own += draw[g] >= seen ? 1U : 0U;
    }
    scores[g].p_value = static_cast<double>(any) / static_cast<double>(draws + 1);
    scores[g].own_p_value = static_cast<double>(own) / static_cast<double>(draws + 1);
  }
}

}  // namespace

Scan scan(const Problem& problem, const Fit& fit, std::span<const Group> groups, std::size_t flips,
          std::uint64_t seed) {
  const auto rows = expected(problem, fit.state);
  std::vector<Column> columns = own_columns(problem, fit.state, rows);
  const auto own = static_cast<Eigen::Index>(columns.size()),
             targets = static_cast<Eigen::Index>(problem.targets.size());
  for (const Group& group : groups) columns.insert(columns.end(), group.columns.begin(), group.columns.end());
  std::vector<Gram> grams = grams_of(problem, rows, columns);
  tbb::parallel_for(std::size_t{0}, grams.size(), [&](std::size_t i) {
    double determinant = 0;
    grams[i] = with_targets(marginal(grams[i], fit.state.variances, determinant), problem.target[i], own, targets);
  });
  const Projected projected = project(grams, own + targets);
  Scan result;
  result.square = projected.square;
  result.information = projected.information;
  for (const Observations& data : problem.data)
    result.freedom +=
        static_cast<double>(std::ranges::count_if(data.variance, [](double v) { return std::isfinite(v); }));
  result.freedom -= fit.dimension + static_cast<double>(targets);
  std::vector<Whitened> whitened;
  Eigen::Index first = 0;
  for (const Group& group : groups) {
    const auto count = static_cast<Eigen::Index>(group.columns.size());
    whitened.push_back(whiten(projected, first, count, result.scores.emplace_back()));
    first += count;
  }
  if (flips > 0 && !groups.empty()) flip(whitened, result.scores, flips, seed);
  return result;
}

double false_discovery_limit(std::vector<double> p_values, double q) {
  std::ranges::sort(p_values);
  double limit = 0;
  for (std::size_t i = 0; i < p_values.size(); ++i) {
    if (p_values[i] <= q * static_cast<double>(i + 1) / static_cast<double>(p_values.size())) limit = p_values[i];
  }
  return limit;
}

}  // namespace tofgraph::diagnosis
