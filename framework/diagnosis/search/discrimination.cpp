// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/discrimination.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/candidate.hpp"
#include "diagnosis/model/residual_structure.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

/// True if a change reaches practical_threshold, root mean square of some observable.
bool matters(const Problem& problem, std::size_t i, const std::vector<double>& change) {
  const std::size_t n = problem.design.superpixels();
  for (std::size_t o = 0; o < observables; ++o) {
    double square = 0, count = 0;
    for (std::size_t row = o * n; row < (o + 1) * n; ++row) {
      if (std::isinf(problem.data[i].variance[row])) continue;
      square += change[row] * change[row];
      ++count;
    }
    if (count > 0 && std::sqrt(square / count) >= settings.practical_threshold[o]) return true;
  }
  return false;
}

/// Derivatives by the targets' ln reflectivities: one column a target.
void append_light(const Problem& problem, const State& state, std::vector<Column>& columns) {
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    Column& column = columns.emplace_back(problem.design.size(), std::vector<double>(problem.design.rows(), 0));
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (problem.target[i] != static_cast<int>(t)) continue;
      for (std::size_t row = 0; row < column[i].size(); ++row) column[i][row] = state.light_response(problem, i, row);
    }
  }
}

/// Derivatives by a model's values and by the targets' light.
std::vector<Column> columns_of(const Problem& problem, const State& model, const Column& rows) {
  std::vector<Column> columns = jacobian(problem, model, rows);
  append_light(problem, model, columns);
  return columns;
}

/// Distance of the data of one model from another, whose values may change as far as the campaign leaves them open.
/// @param data that the one expects, and @param rows the other, @param other @param values_of_other its values' columns
/// @param told of these; empty: they stay as they are
ModelDistance between(const Problem& problem, const Column& data, const State& other, const Column& rows,
                      const std::vector<Column>& values_of_other, const Eigen::MatrixXd& information) {
  const RandomEffectSd& sd = other.random_sd;
  std::vector<Column> columns = {difference(data, rows)};
  if (information.size() > 0) std::ranges::copy(values_of_other, std::back_inserter(columns));
  const std::vector<Gram> grams = grams_of(problem, other, rows, columns);
  const Eigen::Index values = information.rows();
  ModelDistance result{{}, columns.front()};
  for (std::size_t i = 0; i < grams.size(); ++i) {
    double determinant = 0;
    const Gram gram = marginal(grams[i], sd, determinant);
    double square = gram(0, 0);
    if (values > 0) {
      const Eigen::VectorXd cross = gram.block(1, 0, values, 1);
      const Eigen::VectorXd moved = Eigen::MatrixXd(information + gram.block(1, 1, values, values)).ldlt().solve(cross);
      square -= cross.dot(moved);
      for (Eigen::Index k = 0; k < values; ++k) {
        const std::vector<double>& column = columns[1 + static_cast<std::size_t>(k)][i];
        for (std::size_t row = 0; row < column.size(); ++row) result.left[i][row] -= moved(k) * column[row];
      }
    }
    square = std::max(square, 0.0);
    std::vector<double> rest = result.left[i];
    const auto taken = project_out_nuisances(problem, other, i, rest);
    if (!matters(problem, i, rest))  // only as much as the board, the camera's offset and the light differ by
      square = std::min(square, std::pow(taken(0) + taken(1), 2) / (sd.jitter * sd.jitter + sd.offset * sd.offset) +
                                    std::pow(taken(2) / sd.light, 2));
    result.sigma.push_back(std::sqrt(square));
  }
  return result;
}

}  // namespace

Eigen::MatrixXd information_matrix(const Problem& problem, const State& state) {
  std::vector<bool> nonlinear;
  for (const Term& term : state.terms) {
    for (const FreeParameter& p : term.candidate->free()) nonlinear.push_back(p.nonlinear);
  }
  const auto count = static_cast<Eigen::Index>(nonlinear.size() + problem.targets.size());
  if (count == 0) return {};
  try {
    const auto rows = expected(problem, state);
    const std::vector<Column> columns = jacobian(problem, state, rows);
    const Solution solution = solve_linear(problem, state, rows, columns, problem.unknowns(columns.size()));
    Eigen::MatrixXd information = solution.covariance.topLeftCorner(count, count).inverse();
    for (std::size_t k = 0; k < nonlinear.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      if (nonlinear[k]) information(at, at) += 1 / (settings.nonlinear_prior_sd * settings.nonlinear_prior_sd);
    }
    return information;
  } catch (const simulation::EffectError&) {
    return {};
  }
}

QuestionLinearisation linearise_question(const Problem& problem, const Question& question,
                                         const ConditionNuisances& nuisances) {
  QuestionLinearisation result{question.one, {}, {}};
  result.one.nuisances = nuisances;
  result.one.linearisation = {};
  update_reflectivity_jacobian(problem, result.one);
  result.rows = expected(problem, result.one);
  if (question.information_of_one.size() > 0) result.columns = columns_of(problem, result.one, result.rows);
  return result;
}

bool begin_alike(const Question& first, const Question& second) {
  const auto same_term = [](const Term& one, const Term& other) {
    return one.candidate == other.candidate && one.values == other.values && one.maps == other.maps;
  };
  return std::ranges::equal(first.one.terms, second.one.terms, same_term) &&
         first.one.log_reflectivity == second.one.log_reflectivity &&
         (first.information_of_one.size() > 0) == (second.information_of_one.size() > 0);
}

ModelDistance model_distance(const Problem& problem, const QuestionLinearisation& first, const Question& question) {
  const State other = beside(first.one, question.other);
  State one = first.one;
  one.random_sd = question.one.random_sd;
  const auto rows = expected(problem, other);
  std::vector<Column> columns;
  if (question.information_of_other.size() > 0) columns = columns_of(problem, other, rows);
  ModelDistance nearer = between(problem, first.rows, other, rows, columns, question.information_of_other);
  ModelDistance back = between(problem, rows, one, first.rows, first.columns, question.information_of_one);
  for (std::size_t i = 0; i < nearer.sigma.size(); ++i) {
    if (!(back.sigma[i] < nearer.sigma[i])) continue;
    nearer.sigma[i] = back.sigma[i];
    nearer.left[i] = std::move(back.left[i]);
  }
  return nearer;
}

}  // namespace tofgraph::diagnosis
