// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/probes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// The change by one step of a parameter, and where the effect cannot do that by one to the other side.
Column change(const Problem& problem, const State& state, const Rows& rows, const Probe& probe, std::size_t parameter,
              double step) {
  std::vector<double> values = probe.values;
  Column column;
  double sign = 1;
  values[parameter] += step;
  try {
    column = expected(problem, probe.placed(state, values));
  } catch (const simulation::EffectError&) {
    sign = -1;
    values[parameter] -= 2 * step;
    column = expected(problem, probe.placed(state, values));
  }
  for (std::size_t i = 0; i < column.size(); ++i) {
    for (std::size_t row = 0; row < column[i].size(); ++row) column[i][row] = sign * (column[i][row] - rows[i][row]);
  }
  return column;
}

/// A probe and its group for each of the shapes at which a piece is scored. @param piece see Probe
void probe(const Problem& problem, const State& state, const Rows& rows, const Candidate& candidate,
           const ModelTerm& piece, NonlinearRange range, Probes& probes) {
  Probe one{&candidate, piece, {}, {}, {}};
  const std::vector<FreeParameter>& parameters = one.parameters();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k].nonlinear) continue;
    one.amplitudes.push_back(k);
    one.steps.push_back(parameters[k].step());
  }
  if (one.amplitudes.empty()) return;
  const std::string name =
      piece.refinement ? candidate.name() + "." + candidate.refinements()[*piece.refinement].name : candidate.name();
  bool first = true;
  for (std::vector<double>& values : probes_of(parameters, range)) {
    one.values = std::move(values);
    Group group{name, {}};
    try {
      for (std::size_t c = 0; c < one.amplitudes.size(); ++c)
        group.columns.push_back(change(problem, state, rows, one, one.amplitudes[c], one.steps[c]));
    } catch (const simulation::EffectError&) {
      if (std::exchange(first, false)) throw;  // at its usual shapes it has to give numbers
      continue;
    }
    first = false;
    probes.groups.push_back(std::move(group));
    probes.list.push_back(one);
  }
}

}  // namespace

State Probe::placed(State state, std::span<const double> chosen) const {
  if (!piece.refinement) {
    state.terms.push_back({candidate, {chosen.begin(), chosen.end()}});
    return state;
  }
  Term& term = state.terms[piece.term];
  term = refined(std::move(term), *piece.refinement, chosen);
  return state;
}

bool is_in(const State& state, const Candidate& candidate) {
  return std::ranges::any_of(state.terms, [&](const Term& t) { return t.candidate->name() == candidate.name(); });
}

Probes probes_of(const Problem& problem, const State& state, const std::vector<std::unique_ptr<Candidate>>& candidates,
                 NonlinearRange range) {
  Probes probes;
  const auto rows = expected(problem, state);
  for (const auto& candidate : candidates) {
    if (is_in(state, *candidate) || !candidate->maps().empty()) continue;  // maps are estimated otherwise
    const std::size_t before = probes.list.size();
    try {
      probe(problem, state, rows, *candidate, {state.terms.size(), std::nullopt}, range, probes);
    } catch (const simulation::EffectError& error) {
      probes.refused[candidate->name()] = error.what();
      probes.list.resize(before);
      probes.groups.resize(before);
    }
  }
  return probes;
}

Probes refinement_probes(const Problem& problem, const State& state) {
  Probes probes;
  const auto rows = expected(problem, state);
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    const Candidate& candidate = *state.terms[t].candidate;
    for (std::size_t r = 0; r < candidate.refinements().size(); ++r) {
      if (candidate.refined(r)) continue;
      const std::size_t before = probes.list.size();
      try {
        probe(problem, state, rows, candidate.with(r), {t, r}, NonlinearRange::any, probes);
      } catch (const simulation::EffectError&) {
        probes.list.resize(before);
        probes.groups.resize(before);
      }
    }
  }
  return probes;
}

}  // namespace tofgraph::diagnosis
