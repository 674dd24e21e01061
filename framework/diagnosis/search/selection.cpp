// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/selection.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/scan.hpp"
#include "diagnosis/search/maps.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
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

Selection::Selection(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
                     const SearchOptions& options, std::map<std::string, std::string> refused)
    : deadline_(problem.deadline != nullptr ? *problem.deadline : Deadline()),
      task_{with_deadline(problem, deadline_), model, candidates, options, std::move(refused)} {}

void Selection::begin() {
  task_.report_progress("fitting the model as it is");
  State start = first_state(problem(), task_.given_terms);
  if (!task_.given_terms.empty()) update_precomputed(problem(), start);
  accept(fit(problem(), start));
  selected_.refitted_given = best();
  reached_ = selected_;
  deadline_ = task_.options.deadline;
}

void Selection::accept(ModelFit fit) {
  without_.clear();
  selected_.best = std::move(fit);
  selected_.about_drift_mean.reset();
  update_drift_mean();
  selected_.best = with_jacobian(problem(), std::move(selected_.best));
}

/// Refits the best and the given model if the drift of the best one has another mean.
void Selection::update_drift_mean() {
  State state = with_drift_mean(problem(), best().state);
  const double mean = state.random_sd.mean;
  if (std::abs(std::log(mean / best().state.random_sd.mean)) < settings.jitter_scale_change) return;
  if (mean < best().state.random_sd.mean && task_.added(best()) > 0)
    selected_.about_drift_mean = fit_nuisances(problem(), state);
  selected_.best = fit_with_maps(problem(), std::move(state));
  if (selected_.refitted_given.state.log_reflectivity.empty()) return;  // not fitted yet
  State given = selected_.refitted_given.state;
  given.random_sd.mean = mean;
  refit_given(std::move(given));
}

/// Refits the given model with other nuisances. Its values hardly move, so it keeps its jacobian.
void Selection::refit_given(State start) {
  ModelFit given = fit_with_maps(problem(), std::move(start));
  given.jacobian = std::move(selected_.refitted_given.jacobian);
  selected_.refitted_given = std::move(given);
}

void Selection::select(SelectedModel model) {
  without_.clear();
  selected_ = std::move(model);
}

void Selection::return_to_given() {
  State given = best().state;
  given.terms = task_.given_terms;
  ModelFit fit = fit_as_written(problem(), std::move(given));
  const auto rows = expected(problem(), fit.state);
  const std::vector<Column> columns = jacobian(problem(), fit.state, rows);
  const Solution there = solve_linear(problem(), fit.state, rows, columns, problem().unknowns(columns.size()));
  fit.covariance = there.covariance;
  fit.dimension = there.dimension;
  // Not by accept(), which may refit: the given values must not change.
  select({selected_.refitted_given, with_jacobian(problem(), std::move(fit)), selected_.barred});
}

void Selection::refit() {
  if (terms().empty()) return;
  task_.report_progress("settling on values");
  State exact = best().state;
  update_precomputed(problem(), exact, true);
  const State positive = with_positive_amplitudes(problem(), std::move(exact));
  accept(fit_with_maps(problem(), with_means_in_constant(problem(), positive)));
}

ModelFit Selection::fit_at_every_pixel(State state) const {
  state.nuisances = best().state.nuisances;
  update_precomputed(problem(), state, true);
  return fit_with_maps(problem(), with_positive_amplitudes(problem(), std::move(state)));
}

Selection::Comparison Selection::take_if_better(State other) {
  other.log_reflectivity = best().state.log_reflectivity;
  Comparison comparison;
  try {
    ModelFit fit = fit_at_every_pixel(std::move(other));
    comparison.bic_fall = bic(best()) - bic(fit);
    comparison.accepted = comparison.bic_fall > settings.min_bic_gain && try_accept(std::move(fit.state));
  } catch (const simulation::EffectError&) {
  }
  if (comparison.accepted) backward_eliminate();
  return comparison;
}

std::vector<ModelTerm> Selection::additions() const {
  std::vector<ModelTerm> all;
  for (std::size_t t = 0; t < terms().size(); ++t) {
    if (t >= task_.given_terms.size()) all.push_back({t, std::nullopt});
    for (std::size_t r = 0; r < terms()[t].candidate->refinements().size(); ++r) {
      if (terms()[t].candidate->refined(r)) all.push_back({t, r});
    }
  }
  return all;
}

const ModelFit& Selection::without(const ModelTerm& addition) {
  const auto known = std::ranges::find(without_, addition, &std::pair<ModelTerm, ModelFit>::first);
  if (known != without_.end()) return known->second;
  return without_.emplace_back(addition, fit_without(problem(), best(), addition)).second;
}

void Selection::drop(const ModelTerm& addition) { fit_and_accept(without(addition).state); }

/// Refits with the grid bias of the state and updated maps. @throws simulation::EffectError
void Selection::fit_and_accept(State state) {
  update_precomputed(problem(), state);
  accept(fit_with_maps(problem(), std::move(state)));
  selected_.best = boards_.refit(std::move(selected_.best), selected_.unsure_boards);
}

bool Selection::try_accept(State state) {
  SelectedModel before = selected_;
  try {
    fit_and_accept(std::move(state));
    return true;
  } catch (const simulation::EffectError& error) {
    select(std::move(before));
    task_.note({"fitted", {error.effect}, {}, error.what()});
    const auto failing = std::ranges::find(task_.candidates, error.effect, [](const auto& one) { return one->name(); });
    if (failing == task_.candidates.end() || is_in(best().state, **failing)) return false;
    std::vector<const Candidate*>& barred = selected_.barred;
    if (!(*failing)->maps().empty())  // MapSearch knows only refused effects, so it stays out even after an undo
      task_.refused.emplace(error.effect, error.what());
    else if (!contains(barred, failing->get()))
      barred.push_back(failing->get());
    return false;
  }
}

ModelFit fit_without(const Problem& problem, const ModelFit& best, const ModelTerm& addition) {
  std::vector<Column> columns = best.jacobian;
  const std::size_t count = values_of(best.state.terms[addition.term], addition).size();
  const auto at =
      columns.begin() + static_cast<std::ptrdiff_t>(first_parameter(best.state, addition.term, addition.refinement));
  columns.erase(at, at + static_cast<std::ptrdiff_t>(count));
  State state = removed(best.state, addition);
  update_reflectivity_jacobian(problem, state);
  ModelFit less = fit_roughly(problem, std::move(state), columns);
  if (has_maps(less.state)) less = fit_with_maps(problem, less.state);  // maps take over what they can
  less.jacobian = std::move(columns);
  return less;
}

std::vector<double> min_deviance_rises(const Problem& problem, const ModelFit& best,
                                       std::span<const ModelTerm> additions) {
  const State& state = best.state;
  const auto rows = expected(problem, state);
  Group group{best.jacobian};
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
