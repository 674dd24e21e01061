// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/least_rise.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/scan.hpp"
#include "diagnosis/search/maps.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace tofgraph::diagnosis {
namespace {

/// Change by a term, with the other effects as they are.
std::optional<Column> change_of(const Problem& problem, const State& state, const Rows& rows, const ModelTerm& piece) {
  if (state.terms[piece.term].maps) return std::nullopt;
  State less = state;
  const auto term = less.terms.begin() + static_cast<std::ptrdiff_t>(piece.term);
  if (piece.refinement)
    *term = coarser(std::move(*term), *piece.refinement);
  else
    less.terms.erase(term);
  try {
    return difference(rows, expected(problem, less));
  } catch (const simulation::EffectError&) {
    return std::nullopt;
  }
}

/// Columns of a model that are not those of a piece.
std::vector<Eigen::Index> others_of(const State& state, const ModelTerm& piece, std::size_t columns) {
  const Term& term = state.terms[piece.term];
  const std::size_t first = first_parameter(state, piece.term) +
                            (piece.refinement ? term.candidate->place(*piece.refinement) : 0),
                    last = first + values_of(term, piece).size();
  std::vector<Eigen::Index> others;
  for (std::size_t c = 0; c < columns; ++c) {
    if (c < first || c >= last) others.push_back(static_cast<Eigen::Index>(c));
  }
  return others;
}

}  // namespace

std::vector<double> min_deviance_rises(const Problem& problem, const ModelFit& best,
                                       std::span<const ModelTerm> pieces) {
  const State& state = best.state;
  const auto rows = expected(problem, state);
  Group group{"pieces", best.jacobian};
  std::vector<std::optional<Eigen::Index>> at;
  for (const ModelTerm& piece : pieces) {
    std::optional<Column> change = change_of(problem, state, rows, piece);
    at.emplace_back();
    if (!change) continue;
    at.back() = static_cast<Eigen::Index>(group.columns.size());
    group.columns.push_back(*std::move(change));
  }
  std::vector<double> rises(pieces.size(), 0);
  std::vector<Column> maps;
  try {
    maps = map_columns(problem, state);
  } catch (const simulation::EffectError&) {  // without a map the others give no number
    return rises;
  }
  ModelFit alone = best;
  alone.jacobian.clear();
  const Eigen::MatrixXd information = score_of(problem, alone, group, 0, 0, maps).information;
  const auto conditions = static_cast<double>(problem.data.size());
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    if (!at[p]) continue;
    const std::vector<Eigen::Index> others = others_of(state, pieces[p], best.jacobian.size());
    Eigen::MatrixXd inner = information(others, others);
    inner.diagonal().array() += 1 / (settings.prior_width * settings.prior_width);
    const Eigen::VectorXd across = information(others, *at[p]);
    const double alone = information(*at[p], *at[p]) - across.dot(inner.ldlt().solve(across));
    // Where boards and light scatter more, each condition pays the logarithm.
    rises[p] = conditions * std::log1p(std::max(alone, 0.0) / conditions);
  }
  return rises;
}

}  // namespace tofgraph::diagnosis
