// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/held_values.hpp"

#include "config/quantity.hpp"
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/parameter_status.hpp"
#include "diagnosis/model/scan.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/maps.hpp"
#include "diagnosis/search/probes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Half width of an interval over what may be; infinite where the data say nothing.
double relative_width(const FreeParameter& p, const Interval& interval, double variance) {
  if (parameter_status(p, interval, variance) == ParameterStatus::not_determined)
    return std::numeric_limits<double>::infinity();
  if (p.is_angle()) return 0;
  const double half = (interval.high - interval.low) / 2;
  return half / (std::abs(p.typical) * (p.nonlinear ? settings.max_given_width_nonlinear : settings.max_given_width));
}

/// Standard deviations of the first parameters of a model, in typical values, with further columns fitted beside them.
std::vector<double> deviations_beside(const Problem& problem, const Rows& rows, const State& state,
                                      std::vector<Column> columns, const std::vector<Column>& further) {
  const std::size_t own = columns.size();
  columns.insert(columns.end(), further.begin(), further.end());
  const Solution there = solve_linear(problem, state, rows, columns, problem.unknowns(columns.size()));
  std::vector<double> result;
  for (std::size_t j = 0; j < own; ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    result.push_back(std::sqrt(there.covariance(at, at)));
  }
  return result;
}

/// Fits at the grid bias of the state. The result keeps what it was linearised about before, for comparisons.
ModelFit fitted(const Problem& problem, State state) {
  const Linearisation before = state.linearisation;
  update_grid_bias(problem, state);
  const std::vector<double> all(problem.data.size(), 1);
  ModelFit fit = fit_with_maps(problem, std::move(state), all);
  fit.state.linearisation = before;
  return fit;
}

}  // namespace

GivenModel::GivenModel(const std::vector<simulation::ModelEffect>& effects) : effects_(effects) {
  for (const simulation::ModelEffect& effect : effects_) {
    candidates_.push_back(std::make_unique<Candidate>(effect));
    terms_.push_back({candidates_.back().get(), candidates_.back()->start()});
  }
}

void GivenModel::hold(std::size_t term, const FreeParameter& parameter, const std::string& why) {
  std::vector<std::size_t> held = terms_[term].candidate->held();
  held.push_back(parameter.index);
  candidates_.push_back(std::make_unique<Candidate>(effects_[term], std::move(held)));
  const Candidate& now = *candidates_.back();
  held_.push_back({fmt::format("{} {} stays at {}", now.name(), parameter.name,
                               config::format_quantity(now.written(parameter.index), parameter.unit)),
                   why});
  terms_[term] = {&now, now.start()};
}

bool GivenModel::hold_beside_simpler(const Problem& problem, const State& state,
                                     const std::vector<std::unique_ptr<Candidate>>& candidates) {
  const auto rows = expected(problem, state);
  const std::vector<Column> own = jacobian(problem, state, rows);
  if (own.empty()) return false;
  const std::vector<double> alone = deviations_beside(problem, rows, state, own, {});
  const Probes probes = probes_of(problem, state, candidates, NonlinearRange::usual);
  for (std::size_t p = 0; p < probes.list.size(); ++p) {
    const Candidate& simpler = *probes.list[p].candidate;
    const std::vector<double> beside = deviations_beside(problem, rows, state, own, probes.groups[p].columns);
    std::size_t j = 0;
    for (std::size_t t = 0; t < terms_.size(); ++t) {
      const std::vector<FreeParameter> free = terms_[t].candidate->free();
      for (std::size_t k = 0; k < free.size(); ++k, ++j) {
        const bool blurred =
            beside[j] > settings.max_given_sd_beside && alone[j] < settings.max_given_sd_alone * beside[j];
        if (free[k].nonlinear || !blurred || simpler.free().size() >= free.size()) continue;
        hold(t, free[k],
             fmt::format("beside {}, which is simpler, these conditions do not determine it", simpler.name()));
        return true;
      }
    }
  }
  return false;
}

void GivenModel::hold_undetermined(const Problem& problem, const std::vector<std::unique_ptr<Candidate>>& candidates) {
  if (terms_.empty()) return;
  State first = first_state(problem, terms_);
  update_grid_bias(problem, first);
  const auto start = [&] { return beside(first, first_state(problem, terms_)); };
  const std::vector<double> all(problem.data.size(), 1);
  while (hold_beside_simpler(problem, fit_nuisances(problem, start(), all).state, candidates)) {
  }
  hold_undetermined_in(problem, fit(problem, start(), all));
}

std::optional<ModelFit> GivenModel::hold_undetermined_in(const Problem& problem, ModelFit fit) {
  bool held = false;
  for (;;) {
    const double rest = lack_of_fit(problem, linearised(problem, fit));
    const std::vector<Interval> all = intervals(problem, fit, 1, rest, Refinements::as_they_are);
    double most = 1;
    std::optional<std::pair<std::size_t, std::size_t>> loosest;
    for (std::size_t t = 0; t < terms_.size(); ++t) {
      const Candidate& given = *terms_[t].candidate;
      const std::size_t first = first_parameter(fit.state, t);
      for (std::size_t k = 0; k < given.free().size(); ++k) {
        const FreeParameter& p = given.free()[k];
        const auto j = static_cast<Eigen::Index>(first + k);
        const Interval& interval = all[first + k];
        const double value = given.written(p.index), loose = relative_width(p, interval, fit.covariance(j, j));
        if (loose > most && interval.low <= value && value <= interval.high) most = loose, loosest = {t, k};
      }
    }
    if (!loosest) break;
    const auto [t, k] = *loosest;
    const Term before = fit.state.terms[t];
    hold(t, terms_[t].candidate->free()[k], "these conditions do not determine it");
    Term& now = fit.state.terms[t];
    now = {terms_[t].candidate, before.values, before.maps};
    if (terms_[t].candidate->free().empty())
      now.values.clear();
    else
      now.values.erase(now.values.begin() + static_cast<std::ptrdiff_t>(k));
    for (std::size_t r = 0; r < now.candidate->refinements().size(); ++r) {
      if (before.candidate->refined(r)) now.candidate = &now.candidate->with(r);
    }
    fit = fitted(problem, std::move(fit.state));
    held = true;
  }
  return held ? std::optional(std::move(fit)) : std::nullopt;
}

std::vector<std::string> GivenModel::notes() const {
  std::vector<std::string> notes;
  for (const Held& one : held_) notes.push_back(fmt::format("{}: {}.", one.parameter, one.why));
  return notes;
}

}  // namespace tofgraph::diagnosis
