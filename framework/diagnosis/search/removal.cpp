// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/removal.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/scan.hpp"
#include "diagnosis/search/maps.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {

ModelFit fit_without(const Problem& problem, const ModelFit& best, const ModelTerm& addition) {
  std::vector<Column> columns = best.jacobian;
  const std::size_t count = values_of(best.state.terms[addition.term], addition).size();
  const auto at =
      columns.begin() + static_cast<std::ptrdiff_t>(first_parameter(best.state, addition.term, addition.refinement));
  columns.erase(at, at + static_cast<std::ptrdiff_t>(count));
  State state = removed(best.state, addition);
  update_reflectivity_jacobian(problem, state);
  ModelFit less = fit_reusing(problem, std::move(state), columns);
  if (has_maps(less.state)) less = fit_with_maps(problem, less.state);  // maps take over what they can
  less.jacobian = std::move(columns);
  return less;
}

namespace {

/// Change by a term, with the other effects unchanged.
std::optional<Column> change_of(const Problem& problem, const State& state, const Rows& rows,
                                const ModelTerm& addition) {
  if (state.terms[addition.term].maps) return std::nullopt;
  try {
    return difference(rows, expected(problem, removed(state, addition)));
  } catch (const simulation::EffectError&) {
    return std::nullopt;
  }
}

/// Indices of a model's columns that do not belong to an addition.
std::vector<Eigen::Index> others_of(const State& state, const ModelTerm& addition, std::size_t columns) {
  const std::size_t first = first_parameter(state, addition.term, addition.refinement),
                    last = first + values_of(state.terms[addition.term], addition).size();
  std::vector<Eigen::Index> others;
  for (std::size_t c = 0; c < columns; ++c) {
    if (c < first || c >= last) others.push_back(static_cast<Eigen::Index>(c));
  }
  return others;
}

}  // namespace

std::vector<double> min_deviance_rises(const Problem& problem, const ModelFit& best,
                                       std::span<const ModelTerm> additions) {
  const State& state = best.state;
  const auto rows = expected(problem, state);
  Group group{"additions", best.jacobian};
  std::vector<std::optional<Eigen::Index>> at;
  for (const ModelTerm& addition : additions) {
    std::optional<Column> change = change_of(problem, state, rows, addition);
    at.emplace_back();
    if (!change) continue;
    at.back() = static_cast<Eigen::Index>(group.columns.size());
    group.columns.push_back(*std::move(change));
  }
  std::vector<double> rises(additions.size(), 0);
  std::vector<Column> maps;
  try {
    maps = map_columns(problem, state);
  } catch (const simulation::EffectError&) {  // the other effects fail without a map
    return rises;
  }
  ModelFit alone = best;
  alone.jacobian.clear();
  const Eigen::MatrixXd information = score_of(problem, alone, group, {}, maps).information;
  const auto conditions = static_cast<double>(problem.data.size());
  for (std::size_t p = 0; p < additions.size(); ++p) {
    if (!at[p]) continue;
    const std::vector<Eigen::Index> others = others_of(state, additions[p], best.jacobian.size());
    Eigen::MatrixXd inner = information(others, others);
    inner.diagonal().array() += 1 / (settings.prior_width * settings.prior_width);
    const Eigen::VectorXd across = information(others, *at[p]);
    const double alone = information(*at[p], *at[p]) - across.dot(inner.ldlt().solve(across));
    // Where boards and light scatter more, each condition contributes the logarithm.
    rises[p] = conditions * std::log1p(std::max(alone, 0.0) / conditions);
  }
  return rises;
}

}  // namespace tofgraph::diagnosis
