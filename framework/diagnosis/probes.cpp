// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/probes.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

/// From where a size changes nothing, a typical step or as much of it as the bounds allow.
double whole_step(const FreeParameter& p) {
  const double up = std::min(p.off + std::abs(p.typical), p.maximum) - p.off,
               down = std::max(p.off - std::abs(p.typical), p.minimum) - p.off;
  return up >= -down ? up : down;
}

/// The change by one step of a parameter, and where the effect cannot do that by one to the other side.
Column change(const Problem& problem, State state, const std::vector<std::vector<double>>& rows, std::size_t parameter,
              double step) {
  double& value = state.terms.back().values[parameter];
  const double here = value;
  Column column;
  double sign = 1;
  value = here + step;
  try {
    column = expected(problem, state);
  } catch (const simulation::EffectError&) {
    sign = -1;
    value = here - step;
    column = expected(problem, state);
  }
  for (std::size_t i = 0; i < column.size(); ++i) {
    for (std::size_t row = 0; row < column[i].size(); ++row) column[i][row] = sign * (column[i][row] - rows[i][row]);
  }
  return column;
}

void probe(const Problem& problem, const State& state, const std::vector<std::vector<double>>& rows,
           const Candidate& candidate, Probes& probes) {
  for (std::vector<double>& values : candidate.probes()) {
    State with = state;
    with.terms.push_back({&candidate, values});
    Probe one{&candidate, std::move(values), {}, {}};
    Group group{candidate.name(), {}};
    for (std::size_t k = 0; k < candidate.free().size(); ++k) {
      const FreeParameter& p = candidate.free()[k];
      if (p.shape) continue;
      one.sizes.push_back(k);
      one.steps.push_back(whole_step(p));
      group.columns.push_back(change(problem, with, rows, k, one.steps.back()));
    }
    if (group.columns.empty()) continue;
    probes.groups.push_back(std::move(group));
    probes.list.push_back(std::move(one));
  }
}

}  // namespace

bool is_in(const State& state, const Candidate& candidate) {
  return std::ranges::any_of(state.terms, [&](const Term& t) { return t.candidate->name() == candidate.name(); });
}

Probes probes_of(const Problem& problem, const State& state,
                 const std::vector<std::unique_ptr<Candidate>>& candidates) {
  Probes probes;
  const auto rows = expected(problem, state);
  for (const auto& candidate : candidates) {
    if (is_in(state, *candidate) || !candidate->maps().empty()) continue;  // maps are estimated otherwise
    const std::size_t before = probes.list.size();
    try {
      probe(problem, state, rows, *candidate, probes);
    } catch (const simulation::EffectError& error) {
      probes.refused[candidate->name()] = error.what();
      probes.list.resize(before);
      probes.groups.resize(before);
    }
  }
  return probes;
}

}  // namespace tofgraph::diagnosis
