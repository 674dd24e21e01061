// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/contribution.hpp"

#include "diagnosis/structure.hpp"

#include <cmath>

namespace tofgraph::diagnosis {

bool hardly_differ(const Problem& problem, const State& one, const State& other, double limit) {
  const Variances& sd = one.variances;
  Column apart = difference(expected(problem, other), expected(problem, one));
  double square = 0;
  for (std::size_t i = 0; i < apart.size(); ++i) {
    const auto taken = take_out_jitter(problem, i, apart[i]);
    square += std::pow(taken(0) + taken(1), 2) / (sd.jitter * sd.jitter + sd.offset * sd.offset) +
              std::pow(taken(2) / sd.light, 2);
  }
  return square < limit && importance(problem, apart) < 1;
}

std::vector<Column> signature(const Problem& problem, const State& without, const State& with, const Piece& piece) {
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
