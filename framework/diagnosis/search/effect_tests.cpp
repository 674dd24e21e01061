// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/findings.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/maps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tofgraph::diagnosis {

namespace {

/// Reason for which the distances refute an effect, or "". @param without, with held-out distance gaps, m
/// @param what name of the removed part
std::string gap_worsened(double without, double with, const char* what) {
  if (!is_gap_worse(without, with)) return "";
  return fmt::format("the distance gap grows on held-out conditions (from {:.2f} mm without {} to {:.2f} mm)",
                     1e3 * without, what, 1e3 * with);
}

/// Reason for which held-out conditions do not confirm an effect, or "".
std::string held_out_failure(const EffectFinding& found, const CrossFit& cross_fit) {
  if (found.improvement.folds_supporting < min_folds_supporting(cross_fit.folds.size()))
    return fmt::format("{:.0f} % of the folds support it", 100 * found.supported);
  if (!found.improvement.is_significant())
    return fmt::format("the gap does not shrink on held-out conditions (chi-square {:.0f}, with it {:.0f})",
                       found.improvement.without, found.improvement.with);
  return gap_worsened(found.improvement.gap_refitted_without, found.improvement.gap_with, "it");
}

}  // namespace

// ---- Tests on all data ----

void EffectTests::run() {
  findings_.forget_comparison();
  do {
    findings_.result.found.clear();
    findings_.result.refinements.clear();
    while (drop_worst_failing()) {
    }
    findings_.selection.refit();
  } while (drop_unidentifiable());
}

/// Tests every addition and drops one that fails; all if the rest is worse than the given model.
/// @returns true if one was dropped, so that the others must be tested again; false if all passed or none is left
bool EffectTests::drop_worst_failing() {
  Selection& selection = findings_.selection;
  const std::vector<ModelTerm> all = selection.additions();
  if (!all.empty() && selection.bic(selection.best()) > selection.bic(selection.refitted_given())) {
    findings_.drop_all("without those that were dropped the model fits worse than before");
    return false;
  }
  std::vector<EffectFinding> tested;
  std::size_t worst = 0;
  // Of those that fail any test, the one that explains the smallest fraction goes first.
  const auto rank = [](const EffectFinding& f) {
    return std::pair(f.refutation.empty(), std::isnan(f.explained_fraction) ? HUGE_VAL : f.explained_fraction);
  };
  const PatternScan with_all = findings_.finder.find(selection.best());
  for (const ModelTerm& addition : all) {
    selection.task().report_progress(fmt::format("checking {}", name_of(selection.terms()[addition.term], addition)));
    EffectFinding now = test_on_all_data(addition, with_all, is_confirmed(addition));
    findings_.note({"questioned",
                    {now.name},
                    {{"gain", now.gain}, {"p_value", now.p_value}, {"capture", now.explained_fraction}},
                    now.refutation.empty() ? "passes" : now.refutation});
    tested.push_back(std::move(now));
    if (rank(tested.back()) < rank(tested[worst])) worst = tested.size() - 1;
  }
  if (!tested.empty() && !tested[worst].refutation.empty()) {
    findings_.drop_with_reason(all[worst], std::move(tested[worst]));
    return true;
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    (all[i].refinement ? findings_.result.refinements : findings_.result.found).push_back(std::move(tested[i]));
  return false;
}

/// Drops the last effect whose values are not identifiable: without it those of another effect may be. If only a
/// nonlinear parameter is unidentifiable, the effect is replaced by others that explain as much, if there are any.
/// @returns true if an effect was dropped or replaced
bool EffectTests::drop_unidentifiable() {
  const ModelFit& best = findings_.best();
  const double rest = lack_of_fit(findings_.problem(), best);
  const std::vector<Interval> all =
      intervals(findings_.problem(), best, findings_.options().seed + 2, rest, Refinements::as_they_are);
  for (std::size_t f = findings_.result.found.size(); f-- > 0;) {
    EffectFinding& finding = findings_.result.found[f];
    const std::size_t term = findings_.given_terms().size() + f;
    const Unidentified unidentified = identifiability_of(best, term, all, rest);
    if (unidentified.why.empty()) continue;
    findings_.note({"valued", {finding.name}, {}, unidentified.why});
    finding.refutation = unidentified.why;
    if (unidentified.nonlinear) {
      if (!unidentified.at_limit && rest < settings.explained)
        finding.undetermined = UndeterminedValue{best.state, term, *unidentified.nonlinear};
      if (findings_.replace_by_others(finding, unidentified)) return true;
    }
    findings_.drop_with_reason({term, std::nullopt}, std::move(finding));
    return true;
  }
  return false;
}

/// Gain of an effect over that of the best generic pattern that it lowers; other residuals, in its observables or in
/// others, do not matter. If everything is explained, the removed share of that pattern's gain, if larger: the pattern
/// has then gained from parameters refitted with the effect. NaN if the effect lowers no pattern.
/// @param less model without it
double EffectTests::explained_fraction(const ModelFit& less, const PatternScan& with_it, double gain) const {
  const PatternScan before = findings_.finder.find(less);
  double most = 0, gone = 0;
  for (std::size_t p = 0; p < before.gains.size(); ++p) {
    const double fall = before.gains[p] - std::max(with_it.gains[p], 0.0);
    if (fall > settings.related_pattern_fall * before.gains[p] && before.gains[p] > most)
      most = before.gains[p], gone = fall;
  }
  if (!(most > 0)) return std::numeric_limits<double>::quiet_NaN();
  return (with_it.is_explained() ? std::max(gain, gone) : gain) / most;
}

/// Probability that any candidate gains as much by chance as one direction does in a model without it. The flipped
/// residual is that of the best model, and includes whatever else is unexplained.
double EffectTests::chance(const ModelFit& less, const Score& score) const {
  ModelFit remaining = findings_.best();
  remaining.state.precomputed = less.state.precomputed;
  remaining.jacobian = less.jacobian;
  const Alternatives& candidates = findings_.selection.alternatives();
  const Score all = score_of(findings_.problem(), remaining, candidates.group);
  std::vector<std::vector<Eigen::Index>> groups;
  for (const Choice& choice : candidates.choices) groups.push_back(choice.columns);
  return chance_of(score, all, groups, findings_.options().seed);
}

/// Tests an addition of the best model against the model without it; the refutation is empty if it passes.
/// @param with_it patterns of the best model @param confirmed true: cross-fitting has confirmed it
EffectFinding EffectTests::test_on_all_data(const ModelTerm& addition, const PatternScan& with_it,
                                            bool confirmed) const {
  const ModelFit &best = findings_.best(), &less = findings_.selection.without(addition);
  const Term& term = best.state.terms[addition.term];
  EffectFinding found;
  found.candidate = term.candidate;
  found.name = name_of(term, addition);
  found.gain = less.deviance - best.deviance;
  const Group group{signature(findings_.problem(), less.state, best.state, addition)};
  // Only the fitted direction: the selection among all directions and candidates is accounted for in chance().
  const Group direction{{group.columns[0]}};
  Score score = term.maps ? score_of_maps(findings_.problem(), less, term, findings_.options().seed)
                          : score_of(findings_.problem(), less, direction, findings_.options().seed);
  const bool nothing_left = with_it.is_explained();
  if (!term.maps) {
    // Flips of its own columns also flip a drift, which grows without the addition. If everything is explained with it,
    // the likelihood compares the two; not with board heights, which are not refitted without the addition.
    const double parameters = static_cast<double>(values_of(term, addition).size());
    const bool sure = nothing_left && !best.state.nuisances.boards &&
                      found.gain - parameters > settings.certain_gain * score.run_length;
    score.p_value = std::max(chance(less, score), sure ? 0.0 : score.p_value);
  }
  found.p_value = score.p_value;
  found.explained_fraction = explained_fraction(less, with_it, score_of(findings_.problem(), less, group).gain);
  if (!(found.gain > 0)) {
    found.refutation = "without it the data are explained as well";
  } else if (score.run_length > 1 && found.gain < settings.min_bic_gain * score.run_length) {
    found.refutation = fmt::format("a residue that stays for {:.0f} conditions may do as much", score.run_length);
  } else if (!confirmed && !significant(score)) {
    found.refutation = fmt::format("chance may do as much (p = {:.3f})", found.p_value);
  } else if (max_normalised_rms(findings_.problem(), group.columns[0]) <= 1 &&
             !(nothing_left && lack_of_fit(findings_.problem(), less) >= settings.explained)) {
    // A small change matters if without it the data are unexplained and with it explained.
    found.refutation = "what it changes is too small to matter";
  } else if (found.explained_fraction <
             (confirmed ? settings.min_explained_fraction_confirmed : settings.min_explained_fraction)) {
    found.refutation =
        fmt::format("it explains {:.0f} % of what a pattern without physics does", 100 * found.explained_fraction);
  } else if (std::isnan(found.explained_fraction) && !nothing_left) {
    found.refutation = "beside what is left it cannot be tested: it lowers no pattern";
  }
  return found;
}

// ---- Tests on held-out data ----

void EffectTests::cross_fit() {
  SearchResult& result = findings_.result;
  const SelectionTask& task = findings_.selection.task();
  const bool searched = !findings_.selection.additions().empty();
  SearchOptions options = task.options;
  if (!searched) options.max_effects = 0;
  const auto ask = [&](bool all_folds = false) {
    std::vector<std::vector<std::string>> names;  // empty: cross-fitting does not end early
    for (const EffectFinding& finding : result.found)
      if (!all_folds) names.push_back(finding.names());
    result.cross_fit =
        diagnosis::cross_fit(folds_of(task.problem.design), task.problem.design, task.problem.data, task.given_terms,
                             task.candidates, options, names, searched ? searched_folds_ : std::vector<FoldResult>{},
                             searched ? &findings_.best().state : nullptr);
    if (result.cross_fit.time_expired) throw TimeExpired();
    if (searched) searched_folds_ = result.cross_fit.folds;
  };
  if (searched) compare_folds(searched_folds_);
  ask();
  if (result.cross_fit.complete) return;
  if (agree_on_more(result.cross_fit, findings_.best().state, findings_.given_terms().size())) return ask(true);
  if (findings_.are_compared() || result.found.empty()) return;
  findings_.compare_with_rivals();  // folds without an effect may have chosen a rival
  ask();
}

/// Compares folds with the present model.
void EffectTests::compare_folds(std::span<FoldResult> folds) const {
  const SelectionTask& task = findings_.selection.task();
  SearchOptions options = task.options;
  if (findings_.result.time_expired) options.deadline = options.following;
  diagnosis::compare_folds(folds, task.problem.design, task.problem.data, task.given_terms, task.candidates, options,
                           findings_.best().state);
}

bool EffectTests::follow_folds() {
  Selection& selection = findings_.selection;
  const std::size_t given = findings_.given_terms().size();
  for (State& state : models_with_agreed_effects(findings_.result.cross_fit, selection.best().state, given)) {
    const std::vector<std::string> names = added_effects(state, given);
    const auto [bic_fall, better] = selection.take_if_better(std::move(state));
    findings_.note(
        {"followed", names, {{"bic_fall", bic_fall}}, better ? "better than what all data led to" : "not better"});
    if (!better) continue;
    compare_folds(findings_.result.cross_fit.folds);
    return true;
  }
  return false;
}

void EffectTests::set_held_out_results(EffectFinding& finding) const {
  const CrossFit& cross_fit = findings_.result.cross_fit;
  if (cross_fit.empty()) return;
  finding.supported = cross_fit.supporting_fraction(finding.names());
  finding.improvement = held_out_improvement_of(cross_fit, finding.names(), findings_.options().seed);
}

/// True if folds have confirmed an effect: if these led to the model, its predictions have been tested.
bool EffectTests::is_confirmed(const ModelTerm& addition) const {
  if (addition.refinement || findings_.result.cross_fit.empty()) return false;
  EffectFinding finding{.name = findings_.selection.terms()[addition.term].candidate->name()};
  set_held_out_results(finding);
  return held_out_failure(finding, findings_.result.cross_fit).empty();
}

/// True if held-out data confirm all effects found, by their present names.
bool EffectTests::all_confirmed() const {
  const bool each = std::ranges::all_of(findings_.result.found, [&](EffectFinding finding) {
    set_held_out_results(finding);
    return held_out_failure(finding, findings_.result.cross_fit).empty();
  });
  return each && why_not_together().empty();
}

/// Reason why the effects found do not pass together, or "".
std::string EffectTests::why_not_together() const {
  std::vector<std::string> names;
  for (const EffectFinding& finding : findings_.result.found)
    std::ranges::copy(finding.names(), std::back_inserter(names));
  const auto [gap, alone] = findings_.result.cross_fit.gap_with_only(names);
  const std::string why = gap_worsened(gap.before, gap.after, "what was found");
  return why.empty() || alone ? why : "most folds chose others beside it, and with these " + why;
}

/// Compares effects with rivals that folds may have chosen in their place; after the time limit only those effects that
/// too few folds chose, with what these chose.
void EffectTests::compare_unconfirmed() {
  SearchResult& result = findings_.result;
  if (!result.time_expired) return findings_.compare_with_rivals();
  for (std::size_t f = 0; f < result.found.size(); ++f) {
    set_held_out_results(result.found[f]);
    if (result.found[f].improvement.folds_supporting >= min_folds_supporting(result.cross_fit.folds.size())) continue;
    findings_.compare_with_choices_of_folds(findings_.given_terms().size() + f);
  }
}

bool EffectTests::drop_unconfirmed() {
  if (findings_.result.cross_fit.empty()) return false;
  if (!all_confirmed()) compare_unconfirmed();
  const bool changed = findings_.drop_refuted([&](EffectFinding& finding) {
    set_held_out_results(finding);
    std::string why = held_out_failure(finding, findings_.result.cross_fit);
    findings_.note({"proved",
                    {finding.name},
                    {{"chosen", finding.supported},
                     {"chi2_without", finding.improvement.without},
                     {"chi2_with", finding.improvement.with}},
                    why.empty() ? "stays" : why});
    return why;
  });
  const std::string why = why_not_together();
  const auto refute = [&](EffectFinding& finding) -> const std::string& {
    findings_.note({"proved", {finding.name}, {}, why});
    return why;
  };
  return (!why.empty() && findings_.drop_refuted(refute)) || changed;
}

}  // namespace tofgraph::diagnosis
