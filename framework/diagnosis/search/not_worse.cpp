// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/not_worse.hpp"

#include "diagnosis/search/maps.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// The given model: its parameters are held, reflectivities and variances fitted.
State given_state(const Problem& problem, const std::vector<Term>& given, const RandomEffectSd& start) {
  State state{given, first_log_reflectivity(problem), start};
  if (!given.empty()) update_grid_bias(problem, state);
  const std::vector<double> all(problem.data.size(), 1);
  return fit_nuisances(problem, state, all).state;
}

RandomEffectSd first_random_sd(const Design& design) {
  RandomEffectSd random_sd;
  if (!design.tells_offset()) random_sd.offset = 0;
  return random_sd;
}

/// The effects that a model has beyond the given ones.
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

/// A model as a start on some conditions: reflectivities of their targets, variances.
State start_on(const Problem& part, const Problem& whole, State model) {
  std::vector<double> light = first_log_reflectivity(part);
  for (std::size_t t = 0; t < part.targets.size(); ++t) {
    const auto known = std::ranges::find(whole.targets, part.targets[t]);
    const auto at = static_cast<std::size_t>(known - whole.targets.begin());
    if (at < model.log_reflectivity.size()) light[t] = model.log_reflectivity[at];
  }
  model.log_reflectivity = std::move(light);
  return model;
}

/// Nuisances of some of the conditions.
ConditionNuisances condition_nuisances_of(const ConditionNuisances& whole, const std::vector<std::size_t>& chosen,
                                          const std::vector<Observations>& data) {
  ConditionNuisances some;
  for (const std::size_t i : chosen) {
    if (!whole.jitter_scale.empty()) some.jitter_scale.push_back(whole.jitter_scale[i]);
  }
  if (whole.smooth_field)
    some.smooth_field = std::make_shared<const SmoothField>(SmoothField(data), whole.smooth_field->sd());
  if (whole.boards) {
    Boards boards{whole.boards->sd, {}, whole.boards->cost};
    for (const std::size_t i : chosen) boards.rows.push_back(whole.boards->rows[i]);
    some.boards = std::make_shared<const Boards>(std::move(boards));
  }
  return some;
}

/// The conditions of a fold, predicted by the effects of a model that are fitted to the others.
std::vector<OutOfFold> predicted(const Fold& fold, const Problem& problem, const std::vector<Term>& given,
                                 const State& model) {
  const std::vector<std::size_t> left = left_by(fold, problem.data.size());
  const FoldProblem training(problem.design, problem.data, left, problem.deadline);
  const FoldProblem held(problem.design, problem.data, fold.held, training);
  Prediction prediction(held, fold);
  prediction.before(given_state(training.problem, given, first_random_sd(problem.design)));
  State start = start_on(training.problem, problem, model);
  start.nuisances = condition_nuisances_of(model.nuisances, left, training.data);
  update_grid_bias(training.problem, start);
  const std::vector<double> all(left.size(), 1);
  prediction.after(fit_with_maps(training.problem, start, all).state);
  return prediction.result();
}

/// Nothing where the model gives no number without the conditions of the fold, as in a fold that was searched.
std::vector<OutOfFold> predicted_or_nothing(const Fold& fold, const Problem& problem, const std::vector<Term>& given,
                                            const State& model) {
  try {
    return predicted(fold, problem, given, model);
  } catch (const simulation::EffectError&) {
    return {};
  }
}

struct Squares {
  double given = 0, model = 0, count = 0;

  void add(const std::vector<OutOfFold>& conditions) {
    for (const OutOfFold& c : conditions)
      given += c.before[distance], model += c.after[distance], count += c.count[distance];
  }
  GapComparison gaps() const { return {std::sqrt(given / count), std::sqrt(model / count)}; }
};

}  // namespace

GapComparison on_all_data(const Problem& problem, const std::vector<Term>& given, const State& model) {
  const Problem original = make_problem(problem.design, problem.data, problem.deadline);
  const State before = given_state(original, given, first_random_sd(problem.design));
  return {gap(original, before, distance), gap(problem, with_flat_boards(model), distance)};
}

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
  Squares sum;
  for (const std::vector<OutOfFold>& fold : all) sum.add(fold);
  return sum.gaps();
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

}  // namespace tofgraph::diagnosis
