// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/smooth_field.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/validation.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Cosines over the superpixels, without the constant, whose squares sum to 1 on average; from two half waves on, their
/// variance falls with the fourth power of the number of half waves.
Eigen::MatrixXd cosines(std::size_t side) {
  std::vector<Eigen::VectorXd> columns;
  double sum = 0;
  const auto n = static_cast<Eigen::Index>(side);
  for (int x = 0; x <= settings.field_max_half_waves; ++x) {
    for (int y = 0; y <= settings.field_max_half_waves; ++y) {
      const double waves = std::hypot(x, y);
      if (waves == 0 || waves > settings.field_max_half_waves) continue;
      const double variance = std::pow(1 + waves * waves / 4, -2);
      Eigen::VectorXd& column = columns.emplace_back(n * n);
      for (Eigen::Index s = 0; s < n * n; ++s) {
        const auto at = [n](Eigen::Index i) {
          return std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n);
        };
        column(s) = std::sqrt(variance) * std::cos(x * at(s % n)) * std::cos(y * at(s / n));
      }
      sum += column.squaredNorm() / static_cast<double>(n * n);
    }
  }
  Eigen::MatrixXd all(n * n, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) all.col(static_cast<Eigen::Index>(c)) = columns[c] / std::sqrt(sum);
  return all;
}

/// Runs of conditions in the order of measurement over which a smooth field hardly changes: random signs are drawn for
/// runs, not for single conditions. @returns index of the run of each condition; empty if the order is not stated
std::vector<Eigen::Index> estimated_runs(const Problem& problem, const State& state, const SmoothField& smooth_field) {
  const std::size_t count = problem.data.size();
  if (!problem.design.tells_order()) return {};
  State plain = state;
  plain.nuisances.smooth_field = nullptr;
  const Eigen::MatrixXd left = whitened_residuals(problem, plain)[distance];
  Eigen::MatrixXd smooth(left.rows(), left.cols());  // m, the smooth field in the residual
  for (std::size_t i = 0; i < count; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::MatrixXd& along = smooth_field.modes(i);
    smooth.row(row) =
        (along * smooth_field.taken(i).asDiagonal() * (along.transpose() * left.row(row).transpose())).transpose();
    for (Eigen::Index s = 0; s < left.cols(); ++s) {
      const double variance =
          problem.data[i].variance[distance * static_cast<std::size_t>(left.cols()) + static_cast<std::size_t>(s)];
      smooth(row, s) *= std::isinf(variance) ? 0 : std::sqrt(variance);
    }
  }
  std::vector<std::size_t> measured(count);
  std::iota(measured.begin(), measured.end(), 0);
  std::ranges::sort(measured, {}, [&](std::size_t i) { return *problem.design.conditions()[i].order; });
  const double square = smooth.squaredNorm() / static_cast<double>(count);
  std::size_t length = 1;
  for (; length < count; ++length) {
    double product = 0;
    for (std::size_t k = length; k < count; ++k)
      product += smooth.row(static_cast<Eigen::Index>(measured[k]))
                     .dot(smooth.row(static_cast<Eigen::Index>(measured[k - length])));
    if (product < settings.field_run_correlation * square * static_cast<double>(count - length)) break;
  }
  std::vector<Eigen::Index> runs(count);
  for (std::size_t k = 0; k < count; ++k) runs[measured[k]] = static_cast<Eigen::Index>(k / length);
  return runs;
}

}  // namespace

SmoothField::SmoothField(const std::vector<Observations>& data) {
  const std::size_t n = data.front().variance.size() / observables;
  const Eigen::MatrixXd waves = cosines(static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(n)))));
  std::vector<Field> fields(data.size());
  tbb::parallel_for(std::size_t{0}, data.size(), [&](std::size_t i) {
    Eigen::MatrixXd weighted = waves;
    for (std::size_t s = 0; s < n; ++s)
      weighted.row(static_cast<Eigen::Index>(s)) /= std::sqrt(data[i].variance[distance * n + s]);  // 0 where unknown
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(weighted.transpose() * weighted);
    const Eigen::VectorXd variance = solver.eigenvalues().cwiseMax(0);
    const auto kept = static_cast<Eigen::Index>((variance.array() > 1e-9 * variance.maxCoeff()).count());
    const Eigen::VectorXd largest = variance.tail(kept);
    fields[i] = {weighted * solver.eigenvectors().rightCols(kept) * largest.cwiseSqrt().cwiseInverse().asDiagonal(),
                 largest};
  });
  fields_ = std::make_shared<const std::vector<Field>>(std::move(fields));
}

SmoothField::SmoothField(const SmoothField& other, double sd) : fields_(other.fields_), sd_(sd) {}

Eigen::VectorXd SmoothField::taken(std::size_t condition) const {
  const Eigen::ArrayXd variance = sd_ * sd_ * (*fields_)[condition].variance.array();
  return variance / (1 + variance);
}

Eigen::VectorXd SmoothField::drawn(std::size_t condition, std::mt19937_64& generator) const {
  std::normal_distribution<double> normal;
  Eigen::VectorXd heights = sd_ * (*fields_)[condition].variance.cwiseSqrt();
  for (double& height : heights) height *= normal(generator);
  return modes(condition) * heights;
}

double SmoothField::log_determinant(std::size_t condition) const {
  return (1 + sd_ * sd_ * (*fields_)[condition].variance.array()).log().sum();
}

void SmoothField::whiten(std::size_t condition, Eigen::Ref<Eigen::MatrixXd> rows) const {
  const Eigen::MatrixXd& along = modes(condition);
  const Eigen::VectorXd less = 1 - (1 - taken(condition).array()).sqrt();
  const Eigen::MatrixXd parts = less.asDiagonal() * (along.transpose() * rows);
  rows.noalias() -= along * parts;
}

std::shared_ptr<const SmoothField> with_data(const std::shared_ptr<const SmoothField>& smooth_field,
                                             const std::vector<Observations>& data) {
  return smooth_field ? std::make_shared<const SmoothField>(SmoothField(data), smooth_field->sd()) : nullptr;
}

SmoothFieldTrial smooth_field_of(const Problem& problem, const ModelFit& fit) {
  const std::size_t n = problem.design.superpixels();
  if (n < 2) return {};
  State plain = fit.state;
  plain.nuisances.smooth_field = nullptr;
  const auto rows = expected(problem, plain);
  const std::vector<Column> columns = jacobian(problem, plain, rows);
  const SmoothField fields(problem.data);
  std::vector<Gram> whole(rows.size());
  std::vector<Eigen::MatrixXd> along(rows.size());  // modes x columns
  tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) {
    const Eigen::MatrixXd all = weighted_columns(problem, plain, rows[i], columns, i);
    whole[i] = all.transpose() * all;
    along[i] = fields.modes(i).transpose() * all.topRows(static_cast<Eigen::Index>(n));
  });
  const Unknowns unknowns = problem.unknowns(columns.size());
  const auto grams_with = [&](double sd, double& determinant) {
    const SmoothField smooth_field(fields, sd);
    std::vector<Gram> grams(rows.size());
    determinant = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      grams[i] = whole[i] - along[i].transpose() * smooth_field.taken(i).asDiagonal() * along[i];
      determinant += smooth_field.log_determinant(i);
    }
    return grams;
  };
  const auto roughly = [&](double sd) {  // at the fit's variances
    double determinant = 0;
    std::vector<Gram> grams = grams_with(sd, determinant);
    const std::vector<double> determinants = marginalise(grams, fit.state.random_sd);
    return solve(assemble(grams, determinants, unknowns), unknowns, fit.state.random_sd).deviance + determinant;
  };
  const auto exactly = [&](double sd) {
    double determinant = 0;
    const std::vector<Gram> grams = grams_with(sd, determinant);
    return profile(grams, unknowns, fit.state.random_sd).solution.deviance + determinant;
  };
  const double now = fit.state.nuisances.smooth_field ? fit.state.nuisances.smooth_field->sd() : 0;
  double best = 0, lowest = roughly(0) - settings.field_min_deviance_gain;
  for (double sd = settings.field_min_trial_sd; sd <= settings.field_max_trial_sd; sd *= settings.field_trial_factor) {
    const double here = roughly(sd);
    if (here < lowest) lowest = here, best = sd;
  }
  if (best == 0 || best == now) return {};
  auto smooth_field = std::make_shared<const SmoothField>(fields, best);
  std::vector<Eigen::Index> runs = estimated_runs(problem, fit.state, *smooth_field);
  if (!runs.empty() && std::ranges::max(runs) + 1 < settings.field_min_runs) return {};
  return {std::move(smooth_field), std::move(runs), exactly(now) - exactly(best)};
}

}  // namespace tofgraph::diagnosis
