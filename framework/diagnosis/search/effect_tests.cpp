// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/effect_tests.hpp"

#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/held_out_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {

EffectTests::EffectTests(Findings& findings)
    : findings_(findings),
      gates_(findings.problem(), findings.finder, findings.selection.alternatives(), findings.options().flips,
             findings.options().seed) {}

// ---- on all data ----

void EffectTests::run() {
  findings_.forget_comparison();
  do {
    findings_.result.found.clear();
    findings_.result.refinements.clear();
    while (!gate_once()) {
    }
    findings_.selection.refit();
  } while (drop_unidentifiable());
}

/// @returns whether all passed
bool EffectTests::gate_once() {
  Selection& selection = findings_.selection;
  const std::vector<ModelTerm> all = selection.additions();
  if (!all.empty() && selection.bic(selection.best()) > selection.bic(selection.original())) {
    findings_.dismiss_all("without those that were dropped it explains less than nothing");
    return true;
  }
  std::vector<EffectFinding> tested;
  std::size_t worst = 0;
  const auto rank = [](const EffectFinding& f) {
    return std::pair(f.refutation.empty(), std::isnan(f.explained_fraction) ? HUGE_VAL : f.explained_fraction);
  };
  const PatternScan left = findings_.finder.find(selection.problem(), selection.best(), 0, 0);
  for (const ModelTerm& addition : all) {
    selection.task().report_progress(fmt::format("checking {}", name_of(selection.terms()[addition.term], addition)));
    EffectFinding now =
        gates_.evaluate_term(selection.best(), selection.without(addition), left, addition, is_confirmed(addition));
    findings_.note({"questioned",
                    {now.name},
                    {{"gain", now.gain}, {"p_value", now.p_value}, {"capture", now.explained_fraction}},
                    now.refutation.empty() ? "passes" : now.refutation});
    tested.push_back(std::move(now));
    if (rank(tested.back()) < rank(tested[worst])) worst = tested.size() - 1;
  }
  if (!tested.empty() && !tested[worst].refutation.empty()) {
    findings_.dismiss(all[worst], std::move(tested[worst]));
    return false;
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    (all[i].refinement ? findings_.result.refinements : findings_.result.found).push_back(std::move(tested[i]));
  return true;
}

/// Drops the last effect whose values are not identifiable: without it those of another one may be. Where all that is
/// wrong with it is a nonlinear parameter, it is one of those that others cannot be distinguished from, if these
/// explain as much. @returns whether there was such a one
bool EffectTests::drop_unidentifiable() {
  const ModelFit& best = findings_.best();
  const double rest = lack_of_fit(findings_.problem(), best);
  const std::vector<Interval> all =
      intervals(findings_.problem(), best, findings_.options().seed + 2, rest, Refinements::as_they_are);
  for (std::size_t f = findings_.result.found.size(); f-- > 0;) {
    EffectFinding& finding = findings_.result.found[f];
    const std::size_t term = findings_.model().size() + f;
    const Unidentified unidentified = identifiability_of(best, term, all, rest);
    if (unidentified.why.empty()) continue;
    findings_.note({"valued", {finding.name}, {}, unidentified.why});
    finding.refutation = unidentified.why;
    if (unidentified.nonlinear) {
      if (!unidentified.at_limit && rest < settings.explained)
        finding.untold = Untold{best.state, term, *unidentified.nonlinear};
      if (findings_.replace_by_others(finding, unidentified)) return true;
    }
    findings_.dismiss({term, std::nullopt}, std::move(finding));
    return true;
  }
  return false;
}

// ---- on held-out data ----

void EffectTests::cross_fit() {
  SearchResult& result = findings_.result;
  const SelectionTask& task = findings_.selection.task();
  const bool searched = !findings_.selection.additions().empty();
  SearchOptions options = task.options;
  if (!searched) options.max_effects = 0;
  const auto ask = [&] {
    std::vector<std::vector<std::string>> names;
    for (const EffectFinding& finding : result.found) names.push_back(finding.names());
    result.cross_fit =
        diagnosis::cross_fit(folds_of(task.problem.design), task.problem.design, task.problem.data, task.model,
                             task.candidates, options, names, searched ? searched_folds_ : std::vector<FoldResult>{});
    if (result.cross_fit.time_expired) throw TimeExpired();
    if (searched) searched_folds_ = result.cross_fit.folds;
  };
  ask();
  if (result.cross_fit.complete || findings_.are_compared() || result.found.empty()) return;
  findings_.compare_with_rivals();  // what folds did without they may have by another name
  ask();
}

bool EffectTests::follow_folds() {
  Selection& selection = findings_.selection;
  const std::size_t given = findings_.model().size();
  for (State& state : agreed_models(findings_.result.cross_fit, selection.best().state, given)) {
    std::vector<std::string> names;
    for (std::size_t t = given; t < state.terms.size(); ++t) names.push_back(state.terms[t].candidate->name());
    state.log_reflectivity = selection.best().state.log_reflectivity;
    double bic_fall = NAN;
    try {
      ModelFit there = selection.refitted(state);
      bic_fall = selection.bic(selection.best()) - selection.bic(there);
      state = std::move(there.state);
    } catch (const simulation::EffectError&) {  // no number on all data
    }
    const bool better = bic_fall > settings.min_bic_gain && selection.try_accept(std::move(state));
    findings_.note(
        {"followed", names, {{"bic_fall", bic_fall}}, better ? "better than what all data led to" : "not better"});
    if (better) return true;
  }
  return false;
}

void EffectTests::weigh(EffectFinding& finding) const {
  const CrossFit& cross_fit = findings_.result.cross_fit;
  if (cross_fit.empty()) return;
  finding.chosen = cross_fit.chosen_fraction(finding.names());
  finding.improvement = held_out_improvement_of(cross_fit, finding.names(), findings_.options().seed);
}

/// True if folds confirmed an effect already: where these led to a model, its predictions have been tested.
bool EffectTests::is_confirmed(const ModelTerm& addition) const {
  if (addition.refinement || findings_.result.cross_fit.empty()) return false;
  EffectFinding finding{.name = findings_.selection.terms()[addition.term].candidate->name()};
  weigh(finding);
  return held_out_failure(finding).empty();
}

/// True if all that was found is confirmed on held-out data by the names that it has.
bool EffectTests::all_confirmed() {
  const bool each = std::ranges::all_of(findings_.result.found, [&](EffectFinding& finding) {
    weigh(finding);
    return held_out_failure(finding).empty();
  });
  return each && why_not_together().empty();
}

/// Why what was found does not pass together, or nothing.
std::string EffectTests::why_not_together() const {
  std::vector<std::string> names;
  for (const EffectFinding& finding : findings_.result.found)
    std::ranges::copy(finding.names(), std::back_inserter(names));
  const CrossFit::Depth depth = findings_.result.cross_fit.depth_with_only(names);
  const std::string why = gap_worsened(depth.before, depth.after, "what was found");
  return why.empty() || depth.alone ? why : "most folds chose others beside it, and with these " + why;
}

bool EffectTests::drop_unconfirmed() {
  if (findings_.result.cross_fit.empty()) return false;
  if (!findings_.result.time_expired && !all_confirmed()) findings_.compare_with_rivals();
  const bool changed = findings_.drop_refuted([&](EffectFinding& finding) {
    weigh(finding);
    std::string why = held_out_failure(finding);
    findings_.note({"proved",
                    {finding.name},
                    {{"chosen", finding.chosen},
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
