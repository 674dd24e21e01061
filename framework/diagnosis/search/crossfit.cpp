// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/crossfit.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/nuisances.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// ln of the profile's contrast over the fitted one; nullopt if it is not fitted.
std::optional<double> fitted_contrast(const Problem& problem, const State& state) {
  return has_contrast(problem.nuisances) ? std::optional(log_lower_contrast(problem, state)) : std::nullopt;
}

/// Sets FoldResult::missed; with board heights nothing is compared, because models with different ones cannot be.
/// @param selection of the fold; may change
void compare(FoldResult& result, Selection& selection, const State& of_all_data) {
  const std::size_t given = selection.task().given_terms.size();
  result.compared_with = added_effects(of_all_data, given);
  result.missed.clear();
  const auto chosen = [&](const std::string& name) { return contains(result.chosen, name); };
  if (result.state.nuisances.boards || std::ranges::all_of(result.compared_with, chosen)) return;
  if (selection.take_if_better(of_all_data).accepted) result.missed = added_effects(selection.best().state, given);
}

/// Compares a fold that was searched earlier with another model of all data. If time expires, it stays as it was.
void compare_again(FoldResult& result, const Design& design, const std::vector<Observations>& data,
                   const std::vector<Term>& model, const Candidates& candidates, const SearchOptions& options,
                   const State& of_all_data) {
  if (!result.failed.empty() || result.state.nuisances.boards) return;
  if (result.compared_with == added_effects(of_all_data, model.size())) return;
  const FoldProblem training(design, data, left_by(result.fold, design.size()), &options.deadline);
  FoldResult compared = result;
  try {
    Selection selection(training.problem, model, candidates, options, {});
    selection.begin();
    if (!selection.try_accept(result.state)) return;
    compare(compared, selection, of_all_data);
    result = std::move(compared);
  } catch (const simulation::EffectError&) {  // the set does not support any effect here
  } catch (const TimeExpired&) {
  }
}

FoldResult result_of(const Fold& fold, const Design& design, const std::vector<Observations>& data,
                     const std::vector<Term>& model, const Candidates& candidates, const SearchOptions& options,
                     const State* of_all_data) {
  FoldResult result{.fold = fold};
  const FoldProblem training(design, data, left_by(fold, design.size()), &options.deadline);
  FoldProblem held(design, data, fold.held, training.problem);
  try {
    Selection selection(training.problem, model, candidates, options, {});
    selection.begin();
    selection.linearise_candidates();
    if (options.max_effects > 0) selection.forward_select();
    // The given model is not refitted, only its reflectivities are.
    const State& given = selection.refitted_given().state;
    const State written = fit_as_written(training.problem, {model, given.log_reflectivity, given.random_sd}).state;
    result.state = selection.best().state;
    Prediction prediction =
        predicted(held, fold, written, result.state, fitted_contrast(training.problem, result.state));
    for (const ModelTerm& addition : selection.additions()) {
      if (addition.refinement) continue;
      const std::string name = selection.terms()[addition.term].candidate->name();
      result.chosen.push_back(name);
      prediction.without(name, selection.without(addition).state, removed(result.state, addition));
    }
    result.conditions = prediction.result();
    if (of_all_data != nullptr) compare(result, selection, *of_all_data);
  } catch (const simulation::EffectError& error) {
    result.chosen.clear();
    result.failed = error.what();
  } catch (const TimeExpired&) {
    result.time_expired = true;
  }
  return result;
}

/// Two sums per condition, over all the folds that hold it out, because they use the same measurement; or two sums per
/// cluster of conditions.
using Sums = std::map<std::size_t, std::array<double, 2>>;

void add(std::array<double, 2>& sums, const std::array<double, 2>& more) {
  for (std::size_t s = 0; s < sums.size(); ++s) sums[s] += more[s];
}

/// Ends of the bootstrap 95 % interval of a function of sums over conditions.
template <class F> std::pair<double, double> drawn(const Sums& of_each, std::uint64_t seed, const F& of) {
  std::vector<std::array<double, 2>> conditions;
  for (const auto& [one, sums] : of_each) conditions.push_back(sums);
  std::mt19937_64 generator(seed);
  std::vector<double> values;
  for (int d = 0; d < settings.gap_interval_draws; ++d) {
    std::array<double, 2> sums{};
    for (std::size_t k = 0; k < conditions.size(); ++k) add(sums, conditions[generator() % conditions.size()]);
    values.push_back(of(sums));
  }
  std::ranges::sort(values);
  return {values[settings.gap_interval_draws / 40],
          values[settings.gap_interval_draws - 1 - settings.gap_interval_draws / 40]};
}

using Names = std::set<std::string>;

/// Effects that more than half of the folds chose and a model lacks.
Names agreed_and_lacking(const CrossFit& folds, const State& model, std::size_t given) {
  std::map<std::string, std::size_t> times;
  for (const FoldResult& fold : folds.folds) {
    for (const std::string& name : fold.chosen) ++times[name];
  }
  for (const std::string& name : added_effects(model, given)) times.erase(name);
  Names names;
  for (const auto& [name, count] : times) {
    if (2 * count > folds.folds.size()) names.insert(name);
  }
  return names;
}

}  // namespace

CrossFit cross_fit(const std::vector<Fold>& folds, const Design& design, const std::vector<Observations>& data,
                   const std::vector<Term>& model, const Candidates& candidates, const SearchOptions& options,
                   std::span<const std::vector<std::string>> asked, std::vector<FoldResult> known,
                   const State* of_all_data) {
  // Each fold has its own columns, up to some 500 MB. The first batches are smaller, because few folds may decide.
  // Batches are the same on any machine, because the decision after each depends on them.
  CrossFit result;
  result.clusters = clusters_of(design);
  std::size_t done = known.size();
  result.folds = std::move(known);
  result.folds.resize(folds.size());
  SearchOptions quiet = options;
  quiet.progress = {};
  std::atomic<std::size_t> finished = done;
  const std::size_t may_miss = folds.size() - min_folds_supporting(folds.size());
  const auto refuted = [&](const std::vector<std::string>& names) {
    const auto without = [&](const FoldResult& fold) { return !fold.supports(names); };
    if (static_cast<std::size_t>(std::ranges::count_if(std::span(result.folds).first(done), without)) > may_miss)
      return true;
    return done >= settings.min_folds_to_refute && held_out_improvement_of(result, names, options.seed).is_worse();
  };
  const auto decided = [&] { return done > 0 && !asked.empty() && std::ranges::all_of(asked, refuted); };
  while (done < folds.size() && !decided()) {
    const std::size_t end =
        std::min(folds.size(), done + (done < settings.folds_at_once ? settings.first_folds : settings.folds_at_once));
    if (options.progress)
      options.progress(fmt::format("predicting held-out conditions, {} of {}", done + 1, folds.size()));
    tbb::parallel_for(done, end, [&](std::size_t f) {
      // Without isolation a thread that waits within one fold would start another one in it.
      tbb::this_task_arena::isolate(
          [&] { result.folds[f] = result_of(folds[f], design, data, model, candidates, quiet, of_all_data); });
      if (options.fold_done) options.fold_done(++finished, folds.size());
    });
    done = end;
    if (std::ranges::any_of(result.folds, &FoldResult::time_expired)) break;
  }
  result.folds.resize(done);
  result.time_expired = std::erase_if(result.folds, [](const FoldResult& fold) { return fold.time_expired; }) > 0;
  result.complete = result.folds.size() == folds.size();
  return result;
}

std::vector<std::string> added_effects(const State& model, std::size_t given) {
  std::vector<std::string> names;
  for (std::size_t t = given; t < model.terms.size(); ++t) names.push_back(model.terms[t].candidate->name());
  std::ranges::sort(names);
  return names;
}

void compare_folds(std::span<FoldResult> folds, const Design& design, const std::vector<Observations>& data,
                   const std::vector<Term>& model, const Candidates& candidates, const SearchOptions& options,
                   const State& of_all_data) {
  SearchOptions quiet = options;
  quiet.progress = {};
  tbb::parallel_for(std::size_t{0}, folds.size(), [&](std::size_t f) {
    tbb::this_task_arena::isolate(
        [&] { compare_again(folds[f], design, data, model, candidates, quiet, of_all_data); });
  });
}

CrossFit predict_unsearched(const Problem& searched, const Design& whole, const std::vector<Observations>& data,
                            const std::vector<std::size_t>& rest, const State& given, const State& model,
                            const Deadline& deadline) {
  constexpr std::size_t block = 64;  // conditions in memory per thread
  std::vector<std::vector<OutOfFold>> blocks((rest.size() + block - 1) / block);
  const std::optional<double> log_lower = fitted_contrast(searched, model);
  CrossFit result{.clusters = clusters_of(whole)};
  FoldResult& fold = result.folds.emplace_back(FoldResult{.fold = {.held = rest}});
  try {
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
      tbb::this_task_arena::isolate([&] {
        deadline.check();
        const auto first = rest.begin() + static_cast<std::ptrdiff_t>(b * block);
        const Fold some{.held = {first, b + 1 < blocks.size() ? first + block : rest.end()}};
        FoldProblem held(whole, data, some.held, searched);
        blocks[b] = predicted(held, some, given, model, log_lower).result();
      });
    });
    for (const std::vector<OutOfFold>& of_block : blocks)
      std::ranges::copy(of_block, std::back_inserter(fold.conditions));
  } catch (const simulation::EffectError& error) {
    fold.failed = error.what();
  } catch (const TimeExpired&) {
    fold.failed = "the time limit ended the prediction";
  }
  return result;
}

bool FoldResult::chose(const std::vector<std::string>& names) const {
  return std::ranges::any_of(chosen, [&](const auto& name) { return contains(names, name); });
}

bool FoldResult::supports(const std::vector<std::string>& names) const {
  return chose(names) || std::ranges::any_of(missed, [&](const auto& name) { return contains(names, name); });
}

HeldOutGap FoldResult::gap() const {
  GapSums sums;
  sums.add(conditions);
  return sums.gap();
}

HeldOutGap CrossFit::gap() const {
  GapSums sums;
  for (const FoldResult& fold : folds) sums.add(fold.conditions);
  return sums.gap();
}

double CrossFit::supporting_fraction(const std::vector<std::string>& names) const {
  if (folds.empty()) return 0;
  const auto supporting = std::ranges::count_if(folds, [&](const FoldResult& fold) { return fold.supports(names); });
  return static_cast<double>(supporting) / static_cast<double>(folds.size());
}

CrossFit::Gap CrossFit::gap(std::size_t o, const std::string& setting, std::uint64_t seed) const {
  Sums of_clusters;  // sums of squares, and their number
  GapSums all;
  for (const FoldResult& fold : folds) {
    if (!setting.empty() && fold.fold.setting != setting) continue;
    for (const OutOfFold& c : fold.conditions) {
      add(of_clusters[clusters[c.condition]], {c.after[o], c.count[o]});
      all.add(c, o);
    }
  }
  if (!(all.count > 0)) return {};
  const auto [low, high] = drawn(of_clusters, seed, [&](const std::array<double, 2>& sums) {
    return GapSums{0, sums[0], sums[1]}.gap().after;
  });
  return {all.gap().before, all.gap().after, low, high};
}

CrossFit::GapOfNames CrossFit::gap_with_only(std::span<const std::string> names) const {
  const auto pure = [&](const FoldResult& fold) {
    return fold.failed.empty() && !fold.chosen.empty() &&
           std::ranges::all_of(fold.chosen, [&](const std::string& name) { return contains(names, name); });
  };
  const auto chose_any = [](const FoldResult& fold) { return !fold.chosen.empty(); };
  const bool most =
      2 * std::ranges::count_if(folds, pure) >= std::max<std::ptrdiff_t>(1, std::ranges::count_if(folds, chose_any));
  GapSums sums;
  for (const FoldResult& fold : folds) {
    if (!most || pure(fold)) sums.add(fold.conditions);
  }
  return {sums.gap(), most};
}

HeldOutImprovement held_out_improvement_of(const CrossFit& cross_fit, const std::vector<std::string>& names,
                                           std::uint64_t seed) {
  Sums conditions;  // chi-squares without and with the effect
  HeldOutImprovement improvement;
  GapSums refitted;  // without the effect, and with it
  std::vector<double> taken_out_of_each, with_of_each;
  // If a fold chose two similar effects, removing one of them does not show what both contribute.
  const auto single = [&](const FoldResult& fold) {
    return std::ranges::count_if(fold.chosen, [&](const auto& one) { return contains(names, one); }) == 1;
  };
  const bool any = std::ranges::any_of(cross_fit.folds, single);
  for (const FoldResult& fold : cross_fit.folds) {
    if (!fold.supports(names)) continue;
    ++improvement.folds_supporting;
    if (!fold.chose(names)) continue;
    ++improvement.folds_choosing;
    if (any && !single(fold)) continue;
    improvement.folds_alone += any ? 1 : 0;
    GapSums taken_out;  // only before
    for (const OutOfFold& c : fold.conditions) {
      const auto name = std::ranges::find_if(names, [&](const std::string& one) { return c.without.contains(one); });
      if (name == names.end()) continue;
      const OutOfFold::Less& less = c.without.at(*name);
      add(conditions[c.condition], {less.chi, c.chi_after});
      improvement.without += less.chi;
      improvement.with += c.chi_after;
      improvement.seen += less.seen;
      refitted.before += less.depth;
      refitted.after += c.after[distance];
      taken_out.before += less.taken_out;
      taken_out.count += c.count[distance];
    }
    refitted.count += taken_out.count;
    if (!(taken_out.count > 0)) continue;
    taken_out_of_each.push_back(taken_out.gap().before);
    with_of_each.push_back(fold.gap().after);
  }
  if (conditions.empty()) return improvement;
  const auto [without, with] = refitted.gap();
  improvement.gap_refitted_without = without, improvement.gap_with = with;
  if (!taken_out_of_each.empty()) {
    improvement.median_taken_out = physics::median(taken_out_of_each);
    improvement.median_with = physics::median(with_of_each);
  }
  improvement.low = drawn(conditions, seed, [](const std::array<double, 2>& sums) { return sums[0] - sums[1]; }).first;
  return improvement;
}

std::vector<HeldOutGap> gaps_by_condition(const CrossFit& cross_fit, std::size_t conditions) {
  std::vector<GapSums> sums(conditions);
  for (const FoldResult& fold : cross_fit.folds) {
    for (const OutOfFold& c : fold.conditions) sums[c.condition].add(c, distance);
  }
  std::vector<HeldOutGap> gaps;
  for (const GapSums& one : sums) gaps.push_back(one.gap());
  return gaps;
}

bool agree_on_more(const CrossFit& folds, const State& model, std::size_t given) {
  return !agreed_and_lacking(folds, model, given).empty();
}

std::vector<State> models_with_agreed_effects(const CrossFit& folds, const State& model, std::size_t given) {
  if (folds.folds.size() < settings.min_agreeing_folds) return {};
  const Names lacking = agreed_and_lacking(folds, model, given);
  std::map<Names, std::vector<const FoldResult*>> sets;
  for (const FoldResult& fold : folds.folds) {
    const Names chosen(fold.chosen.begin(), fold.chosen.end());
    if (std::ranges::any_of(lacking, [&](const std::string& name) { return chosen.contains(name); }))
      sets[chosen].push_back(&fold);
  }
  std::vector<const std::vector<const FoldResult*>*> ranked;
  for (const auto& [names, of_set] : sets) ranked.push_back(&of_set);
  std::ranges::stable_sort(ranked, std::greater<>{}, [](const auto* of_set) { return of_set->size(); });
  std::vector<State> models;
  for (const auto* of_set : ranked) {
    if (models.size() < settings.max_agreed_models) models.push_back(of_set->front()->state);
  }
  return models;
}

}  // namespace tofgraph::diagnosis
