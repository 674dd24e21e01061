// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/validation.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/scan.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

namespace tofgraph::diagnosis {

namespace {

/// Squared singular values, largest first.
Eigen::VectorXd spectrum(const Eigen::MatrixXd& matrix) {
  const Eigen::MatrixXd small = matrix.rows() < matrix.cols() ? Eigen::MatrixXd(matrix * matrix.transpose())
                                                              : Eigen::MatrixXd(matrix.transpose() * matrix);
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(small, Eigen::EigenvaluesOnly).eigenvalues().reverse();
}

/// Cosines over square images with this number of superpixels: orthonormal, one per column.
Eigen::MatrixXd waves(std::size_t superpixels) {
  const auto side = static_cast<Eigen::Index>(std::lround(std::sqrt(static_cast<double>(superpixels))));
  Eigen::MatrixXd along(side, side);
  for (Eigen::Index at = 0; at < side; ++at) {
    for (Eigen::Index wave = 0; wave < side; ++wave)
      along(at, wave) = std::sqrt((wave == 0 ? 1.0 : 2.0) / static_cast<double>(side)) *
                        std::cos(std::numbers::pi * static_cast<double>(wave) * (static_cast<double>(at) + 0.5) /
                                 static_cast<double>(side));
  }
  Eigen::MatrixXd all(side * side, side * side);
  for (Eigen::Index y = 0; y < side; ++y) {
    for (Eigen::Index v = 0; v < side; ++v) all.block(y * side, v * side, side, side) = along(y, v) * along;
  }
  return all;
}

}  // namespace

Eigen::Vector<double, random_directions> project_out_nuisances(const Problem& problem, const State& state,
                                                               std::size_t i, std::vector<double>& rows) {
  RandomMatrix information = RandomMatrix::Zero();
  Eigen::Vector<double, random_directions> score = decltype(score)::Zero();
  const auto directions = [&](std::size_t row) {
    return Eigen::Vector<double, random_directions>(
        state.jitter_response(problem, i, row), problem.offset_response(i, row), state.light_response(problem, i, row));
  };
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const double variance = problem.data[i].variance[row];
    if (std::isinf(variance)) continue;
    const auto along = directions(row);
    information += along * along.transpose() / variance;
    score += along * rows[row] / variance;
  }
  information.diagonal() *= 1 + 1e-9;  // two directions may be equal
  information.diagonal().array() += 1e-9;
  Eigen::Vector<double, random_directions> taken = information.ldlt().solve(score);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (!std::isinf(problem.data[i].variance[row])) rows[row] -= taken.dot(directions(row));
  }
  return taken;
}

std::vector<Eigen::MatrixXd> whitened_residuals(const Problem& problem, const State& state) {
  const auto rows = with_nuisances(problem, state, expected(problem, state));
  const std::size_t n = problem.design.superpixels();
  const auto conditions = static_cast<Eigen::Index>(rows.size());
  std::vector<Eigen::MatrixXd> result(observables, Eigen::MatrixXd::Zero(conditions, static_cast<Eigen::Index>(n)));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<double> left = problem.data[i].value;
    for (std::size_t row = 0; row < left.size(); ++row) left[row] -= rows[i][row];
    project_out_nuisances(problem, state, i, left);
    for (std::size_t row = 0; row < left.size(); ++row) {
      const double variance = problem.data[i].variance[row];
      if (!std::isinf(variance))
        result[row / n](static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(row % n)) =
            left[row] / std::sqrt(variance);
    }
    if (!state.nuisances.smooth_field) continue;
    Eigen::MatrixXd here = result[distance].row(static_cast<Eigen::Index>(i)).transpose();
    state.nuisances.smooth_field->whiten(i, here);
    result[distance].row(static_cast<Eigen::Index>(i)) = here.transpose();
  }
  return result;
}

std::vector<double> leading_pattern(const Problem& problem, const State& state, std::size_t observable) {
  const Eigen::MatrixXd left = whitened_residuals(problem, state)[observable];
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(left.transpose() * left);
  const Eigen::VectorXd shape = solver.eigenvectors().col(left.cols() - 1), height = left * shape;
  const std::size_t n = problem.design.superpixels();
  std::vector<double> pattern(n);
  for (std::size_t s = 0; s < n; ++s) {
    double square = 0, count = 0;
    for (std::size_t i = 0; i < problem.data.size(); ++i) {
      const double variance = problem.data[i].variance[observable * n + s];
      if (std::isinf(variance)) continue;
      square += std::pow(height(static_cast<Eigen::Index>(i)), 2) * variance;
      ++count;
    }
    if (count > 0) pattern[s] = shape(static_cast<Eigen::Index>(s)) * std::sqrt(square / count);
  }
  return pattern;
}

std::array<std::size_t, observables> parallel_analysis(const Problem& problem, const State& state, std::uint64_t seed) {
  std::array<std::size_t, observables> rank{};
  if (problem.design.superpixels() < 2) return rank;  // nothing varies over the image
  std::mt19937_64 generator(seed);
  std::vector<Eigen::Index> single(problem.data.size());
  std::iota(single.begin(), single.end(), 0);
  const std::vector<Eigen::Index> runs = runs_of(problem, state);  // a smooth field affects distances only
  std::vector<Eigen::MatrixXd> all = whitened_residuals(problem, state);
  // A smooth field stays smooth if signs of its waves flip, but not if those of superpixels do.
  if (state.nuisances.smooth_field) all[distance] *= waves(problem.design.superpixels());
  for (std::size_t o = 0; o < observables; ++o) {
    const Eigen::MatrixXd& matrix = all[o];
    if (matrix.isZero()) continue;
    const Eigen::VectorXd seen = spectrum(matrix);
    const std::vector<Eigen::Index>& units = o == distance ? runs : single;
    Eigen::VectorXd signs(1 + std::ranges::max(units));
    double sum = 0, squares = 0;
    for (int d = 0; d < settings.parallel_analysis_draws; ++d) {
      Eigen::MatrixXd drawn = matrix;
      for (auto column : drawn.colwise()) {
        for (double& sign : signs) sign = (generator() & 1U) != 0 ? 1 : -1;
        column.array() *= signs(units).array();
      }
      const double largest = spectrum(drawn)(0);
      sum += largest;
      squares += largest * largest;
    }
    const double mean = sum / settings.parallel_analysis_draws,
                 deviation = std::sqrt(std::max(squares / settings.parallel_analysis_draws - mean * mean, 0.0));
    rank[o] = static_cast<std::size_t>((seen.array() > mean + settings.component_sd * deviation).count());
  }
  return rank;
}

bool practically_equivalent(const Problem& problem, const State& one, const State& other) {
  const RandomEffectSd& sd = one.random_sd;
  Column change = difference(expected(problem, other), expected(problem, one));
  double square = 0;
  for (std::size_t i = 0; i < change.size(); ++i) {
    const auto taken = project_out_nuisances(problem, other, i, change[i]);
    square += std::pow(taken(0) + taken(1), 2) / (sd.jitter * sd.jitter + sd.offset * sd.offset) +
              std::pow(taken(2) / sd.light, 2);
  }
  return square < settings.tie_limit && max_normalised_rms(problem, change) < 1;
}

std::vector<Column> signature(const Problem& problem, const State& without, const State& with,
                              const ModelTerm& addition) {
  State state = without;
  const Term& term = with.terms[addition.term];
  const std::span<const double> values = values_of(term, addition);
  std::size_t at = state.terms.size(), first = 0;
  if (addition.refinement) {
    at = addition.term;
    state.terms[at] = refined(state.terms[at], *addition.refinement, values);
    first = state.terms[at].candidate->first_parameter_of(*addition.refinement);
  } else {
    state.terms.push_back(term);
  }
  const auto rows = expected(problem, state);
  std::vector<Column> columns = {difference(rows, expected(problem, without))};
  for (std::size_t k = first; k < first + values.size(); ++k)
    columns.push_back(derivative(problem, state, rows, at, k));
  return columns;
}

std::vector<double> influence(const Problem& problem, const State& state, std::size_t term) {
  ModelFit without;
  without.state = removed(state, {term, {}});
  const auto rows = expected(problem, without.state);
  without.jacobian = jacobian(problem, without.state, rows);
  const Group change{{difference(expected(problem, state), rows)}};
  const Score score = score_of(problem, without, change);
  if (!(score.gain > 0)) return {};
  const auto conditions = static_cast<Eigen::Index>(problem.data.size());  // rows beyond it: shared random unknowns
  const Eigen::VectorXd shares = score.shares.topRows(conditions) * score.values;
  const double all = shares.sum();
  if (!(all > 0)) return {};
  std::vector<double> result;
  for (const double share : shares) result.push_back(share / all);
  return result;
}

Eigen::MatrixXd correlations(const ModelFit& fit) {
  Eigen::Index count = 0;
  for (const Term& term : fit.state.terms) count += static_cast<Eigen::Index>(term.values.size());
  const Eigen::MatrixXd covariance = fit.covariance.topLeftCorner(count, count);
  const Eigen::VectorXd sd = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd scale = (sd.array() > 0).select(sd.cwiseInverse(), 0);
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

}  // namespace tofgraph::diagnosis
