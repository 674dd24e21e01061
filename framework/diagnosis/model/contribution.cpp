// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/contribution.hpp"

#include "diagnosis/model/residual_structure.hpp"

#include <cmath>

namespace tofgraph::diagnosis {

bool practically_equivalent(const Problem& problem, const State& one, const State& other, double limit) {
  const RandomEffectSd& sd = one.random_sd;
  Column change = difference(expected(problem, other), expected(problem, one));
  double square = 0;
  for (std::size_t i = 0; i < change.size(); ++i) {
    const auto taken = project_out_nuisances(problem, other, i, change[i]);
    square += std::pow(taken(0) + taken(1), 2) / (sd.jitter * sd.jitter + sd.offset * sd.offset) +
              std::pow(taken(2) / sd.light, 2);
  }
  return square < limit && max_normalised_rms(problem, change) < 1;
}

std::vector<Column> signature(const Problem& problem, const State& without, const State& with, const ModelTerm& piece) {
  State state = without;
  const Term& term = with.terms[piece.term];
  const std::span<const double> values = values_of(term, piece);
  std::size_t at = state.terms.size(), first = 0;
  if (piece.refinement) {
    at = piece.term;
    state.terms[at] = refined(state.terms[at], *piece.refinement, values);
    first = state.terms[at].candidate->place(*piece.refinement);
  } else {
    state.terms.push_back(term);
  }
  const auto rows = expected(problem, state);
  std::vector<Column> columns = {difference(rows, expected(problem, without))};
  for (std::size_t k = first; k < first + values.size(); ++k)
    columns.push_back(derivative(problem, state, rows, at, k));
  return columns;
}

}  // namespace tofgraph::diagnosis
