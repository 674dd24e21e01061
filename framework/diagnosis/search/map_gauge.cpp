// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/map_gauge.hpp"

#include "diagnosis/search/maps.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// A parameter that adds the same to all distances, and how much for one of its unit.
struct Constant {
  std::size_t term = 0, parameter = 0;
  double response = 0;
};

/// The height of a column that is the same in all known distances and changes nothing else; 0: it is no such column.
double height_of(const Problem& problem, const Column& column) {
  constexpr double same = 1e-6;
  double first = 0;
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (!problem.design.shows_board(i)) continue;
    for (std::size_t row = 0; row < column[i].size(); ++row) {
      if (std::isinf(problem.data[i].variance[row])) continue;
      const bool length = problem.is_of(distance, row);
      if (length && first == 0) first = column[i][row];
      const double expected = length ? first : 0;
      if (!(std::abs(column[i][row] - expected) <= same * std::max(std::abs(first), 1e-6))) return 0;
    }
  }
  return first;
}

std::optional<Constant> constant_of(const Problem& problem, const State& state) {
  const auto rows = expected(problem, state);
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    const Term& term = state.terms[t];
    for (std::size_t k = 0; !term.maps && k < term.values.size(); ++k) {
      const FreeParameter& p = term.candidate->free()[k];
      if (p.nonlinear) continue;
      const double height = height_of(problem, derivative(problem, state, rows, t, k));
      if (height != 0) return Constant{t, k, height / p.typical};
    }
  }
  return std::nullopt;
}

}  // namespace

State with_means_in_constant(const Problem& problem, State state) {
  if (!has_maps(state)) return state;
  const std::optional<Constant> constant = constant_of(problem, state);
  if (!constant) return state;
  const auto grid = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(problem.design.superpixels()))));
  for (Term& term : state.terms) {
    if (!term.maps) continue;
    std::vector<EstimatedMaps::Map> maps = term.maps->maps();
    for (EstimatedMaps::Map& map : maps) {
      if (map.parameter.unit != "m") continue;
      const double mean = std::reduce(map.values.begin(), map.values.end()) / static_cast<double>(map.values.size());
      for (double& value : map.values) value -= mean;
      state.terms[constant->term].values[constant->parameter] += term.values.front() * mean / constant->response;
    }
    term.maps =
        std::make_shared<const EstimatedMaps>(std::move(maps), term.maps->dimension(), grid, problem.design.camera());
  }
  return state;
}

}  // namespace tofgraph::diagnosis
