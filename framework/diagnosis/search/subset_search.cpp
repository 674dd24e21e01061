// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Gain that is nearly all of the best set's predicted gain.
double needed_of(const std::vector<Subset>& sets) {
  double most = 0;
  for (const Subset& set : sets) most = std::max(most, set.merit >= settings.min_bic_gain ? set.gain : 0);
  return settings.nearly_all * most - settings.chance_gain;
}

/// Sets in the order in which they are fitted: single effects, then the best sets of the smallest size that predicts
/// nearly all of the gain, then the best set of one effect more. Large sets compensate the nonlinearity of a smaller
/// one; effects missed here are found after its fit.
/// @param singles true: single effects are fitted regardless of their predicted gain
std::vector<Subset> worth_fitting(const std::vector<Subset>& sets, double needed, bool singles) {
  std::size_t size = std::numeric_limits<std::size_t>::max();
  for (const Subset& set : sets) {
    if (set.merit >= settings.min_bic_gain && set.gain >= needed) size = std::min(size, set.choices.size());
  }
  std::vector<Subset> chosen;
  bool larger = false;
  std::size_t alone = 0;
  double most = 0;  // largest predicted gain of a single effect
  for (const Subset& set : sets) most = std::max(most, set.choices.size() == 1 ? set.gain : 0);
  for (const Subset& set : sets) {
    const std::size_t count = set.choices.size();
    if (set.merit < settings.min_bic_gain && !(singles && count == 1)) continue;
    if (count == 1 && ++alone > settings.sure_singles && set.gain < settings.min_single_promise * most) continue;
    if (count == 1 || count == size || (count == size + 1 && !std::exchange(larger, true))) chosen.push_back(set);
  }
  std::ranges::stable_sort(chosen, {}, [](const Subset& set) { return set.choices.size(); });
  return chosen;
}

std::vector<std::string> names_of(const Alternatives& all, const Subset& subset) {
  std::vector<std::string> names;
  for (const std::size_t c : subset.choices) names.push_back(all.list[c].name());
  return names;
}

/// Predicted gains of the best set of each size.
std::vector<Promise> promises_of(const Alternatives& all, const std::vector<Subset>& sets) {
  std::vector<Promise> promises;
  for (const Subset& set : sets) {
    if (std::ranges::none_of(promises, [&](const Promise& one) { return one.names.size() == set.choices.size(); }))
      promises.push_back({names_of(all, set), set.gain});
  }
  return promises;
}

/// Columns of maps that are refitted: with a map held, an effect that it imitates in part would have almost no
/// predicted gain. The map is held if the other effects fail without it.
std::vector<Column> following_maps(const Problem& problem, const State& state) {
  if (!maps_follow(state)) return {};
  try {
    return map_columns(problem, state);
  } catch (const simulation::EffectError&) {
    return {};
  }
}

SubsetOptions priced_options(const Problem& problem) {
  SubsetOptions options;
  options.price = std::log(static_cast<double>(problem.data.size()));
  options.prior = 1 / (settings.prior_width * settings.prior_width);
  return options;
}

/// Options for each effect alone, in its best form.
SubsetOptions single_options(const Problem& problem, const Alternatives& all) {
  SubsetOptions options = priced_options(problem);
  options.max_effects = 1;
  options.singles = all.choices.size();
  return options;
}

/// Options for sets of as many effects as may still be added.
SubsetOptions subset_options(const SelectionTask& task, const ModelFit& best) {
  SubsetOptions options = priced_options(task.problem);
  options.singles = settings.max_singles;
  options.share_of_all = settings.nearly_all, options.less_than_all = settings.chance_gain;
  options.max_effects = std::min(options.max_effects, task.options.max_effects - task.added(best));
  return options;
}

/// Notes the predicted gain of each effect alone, in its best form.
void note_ranks(SelectionTask& task, const Alternatives& all, const Score& score) {
  for (const Subset& subset :
       best_subsets(score.information, score.score(), all.choices, single_options(task.problem, all)))
    task.note({"ranked",
               names_of(all, subset),
               {{"promised", subset.gain}, {"promised_less_price", subset.merit}},
               subset.merit < settings.min_bic_gain ? "not worth its parameters" : "may be"});
}

}  // namespace

void SubsetSearch::linearise_candidates(const State& state) {
  if (task_.options.max_effects > 0)
    alternatives_ = alternatives_of(task_.problem, state, task_.candidates, task_.refused);
}

/// Alternatives that the best model lacks. Effects that repeat a simpler one are omitted: they are its rivals.
Alternatives SubsetSearch::missing_alternatives(const SelectedModel& selected) const {
  std::vector<const Candidate*> left_out = selected.barred;
  std::ranges::copy(alternatives_.repeated, std::back_inserter(left_out));
  return alternatives_missing_in(task_.problem, selected.best.state, alternatives_, left_out);
}

bool SubsetSearch::promises_as_before(const SelectedModel& selected) const {
  const ModelFit& best = selected.best;
  const Alternatives all = missing_alternatives(selected);
  if (promised_.empty() || all.list.empty()) return false;
  const Score score = score_of(task_.problem, best, all.group, {}, following_maps(task_.problem, best.state));
  const auto now =
      promises_of(all, best_subsets(score.information, score.score(), all.choices, subset_options(task_, best)));
  return std::ranges::equal(now, promised_, [](const Promise& one, const Promise& before) {
    return one.names == before.names && std::abs(one.gain - before.gain) < settings.same_promise * before.gain;
  });
}

std::optional<ModelFit> SubsetSearch::best_set(const SelectedModel& selected, double min_promise) {
  const ModelFit& from = selected.best;
  if (!task_.may_add(from)) return std::nullopt;
  task_.report_progress(fmt::format("looking for effect {}", task_.added(from) + 1));
  const Alternatives all = missing_alternatives(selected);
  if (all.list.empty()) return std::nullopt;
  const SubsetOptions options = subset_options(task_, from);
  const bool first_effects = task_.added(from) == 0;
  ModelFit best = from;
  RandomEffectSd noise = from.state.random_sd;
  std::vector<FittedSet> tried;
  const Group* const group = &all.group;
  const Scanner scanner(task_.problem, from, std::span(&group, 1), following_maps(task_.problem, from.state));
  for (std::size_t round = 0; round < settings.max_subset_rounds; ++round) {
    const Score score = scanner.scan(noise, from.dimension).scores[0];
    std::vector<Subset> sets = best_subsets(score.information, score.score(), all.choices, options);
    if (promised_.empty() && first_effects) promised_ = promises_of(all, sets);
    std::erase_if(sets, [&](const Subset& set) { return set.gain < min_promise; });
    if (round == 0) note_ranks(task_, all, score);
    const double before = task_.bic(best);
    if (std::optional<ModelFit> instead = best_of_round(selected, all, score.information, sets, tried, best))
      return instead;
    if (task_.bic(best) == before) break;
    noise = best.state.random_sd;
  }
  return task_.bic(from) - task_.bic(best) >= settings.min_bic_gain ? std::optional(std::move(best)) : std::nullopt;
}

/// Fits the sets of one round; updates `best` if one is better. @returns a model that makes further sets unnecessary
std::optional<ModelFit> SubsetSearch::best_of_round(const SelectedModel& selected, const Alternatives& all,
                                                    const Eigen::MatrixXd& information, const std::vector<Subset>& sets,
                                                    std::vector<FittedSet>& tried, ModelFit& best) {
  const ModelFit& from = selected.best;
  const double needed = needed_of(sets), before = task_.bic(best);
  std::size_t size = 1;
  // With one value per condition, the unexplained residual is scatter: only a fit shows how much the scatter decreases.
  const bool singles = task_.problem.design.superpixels() == 1;
  for (const Subset& subset : worth_fitting(sets, needed, singles)) {
    // If a fitted smaller set gains what the best set predicts, larger sets are unnecessary.
    const bool larger = subset.choices.size() > size;
    if (larger && from.deviance - best.deviance >= needed) break;
    // They are also unnecessary if boards that are not flat explain the residual of a single effect.
    const bool first_larger = larger && size == 1;
    if (first_larger && task_.bic(best) < task_.bic(from) - settings.min_bic_gain && boards_.trial_for(best.state).sure)
      return best;
    size = subset.choices.size();
    if (std::ranges::find(tried, subset.choices, &FittedSet::choices) != tried.end()) continue;
    std::optional<ModelFit> next = fitted_beyond(selected, all, subset, information, tried);
    tried.push_back({subset.choices, next});
    const bool better = next && task_.bic(*next) < task_.bic(best) - settings.min_lead;
    task_.note({"fitted",
                names_of(all, subset),
                {{"promised", subset.gain},
                 {"gain", next ? from.deviance - next->deviance : NAN},
                 {"bic_fall", next ? before - task_.bic(*next) : NAN}},
                !next    ? "gives no number"
                : better ? "the best so far"
                         : "not better than the best so far"});
    if (better) best = std::move(*next);
    // They are also unnecessary if maps explain more than the best fit does and than any set predicts.
    if (!first_larger || task_.added(from) != 0) continue;
    std::optional<ModelFit> maps = maps_.in_place_of(with_jacobian(task_.problem, best), selected);
    if (maps && task_.bic(from) - task_.bic(*maps) >= sets.front().merit) return maps;
  }
  return std::nullopt;
}

std::vector<ModelFit> SubsetSearch::forms_of(const ModelFit& base, const Candidate& one) const {
  std::vector<const Candidate*> others;
  for (const auto& candidate : task_.candidates)
    if (candidate.get() != &one) others.push_back(candidate.get());
  const Alternatives all = alternatives_missing_in(task_.problem, base.state, alternatives_, others);
  const auto is_form = [&](const Alternative& a) { return !a.refines && &a.candidate->root() == &one; };
  if (std::ranges::none_of(all.list, is_form)) return {};
  const Score score = score_of(task_.problem, base, all.group, {}, following_maps(task_.problem, base.state));
  const SubsetOptions options = single_options(task_.problem, all);
  std::vector<Subset> forms;
  for (std::size_t c = 0; c < all.list.size(); ++c) {
    if (!is_form(all.list[c])) continue;
    for (Subset& form : best_subsets(score.information, score.score(), {&all.choices[c], 1}, options)) {
      form.choices = {c};
      forms.push_back(std::move(form));
    }
  }
  std::ranges::stable_sort(forms, std::greater<>{}, &Subset::merit);
  std::vector<const Candidate*> tried;  // each combination of refinements once, at its best nonlinear values
  std::vector<ModelFit> fits;
  for (const Subset& form : forms) {
    const Candidate* const refined = all.list[form.choices.front()].candidate;
    if (tried.size() == settings.max_forms || contains(tried, refined)) continue;
    tried.push_back(refined);
    if (std::optional<ModelFit> fit = fitted(base, all, form, score.information)) fits.push_back(*std::move(fit));
  }
  return fits;
}

/// Fit of a set that is never worse than a nested model: the model without the set, or with a part of it. If other
/// starts end worse, the fit starts again at the nested model, with the rest of the set off.
std::optional<ModelFit> SubsetSearch::fitted_beyond(const SelectedModel& selected, const Alternatives& all,
                                                    const Subset& subset, const Eigen::MatrixXd& information,
                                                    std::span<const FittedSet> tried) {
  const ModelFit& from = selected.best;
  std::optional<ModelFit> best = fitted(from, all, subset, information);
  const auto keep_better = [&](std::optional<ModelFit> other) {
    if (other && (!best || other->deviance < best->deviance)) best = std::move(other);
  };
  if (selected.about_drift_mean) keep_better(fitted(*selected.about_drift_mean, all, subset, information));
  const auto is_in_set = [&](std::size_t c) { return contains(subset.choices, c); };
  const ModelFit* nested = &from;
  std::span<const std::size_t> part;
  for (const FittedSet& one : tried) {
    if (one.fit && one.fit->deviance < nested->deviance && std::ranges::all_of(one.choices, is_in_set))
      nested = &*one.fit, part = one.choices;
  }
  const auto is_worse = [&] { return best && best->deviance > nested->deviance + settings.roughly_converged; };
  if (best && !is_worse()) return best;
  State start = nested->state;
  for (const std::size_t c : subset.choices) {
    if (contains(part, c)) continue;
    const std::vector<double> off(all.choices[c].columns.size(), 0);
    start = all.list[c].placed(std::move(start), off);
  }
  try {
    keep_better(fit_roughly_with_maps(task_.problem, std::move(start)));
  } catch (const simulation::EffectError&) {  // fails from there
  }
  task_.note({"fitted again",
              names_of(all, subset),
              {{"gain", best ? from.deviance - best->deviance : NAN}},
              is_worse() ? "worse than a model that it contains" : "from a model that it contains"});
  return best;
}

/// Starts of the fit of a set: the amplitudes of the linear solution, which assumes that the model's effects change,
/// too; if it is worse than the model without the set, also the halved solution, repeatedly halved until it is better,
/// because the fit may mistake such a deviation for scatter between conditions.
std::vector<State> SubsetSearch::starts_of(const ModelFit& from, const Alternatives& all, const Subset& subset,
                                           const Eigen::VectorXd& values) const {
  const auto placed = [&](double share) {
    State state = from.state;
    Eigen::Index at = 0;
    for (const std::size_t c : subset.choices) {
      const Eigen::VectorXd own = share * values.segment(at, static_cast<Eigen::Index>(all.choices[c].columns.size()));
      state = all.list[c].placed(std::move(state), {own.data(), all.choices[c].columns.size()});
      at += own.size();
    }
    return state;
  };
  const auto is_better = [&](const State& state) {
    try {
      return deviance_of(task_.problem, state) < from.deviance;
    } catch (const simulation::EffectError&) {  // nearer to off the effect may be defined
      return false;
    }
  };
  std::vector<State> starts = {placed(1)};
  State halved = starts.front();
  int halvings = 0;
  while (halvings < settings.max_start_halvings && !is_better(halved)) halved = placed(std::ldexp(1.0, -++halvings));
  if (halvings > 0) starts.push_back(std::move(halved));
  return starts;
}

/// Fit of a set from the linear solution; also from half a step of amplitudes without a visible change of their own:
/// some show only with another one, as roughness does with matt surfaces, and have no slope at off. Nullopt if an
/// effect fails. @param information of all columns
std::optional<ModelFit> SubsetSearch::fitted(const ModelFit& from, const Alternatives& all, const Subset& subset,
                                             const Eigen::MatrixXd& information) const {
  Eigen::VectorXd visible = subset.values;
  Eigen::Index at = 0;
  for (const std::size_t c : subset.choices) {
    for (const Eigen::Index column : all.choices[c].columns) {
      if (information(column, column) < settings.min_visible_chi_square) visible(at) = 0.5;
      ++at;
    }
  }
  const bool differ = visible != subset.values;
  std::optional<ModelFit> best;
  const auto try_from = [&](State state) {
    try {
      ModelFit next = fit_roughly_with_maps(task_.problem, std::move(state));
      if (!best || next.deviance < best->deviance) best = std::move(next);
    } catch (const simulation::EffectError&) {  // fails from there
    }
  };
  for (State& start : starts_of(from, all, subset, subset.values)) try_from(std::move(start));
  if (!differ) return best;
  const State shown = starts_of(from, all, subset, visible).back();
  const auto stays = [&](const State& state) {  // if it has moved by itself, the slope was not zero
    for (std::size_t t = from.state.terms.size(); t < state.terms.size(); ++t) {
      const std::vector<FreeParameter>& free = state.terms[t].candidate->free();
      for (std::size_t k = 0; k < free.size(); ++k) {
        const auto is_off = [&](const State& one) { return one.terms[t].values[k] == free[k].off; };
        if (!free[k].nonlinear && is_off(state) && !is_off(shown)) return true;
      }
    }
    return false;
  };
  if (!best || stays(best->state)) try_from(shown);
  return best;
}

}  // namespace tofgraph::diagnosis
