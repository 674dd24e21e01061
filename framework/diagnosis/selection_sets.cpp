// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Sets of effects in a selection: which of those that the linearised problem promises are fitted, and the best of them.
#include "diagnosis/selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

constexpr std::size_t most_leaps = 3;  ///< enumerations of sets, each in the noise that the best fit before has left
constexpr double nearly_all = 0.97;    ///< of the gain of the best set: what is missing may be bending
constexpr double by_chance = 30;       ///< gain that the effects of a set more than needed have
constexpr std::size_t most_singles = 8, sure_singles = 3;  ///< effects that are fitted alone; those that always are
constexpr std::size_t most_forms = 3;                      ///< of one effect, that are fitted in the place of others
constexpr double hardly_other = 0.02;                      ///< of what a set promised, where it promises the same again
constexpr double bends = 0.3;  ///< of the best single effect's promise: less does not become the best once it is fitted

/// Gain that is nearly all of what the best set promises.
double needed_of(const std::vector<Subset>& sets) {
  double most = 0;
  for (const Subset& set : sets) most = std::max(most, set.merit >= Selection::worth ? set.gain : 0);
  return nearly_all * most - by_chance;
}

/// Sets in the order in which they are fitted: single effects, then the best sets of the fewest effects that promise
/// nearly all, then the best one of one effect more. Large sets make up for what is not linear in a small one; what
/// that misses is found from where its fit leads to.
/// @param singles whether single effects are fitted whatever they promise
std::vector<Subset> worth_fitting(const std::vector<Subset>& sets, double needed, bool singles) {
  std::size_t size = std::numeric_limits<std::size_t>::max();
  for (const Subset& set : sets) {
    if (set.merit >= Selection::worth && set.gain >= needed) size = std::min(size, set.choices.size());
  }
  std::vector<Subset> chosen;
  bool larger = false;
  std::size_t alone = 0;
  double most = 0;  // that a single effect promises
  for (const Subset& set : sets) most = std::max(most, set.choices.size() == 1 ? set.gain : 0);
  for (const Subset& set : sets) {
    const std::size_t count = set.choices.size();
    if (set.merit < Selection::worth && !(singles && count == 1)) continue;
    if (count == 1 && ++alone > sure_singles && set.gain < bends * most) continue;
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

/// Of each size the first, which is the best.
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
  options.prior = 1 / (prior_width * prior_width);
  return options;
}

/// Each effect by itself, in its best form.
SubsetOptions Selection::alone(const Alternatives& all) const {
  SubsetOptions options = set_options();
  options.most_effects = 1;
  options.singles = all.choices.size();
  return options;
}

SubsetOptions Selection::leap_options() const {
  SubsetOptions options = set_options();
  options.singles = most_singles;
  options.share_of_all = nearly_all, options.less_than_all = by_chance;
  options.most_effects = std::min(options.most_effects, model_.size() + options_.max_effects - terms().size());
  return options;
}

/// Whether sets of effects promise beside the model as it is what they promised at first.
bool Selection::promises_as_before() const {
  const Alternatives all = alternatives_beside(problem_, best_.fit.state, alternatives_, barred_);
  if (promised_.empty() || all.list.empty()) return false;
  const Score score = score_of(problem_, best_.fit, best_.columns, all.group, 0, 0, maps_of(best_.fit.state));
  const auto now = promises_of(all, best_subsets(score.information, score.score(), all.choices, leap_options()));
  return std::ranges::equal(now, promised_, [](const Promise& one, const Promise& before) {
    return one.names == before.names && std::abs(one.gain - before.gain) < hardly_other * before.gain;
  });
}

/// To the best set of effects that may be added: the best sets of the linearised problem are fitted, and again in the
/// noise that the best of these leaves, until no other comes out. @param least what a set must promise
/// @returns whether there is one
std::optional<Fit> Selection::leap(double least) {
  if (terms().size() >= model_.size() + options_.max_effects) return std::nullopt;
  say(fmt::format("looking for effect {}", terms().size() - model_.size() + 1));
  const Alternatives all = alternatives_beside(problem_, best_.fit.state, alternatives_, barred_);
  if (all.list.empty()) return std::nullopt;
  const SubsetOptions options = leap_options();
  Fit reference = best_.fit, best = best_.fit;
  std::vector<std::vector<std::size_t>> fitted;
  const Group* const group = &all.group;
  const Scanner scanner(problem_, reference.state, best_.columns, std::span(&group, 1), maps_of(reference.state));
  for (std::size_t round = 0; round < most_leaps; ++round) {
    const Score score = scanner.scan(reference.state.variances, reference.dimension, 0, 0).scores[0];
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
      if (first_larger && bic(best) < bic(best_.fit) - worth && boards_beside(best.state).sure) return best;
      size = subset.choices.size();
      if (std::ranges::find(fitted, subset.choices) != fitted.end()) continue;
      fitted.push_back(subset.choices);
      std::optional<Fit> next = fitted_set(best_.fit.state, all, subset, score.information);
      const bool better = next && bic(*next) < bic(best) - 1;
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
      const std::vector<Column> own = own_columns(problem_, best.state, expected(problem_, best.state));
      std::optional<Fit> maps = maps_instead(best, own);
      if (maps && bic(best_.fit) - bic(*maps) >= sets.front().merit) return maps;
    }
    if (bic(best) == before) break;
    reference.state.variances = best.state.variances;
  }
  return bic(best_.fit) - bic(best) >= worth ? std::optional(std::move(best)) : std::nullopt;
}

std::vector<Fit> Selection::with(const Base& base, const Candidate& one) const {
  std::vector<const Candidate*> others;
  for (const auto& candidate : candidates_)
    if (candidate.get() != &one) others.push_back(candidate.get());
  const Alternatives all = alternatives_beside(problem_, base.fit.state, alternatives_, others);
  const auto is_form = [&](const Alternative& a) { return !a.refines && &a.candidate->root() == &one; };
  if (std::ranges::none_of(all.list, is_form)) return {};
  const Score score = score_of(problem_, base.fit, base.columns, all.group, 0, 0, maps_of(base.fit.state));
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
  std::vector<Fit> fits;
  for (const Subset& form : forms) {
    const Candidate* const refined = all.list[form.choices.front()].candidate;
    if (tried.size() == most_forms || std::ranges::find(tried, refined) != tried.end()) continue;
    tried.push_back(refined);
    if (std::optional<Fit> fit = fitted_set(base.fit.state, all, form, score.information))
      fits.push_back(*std::move(fit));
  }
  return fits;
}

/// What each effect promises alone, in its best form.
void Selection::note_ranks(const Alternatives& all, const Score& score) {
  for (const Subset& subset : best_subsets(score.information, score.score(), all.choices, alone(all)))
    note({"ranked",
          names_of(all, subset),
          {{"promised", subset.gain}, {"promised_less_price", subset.merit}},
          subset.merit < worth ? "not worth its parameters" : "may be"});
}

/// From where the linear solution leads to; and, where a size shows only beside another one, as roughness does beside
/// what is matt, once more from half a step of it: where it is off it may have no slope. Nothing where an effect gives
/// no number. @param information of all columns
std::optional<Fit> Selection::fitted_set(const State& from, const Alternatives& all, const Subset& subset,
                                         const Eigen::MatrixXd& information) const {
  constexpr double silent = 1;  // of chi-square, for a whole step
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
      if (information(columns[k], columns[k]) < silent) values(static_cast<Eigen::Index>(k)) = 0.5, differ = true;
    }
    shown = placed(std::move(shown));
    at += count;
  }
  std::optional<Fit> best;
  const auto try_from = [&](State state) {
    try {
      Fit next = fit_roughly_with_maps(problem_, std::move(state), weight_);
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
        if (!free[k].shape && is_off(state) && !is_off(shown)) return true;
      }
    }
    return false;
  };
  if (differ && (!best || stays(best->state))) try_from(shown);
  return best;
}

}  // namespace tofgraph::diagnosis
