// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/given_model.hpp"

#include "config/quantity.hpp"
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/intervals.hpp"
#include "diagnosis/model/scan.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/maps.hpp"
#include "diagnosis/search/trials.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Names of the effects that a model has in addition to the given ones, sorted.
std::vector<std::string> added_names(const State& model, std::size_t given) {
  std::vector<std::string> names;
  for (std::size_t t = given; t < model.terms.size(); ++t) names.push_back(model.terms[t].candidate->name());
  std::ranges::sort(names);
  return names;
}

bool chose_these(const FoldResult& fold, const std::vector<std::string>& names) {
  std::vector<std::string> chosen = fold.chosen;
  std::ranges::sort(chosen);
  return fold.failed.empty() && chosen == names;
}

/// A model as a start for some conditions: reflectivities of their targets, and variances.
State start_on(const Problem& part, const Problem& whole, State model) {
  model.log_reflectivity = log_reflectivity_from(whole, model, part, first_log_reflectivity(part));
  return model;
}

/// Nuisances of some of the conditions.
ConditionNuisances condition_nuisances_of(const ConditionNuisances& whole, const std::vector<std::size_t>& chosen,
                                          const std::vector<Observations>& data) {
  ConditionNuisances some;
  for (const std::size_t i : chosen) {
    if (!whole.jitter_scale.empty()) some.jitter_scale.push_back(whole.jitter_scale[i]);
  }
  some.smooth_field = with_data(whole.smooth_field, data);
  if (whole.boards) {
    Boards boards{whole.boards->sd, {}, whole.boards->cost};
    for (const std::size_t i : chosen) boards.rows.push_back(whole.boards->rows[i]);
    some.boards = std::make_shared<const Boards>(std::move(boards));
  }
  return some;
}

/// Predictions of a fold's conditions by the effects of a model fitted to the other conditions.
std::vector<OutOfFold> refitted_without(const Fold& fold, const Problem& problem, const std::vector<Term>& given,
                                        const State& model) {
  const std::vector<std::size_t> left = left_by(fold, problem.data.size());
  const FoldProblem training(problem.design, problem.data, left, problem.deadline);
  const FoldProblem held(problem.design, problem.data, fold.held, training.problem);
  Prediction prediction(held, fold);
  State as_given = first_state(training.problem, given);
  as_given.random_sd = first_state(problem, given).random_sd;  // with a camera offset if any condition shows it
  prediction.before(fit_as_written(training.problem, std::move(as_given)).state);
  State start = start_on(training.problem, problem, model);
  start.nuisances = condition_nuisances_of(model.nuisances, left, training.data);
  update_precomputed(training.problem, start);
  prediction.after(fit_with_maps(training.problem, start).state);
  return prediction.result();
}

/// The same, empty if the model fails without the fold's conditions, as for a fold that was searched.
std::vector<OutOfFold> predicted_or_nothing(const Fold& fold, const Problem& problem, const std::vector<Term>& given,
                                            const State& model) {
  try {
    return refitted_without(fold, problem, given, model);
  } catch (const simulation::EffectError&) {
    return {};
  }
}

GapComparison on_all_data(const Problem& problem, const std::vector<Term>& given, const State& model) {
  const State before = fit_as_written(problem, first_state(problem, given)).state;
  return {gap(problem, before, distance), gap(problem, with_flat_boards(model), distance)};
}

/// Half width of an interval over the largest allowed one; infinite if the data do not determine the parameter.
double relative_width(const FreeParameter& p, const Interval& interval, double variance) {
  if (parameter_status(p, interval, variance) == ParameterStatus::not_determined)
    return std::numeric_limits<double>::infinity();
  if (p.is_angle()) return 0;
  const double half = (interval.high - interval.low) / 2;
  return half / (std::abs(p.typical) * (p.nonlinear ? settings.max_given_width_nonlinear : settings.max_given_width));
}

/// Standard deviations of the first parameters of a model, in typical values, with further columns fitted as well.
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

/// Fit at the grid bias of the state. The result keeps the earlier precomputed parts, for comparisons.
ModelFit fitted(const Problem& problem, State state) {
  const Precomputed before = state.precomputed;
  update_precomputed(problem, state);
  ModelFit fit = fit_with_maps(problem, std::move(state));
  fit.state.precomputed = before;
  return fit;
}

}  // namespace

GapComparison on_held_out_data(const std::vector<Fold>& folds, const CrossFit& known, const Problem& problem,
                               const std::vector<Term>& given, const State& model) {
  const std::vector<std::string> names = added_names(model, given.size());
  std::vector<std::vector<OutOfFold>> all(folds.size());
  tbb::parallel_for(std::size_t{0}, folds.size(), [&](std::size_t f) {
    tbb::this_task_arena::isolate([&] {
      if (f < known.folds.size() && chose_these(known.folds[f], names))
        all[f] = known.folds[f].conditions;
      else
        all[f] = predicted_or_nothing(folds[f], problem, given, model);
    });
  });
  GapSums sums;
  for (const std::vector<OutOfFold>& fold : all) sums.add(fold);
  return {sums.gap().before, sums.gap().after};
}

std::string Verification::why_worse() const {
  const auto text = [](const char* where, const GapComparison& gaps) {
    return fmt::format("with it the distance gap grows {}, from {:.2f} mm of the given model to {:.2f} mm", where,
                       1e3 * gaps.given, 1e3 * gaps.model);
  };
  if (all.is_worse()) return text("on all data", all);
  return held_out.is_worse() ? text("on held-out conditions", held_out) : "";
}

Verification compared_with_given(const CrossFit& known, const Problem& problem, const std::vector<Term>& given,
                                 const State& model) {
  Verification result{on_all_data(problem, given, model), {NAN, NAN}};
  if (!result.all.is_worse())
    result.held_out = on_held_out_data(folds_of(problem.design), known, problem, given, model);
  return result;
}

GivenModel::GivenModel(const std::vector<simulation::ModelEffect>& effects, std::uint64_t seed)
    : effects_(effects), seed_(seed) {
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

bool GivenModel::hold_beside_simpler(const Problem& problem, const State& state, const Candidates& candidates) {
  const auto rows = expected(problem, state);
  const std::vector<Column> own = jacobian(problem, state, rows);
  if (own.empty()) return false;
  const std::vector<double> alone = deviations_beside(problem, rows, state, own, {});
  const Probes probes = probes_of(problem, state, candidates, NonlinearRange::usual);
  for (std::size_t p = 0; p < probes.list.size(); ++p) {
    const Candidate& simpler = *probes.list[p].candidate;
    const std::vector<double> with_simpler = deviations_beside(problem, rows, state, own, probes.groups[p].columns);
    std::size_t j = 0;
    for (std::size_t t = 0; t < terms_.size(); ++t) {
      const std::vector<FreeParameter> free = terms_[t].candidate->free();
      for (std::size_t k = 0; k < free.size(); ++k, ++j) {
        const bool blurred =
            with_simpler[j] > settings.max_given_sd_beside && alone[j] < settings.max_given_sd_alone * with_simpler[j];
        if (free[k].nonlinear || !blurred || simpler.free().size() >= free.size()) continue;
        hold(t, free[k],
             fmt::format("beside {}, which is simpler, these conditions do not determine it", simpler.name()));
        return true;
      }
    }
  }
  return false;
}

void GivenModel::hold_undetermined(const Problem& problem, const Candidates& candidates) {
  if (terms_.empty()) return;
  State first = first_state(problem, terms_);
  update_precomputed(problem, first);
  const auto start = [&] { return comparable_with(first, first_state(problem, terms_)); };
  while (hold_beside_simpler(problem, fit_nuisances(problem, start()).state, candidates)) {
  }
  hold_undetermined_in(problem, fit(problem, start()));
}

std::optional<ModelFit> GivenModel::hold_undetermined_in(const Problem& problem, ModelFit fit) {
  auto before = std::pair(terms_, held_);
  try {
    return hold_one_after_the_other(problem, std::move(fit));
  } catch (...) {  // the search goes on with the model as it was
    std::tie(terms_, held_) = std::move(before);
    throw;
  }
}

std::optional<ModelFit> GivenModel::hold_one_after_the_other(const Problem& problem, ModelFit fit) {
  bool held = false;
  for (;;) {
    const double rest = lack_of_fit(problem, with_jacobian(problem, fit));
    const std::vector<Interval> all = intervals(problem, fit, seed_, rest, Refinements::as_they_are);
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
