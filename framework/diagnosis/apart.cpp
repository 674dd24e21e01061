// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/apart.hpp"

#include "diagnosis/candidate.hpp"
#include "diagnosis/structure.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

/// Typical values: how far a shape is from what was fitted, at most. What is farther is not linear in it.
constexpr double usual_shape = 1;

/// Whether a change is as large as least_change, root mean square of some observable.
bool matters(const Problem& problem, std::size_t i, const std::vector<double>& change) {
  const std::size_t n = problem.design.superpixels();
  for (std::size_t o = 0; o < observables; ++o) {
    double square = 0, count = 0;
    for (std::size_t row = o * n; row < (o + 1) * n; ++row) {
      if (std::isinf(problem.data[i].variance[row])) continue;
      square += change[row] * change[row];
      ++count;
    }
    if (count > 0 && std::sqrt(square / count) >= least_change[o]) return true;
  }
  return false;
}

/// What a change of a target's ln reflectivity changes: one column a target.
void append_light(const Problem& problem, std::vector<Column>& columns) {
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    Column& column = columns.emplace_back(problem.design.size(), std::vector<double>(problem.design.rows(), 0));
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (problem.target[i] != static_cast<int>(t)) continue;
      for (std::size_t row = 0; row < column[i].size(); ++row) column[i][row] = problem.light_response(i, row);
    }
  }
}

/// What a change of a model's values and of the targets' light changes.
std::vector<Column> columns_of(const Problem& lit, const State& model, const Column& rows) {
  std::vector<Column> columns = own_columns(lit, model, rows);
  append_light(lit, columns);
  return columns;
}

/// How far the data of one model are from another, whose values may change as far as the campaign leaves them open.
/// @param data that the one expects, and @param rows the other @param values_of_other its values' columns
/// @param told of these; empty: they stay as they are
Apart between(const Problem& lit, const Column& data, const Variances& sd, const Column& rows,
              const std::vector<Column>& values_of_other, const Eigen::MatrixXd& told) {
  std::vector<Column> columns = {difference(data, rows)};
  if (told.size() > 0) std::ranges::copy(values_of_other, std::back_inserter(columns));
  const std::vector<Gram> grams = grams_of(lit, rows, columns);
  const Eigen::Index values = told.rows();
  Apart apart{{}, columns.front()};
  for (std::size_t i = 0; i < grams.size(); ++i) {
    double determinant = 0;
    const Gram gram = marginal(grams[i], sd, determinant);
    double square = gram(0, 0);
    if (values > 0) {
      const Eigen::VectorXd cross = gram.block(1, 0, values, 1);
      const Eigen::VectorXd moved = Eigen::MatrixXd(told + gram.block(1, 1, values, values)).ldlt().solve(cross);
      square -= cross.dot(moved);
      for (Eigen::Index k = 0; k < values; ++k) {
        const std::vector<double>& column = columns[1 + static_cast<std::size_t>(k)][i];
        for (std::size_t row = 0; row < column.size(); ++row) apart.left[i][row] -= moved(k) * column[row];
      }
    }
    square = std::max(square, 0.0);
    std::vector<double> rest = apart.left[i];
    const auto taken = take_out_jitter(lit, i, rest);
    if (!matters(lit, i, rest))  // only as much as the board, the camera's offset and the light differ by
      square = std::min(square, std::pow(taken(0) + taken(1), 2) / (sd.jitter * sd.jitter + sd.offset * sd.offset) +
                                    std::pow(taken(2) / sd.light, 2));
    apart.sigma.push_back(std::sqrt(square));
  }
  return apart;
}

}  // namespace

Eigen::MatrixXd told_of_values(const Problem& problem, const State& state) {
  std::vector<bool> shape;
  for (const Term& term : state.terms) {
    for (const FreeParameter& p : term.candidate->free()) shape.push_back(p.shape);
  }
  const auto count = static_cast<Eigen::Index>(shape.size() + problem.targets.size());
  if (count == 0) return {};
  try {
    const auto rows = expected(problem, state);
    const std::vector<Column> columns = own_columns(problem, state, rows);
    const Solution solution = least_squares(problem, rows, columns, problem.unknowns(columns.size()), state.variances);
    Eigen::MatrixXd told = solution.covariance.topLeftCorner(count, count).inverse();
    for (std::size_t k = 0; k < shape.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      if (shape[k]) told(at, at) += 1 / (usual_shape * usual_shape);
    }
    return told;
  } catch (const simulation::EffectError&) {
    return {};
  }
}

InLightOfOne in_light_of_one(const Problem& problem, const Question& question) {
  InLightOfOne lit{problem, {}, {}};
  lit.problem.correction.clear();
  brighten(lit.problem, question.one);
  lit.rows = expected(lit.problem, question.one);
  if (question.told_of_one.size() > 0) lit.columns = columns_of(lit.problem, question.one, lit.rows);
  return lit;
}

bool begin_alike(const Question& first, const Question& second) {
  const auto same_term = [](const Term& one, const Term& other) {
    return one.candidate == other.candidate && one.values == other.values && one.maps == other.maps;
  };
  return std::ranges::equal(first.one.terms, second.one.terms, same_term) && first.one.light == second.one.light &&
         (first.told_of_one.size() > 0) == (second.told_of_one.size() > 0);
}

Apart apart(const InLightOfOne& lit, const Question& question) {
  const auto other = expected(lit.problem, question.other);
  std::vector<Column> columns;
  if (question.told_of_other.size() > 0) columns = columns_of(lit.problem, question.other, other);
  Apart nearer = between(lit.problem, lit.rows, question.other.variances, other, columns, question.told_of_other);
  Apart back = between(lit.problem, other, question.one.variances, lit.rows, lit.columns, question.told_of_one);
  for (std::size_t i = 0; i < nearer.sigma.size(); ++i) {
    if (!(back.sigma[i] < nearer.sigma[i])) continue;
    nearer.sigma[i] = back.sigma[i];
    nearer.left[i] = std::move(back.left[i]);
  }
  return nearer;
}

}  // namespace tofgraph::diagnosis
