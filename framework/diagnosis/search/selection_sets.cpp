// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Sets of effects in a selection: which of those that the linearised problem promises are fitted, and the best of them.
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Gain that is nearly all of what the best set promises.
double needed_of(const std::vector<Subset>& sets) {
  double most = 0;
  for (const Subset& set : sets) most = std::max(most, set.merit >= settings.min_bic_gain ? set.gain : 0);
  return settings.nearly_all * most - settings.chance_gain;
}

/// Sets in the order in which they are fitted: single effects, then the best sets of the fewest effects that promise
/// nearly all, then the best one of one effect more. Large sets make up for what is not linear in a small one; what
/// that misses is found from where its fit leads to.
/// @param singles whether single effects are fitted whatever they promise
std::vector<Subset> worth_fitting(const std::vector<Subset>& sets, double needed, bool singles) {
  std::size_t size = std::numeric_limits<std::size_t>::max();
  for (const Subset& set : sets) {
    if (set.merit >= settings.min_bic_gain && set.gain >= needed) size = std::min(size, set.choices.size());
  }
  std::vector<Subset> chosen;
  bool larger = false;
  std::size_t alone = 0;
  double most = 0;  // that a single effect promises
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

/// Promises of the best set of each size.
std::vector<Promise> promises_of(const Alternatives& all, const std::vector<Subset>& sets) {
  std::vector<Promise> promises;
  for (const Subset& set : sets) {
    if (std::ranges::none_of(promises, [&](const Promise& one) { return one.names.size() == set.choices.size(); }))
      promises.push_back({names_of(all, set), set.gain});
  }
  return promises;
}

}  // namespace

/// With a map held, an effect for which it stands in part would promise next to nothing beside it. Where the others
/// give no number without the map it is held.
std::vector<Column> Selection::maps_of(const State& state) const {
  if (!maps_follow(state)) return {};
  try {
    return map_columns(problem_, state);
  } catch (const simulation::EffectError&) {
    return {};
  }
}

SubsetOptions Selection::set_options() const {
  SubsetOptions options;
  options.price = std::log(static_cast<double>(problem_.data.size()));
  options.prior = 1 / (settings.prior_width * settings.prior_width);
  return options;
}

/// Each effect by itself, in its best form.
SubsetOptions Selection::alone(const Alternatives& all) const {
  SubsetOptions options = set_options();
  options.max_effects = 1;
  options.singles = all.choices.size();
  return options;
}

SubsetOptions Selection::subset_options() const {
  SubsetOptions options = set_options();
  options.singles = settings.max_singles;
  options.share_of_all = settings.nearly_all, options.less_than_all = settings.chance_gain;
  options.max_effects = std::min(options.max_effects, model_.size() + options_.max_effects - terms().size());
  return options;
}

/// True if sets of effects promise beside the model as it is what they promised at first.
bool Selection::promises_as_before() const {
  const Alternatives all = alternatives_beside(problem_, best_.state, alternatives_, barred_);
  if (promised_.empty() || all.list.empty()) return false;
  const Score score = score_of(problem_, best_, all.group, 0, 0, maps_of(best_.state));
  const auto now = promises_of(all, best_subsets(score.information, score.score(), all.choices, subset_options()));
  return std::ranges::equal(now, promised_, [](const Promise& one, const Promise& before) {
    return one.names == before.names && std::abs(one.gain - before.gain) < settings.same_promise * before.gain;
  });
}

/// To the best set of effects that may be added: the best sets of the linearised problem are fitted, and again in the
/// noise that the best of these leaves, until no other comes out. @param least what a set must promise
/// @returns whether there is one
std::optional<ModelFit> Selection::search_subsets(double least) {
  if (terms().size() >= model_.size() + options_.max_effects) return std::nullopt;
  report_progress(fmt::format("looking for effect {}", terms().size() - model_.size() + 1));
  const Alternatives all = alternatives_beside(problem_, best_.state, alternatives_, barred_);
  if (all.list.empty()) return std::nullopt;
  const SubsetOptions options = subset_options();
  ModelFit reference = best_, best = best_;
  std::vector<std::vector<std::size_t>> fitted;
  const Group* const group = &all.group;
  const Scanner scanner(problem_, best_, std::span(&group, 1), maps_of(best_.state));
  for (std::size_t round = 0; round < settings.max_subset_rounds; ++round) {
    const Score score = scanner.scan(reference.state.random_sd, reference.dimension, 0, 0).scores[0];
    const double before = bic(best);
    std::vector<Subset> sets = best_subsets(score.information, score.score(), all.choices, options);
    if (promised_.empty() && terms().size() == model_.size()) promised_ = promises_of(all, sets);
    std::erase_if(sets, [&](const Subset& set) { return set.gain < least; });
    const double needed = needed_of(sets);
    if (round == 0) note_ranks(all, score);
    std::size_t size = 1;
    // Of one number a condition, what no effect explains is scatter: only a fit tells how much less there may be.
    const bool singles = problem_.design.superpixels() == 1;
    for (const Subset& subset : worth_fitting(sets, needed, singles)) {
      // Where one effect alone does, once it is fitted, what sets promise, these need not be.
      const bool larger = subset.choices.size() > size;
      if (larger && reference.deviance - best.deviance >= needed) break;
      // Nor where boards that are not flat explain what is left beside one.
      const bool first_larger = larger && size == 1;
      if (first_larger && bic(best) < bic(best_) - settings.min_bic_gain && boards_beside(best.state).sure) return best;
      size = subset.choices.size();
      if (std::ranges::find(fitted, subset.choices) != fitted.end()) continue;
      fitted.push_back(subset.choices);
      std::optional<ModelFit> next = fitted_set(best_.state, all, subset, score.information);
      const bool better = next && bic(*next) < bic(best) - settings.min_lead;
      note({"fitted",
            names_of(all, subset),
            {{"promised", subset.gain},
             {"gain", next ? reference.deviance - next->deviance : NAN},
             {"bic_fall", next ? before - bic(*next) : NAN}},
            !next    ? "gives no number"
            : better ? "the best so far"
                     : "not better than the best so far"});
      if (better) best = std::move(*next);
      // Nor where maps explain more than the best of them does, and than any of them promises.
      if (!first_larger || terms().size() != model_.size()) continue;
      std::optional<ModelFit> maps = maps_instead(linearised(problem_, best));
      if (maps && bic(best_) - bic(*maps) >= sets.front().merit) return maps;
    }
    if (bic(best) == before) break;
    reference.state.random_sd = best.state.random_sd;
  }
  return bic(best_) - bic(best) >= settings.min_bic_gain ? std::optional(std::move(best)) : std::nullopt;
}

std::vector<ModelFit> Selection::with(const ModelFit& base, const Candidate& one) const {
  std::vector<const Candidate*> others;
  for (const auto& candidate : candidates_)
    if (candidate.get() != &one) others.push_back(candidate.get());
  const Alternatives all = alternatives_beside(problem_, base.state, alternatives_, others);
  const auto is_form = [&](const Alternative& a) { return !a.refines && &a.candidate->root() == &one; };
  if (std::ranges::none_of(all.list, is_form)) return {};
  const Score score = score_of(problem_, base, all.group, 0, 0, maps_of(base.state));
  const SubsetOptions options = alone(all);
  std::vector<Subset> forms;
  for (std::size_t c = 0; c < all.list.size(); ++c) {
    if (!is_form(all.list[c])) continue;
    for (Subset& form : best_subsets(score.information, score.score(), {&all.choices[c], 1}, options)) {
      form.choices = {c};
      forms.push_back(std::move(form));
    }
  }
  std::ranges::stable_sort(forms, std::greater<>{}, &Subset::merit);
  std::vector<const Candidate*> tried;  // each combination of refinements once, at its best shapes
  std::vector<ModelFit> fits;
  for (const Subset& form : forms) {
    const Candidate* const refined = all.list[form.choices.front()].candidate;
    if (tried.size() == settings.max_forms || std::ranges::find(tried, refined) != tried.end()) continue;
    tried.push_back(refined);
    if (std::optional<ModelFit> fit = fitted_set(base.state, all, form, score.information))
      fits.push_back(*std::move(fit));
  }
  return fits;
}

/// Notes the promise of each effect alone, in its best form.
void Selection::note_ranks(const Alternatives& all, const Score& score) {
  for (const Subset& subset : best_subsets(score.information, score.score(), all.choices, alone(all)))
    note({"ranked",
          names_of(all, subset),
          {{"promised", subset.gain}, {"promised_less_price", subset.merit}},
          subset.merit < settings.min_bic_gain ? "not worth its parameters" : "may be"});
}

/// From where the linear solution leads to; and, where a size shows only beside another one, as roughness does beside
/// what is matt, once more from half a step of it: where it is off it may have no slope. Nothing where an effect gives
/// no number. @param information of all columns
std::optional<ModelFit> Selection::fitted_set(const State& from, const Alternatives& all, const Subset& subset,
                                              const Eigen::MatrixXd& information) const {
  State plain = from, shown = plain;
  bool differ = false;
  Eigen::Index at = 0;
  for (const std::size_t c : subset.choices) {
    const std::vector<Eigen::Index>& columns = all.choices[c].columns;
    const auto count = static_cast<Eigen::Index>(columns.size());
    Eigen::VectorXd values = subset.values.segment(at, count);
    const auto placed = [&](State state) {
      return all.list[c].placed(std::move(state), {values.data(), columns.size()});
    };
    plain = placed(std::move(plain));
    for (std::size_t k = 0; k < columns.size(); ++k) {
      if (information(columns[k], columns[k]) < settings.min_visible_chi_square)
        values(static_cast<Eigen::Index>(k)) = 0.5, differ = true;
    }
    shown = placed(std::move(shown));
    at += count;
  }
  std::optional<ModelFit> best;
  const auto try_from = [&](State state) {
    try {
      ModelFit next = fit_roughly_with_maps(problem_, std::move(state), weight_);
      if (!best || next.deviance < best->deviance) best = std::move(next);
    } catch (const simulation::EffectError&) {  // nothing from there
    }
  };
  try_from(std::move(plain));
  const auto stays = [&](const State& state) {  // where it has left its place by itself, it had a slope
    for (std::size_t t = from.terms.size(); t < state.terms.size(); ++t) {
      const std::vector<FreeParameter>& free = state.terms[t].candidate->free();
      for (std::size_t k = 0; k < free.size(); ++k) {
        const auto is_off = [&](const State& one) { return one.terms[t].values[k] == free[k].off; };
        if (!free[k].nonlinear && is_off(state) && !is_off(shown)) return true;
      }
    }
    return false;
  };
  if (differ && (!best || stays(best->state))) try_from(shown);
  return best;
}

}  // namespace tofgraph::diagnosis
