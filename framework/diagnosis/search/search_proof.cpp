// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What a search asks of effects outside of the data that they were chosen on, and of the model before it is written.
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/fold_agreement.hpp"
#include "diagnosis/search/held_out_test.hpp"
#include "diagnosis/search/search_steps.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {

void Search::keep_established() { established_ = Established{kept(), result_.found, result_.refinements}; }

void Search::return_to_established() {
  result_.time_expired = true;
  set_deadline(options_.verification);
  described_ = false;
  unconfirmed_ = !established_;
  restore(established_ ? established_->kept : reached());
  result_.found = established_ ? established_->found : std::vector<EffectFinding>{};
  result_.refinements = established_ ? established_->refinements : std::vector<EffectFinding>{};
}

bool Search::follow_folds() {
  for (State& state : agreed_models(result_.cross_fit, best().state, model_.size())) {
    std::vector<std::string> names;
    for (std::size_t t = model_.size(); t < state.terms.size(); ++t) names.push_back(state.terms[t].candidate->name());
    state.log_reflectivity = best().state.log_reflectivity;
    double bic_fall = NAN;
    try {
      ModelFit there = refitted(state);
      bic_fall = bic(best()) - bic(there);
      state = std::move(there.state);
    } catch (const simulation::EffectError&) {  // no number on all data
    }
    const bool better = bic_fall > settings.min_bic_gain && try_refine(std::move(state));
    note({"followed", names, {{"bic_fall", bic_fall}}, better ? "better than what all data led to" : "not better"});
    if (better) return true;
  }
  return false;
}

void Search::verify() {
  report_progress("comparing with the given model");
  set_deadline(options_.verification);
  try {
    if (unconfirmed_) confirm_all();
    while (result_.time_expired && prove()) {
    }
    hold_given_values();
    std::string why = why_worse();
    for (; !why.empty() && !pieces().empty(); why = why_worse()) drop_least(why);
    if (!why.empty()) keep_given(why);
  } catch (const TimeExpired&) {
    result_.time_expired = true;
    keep_given("the time limit left no time to compare it with the given one");
  }
  set_deadline({});
}

void Search::hold_given_values() {
  if (!options_.hold_given) return;
  if (std::optional<ModelFit> held = options_.hold_given(problem(), best())) {
    described_ = false;
    accept(*std::move(held));
  }
}

void Search::compare() {
  set_deadline(options_.comparison);
  try {
    describe_all();
  } catch (const TimeExpired&) {
    result_.time_expired = result_.not_compared = true;
  }
  set_deadline({});
  for (EffectFinding& found : result_.found) weigh(found);
}

std::string Search::why_worse() {
  if (terms().empty()) return "";
  result_.verified = compared_with_given(result_.cross_fit, problem(), model_, best().state);
  return result_.verified.why_worse();
}

void Search::drop_least(const std::string& why) {
  result_.not_better = why;
  if (result_.found.empty()) return dismiss_all(why);
  const auto least = std::ranges::min_element(result_.found, {}, &EffectFinding::gain);
  const auto f = static_cast<std::size_t>(least - result_.found.begin());
  EffectFinding found = std::move(*least);
  result_.found.erase(least);
  found.refutation = why;
  dismiss({model_.size() + f, std::nullopt}, std::move(found));
  result_.refinements.clear();
}

void Search::keep_given(const std::string& why) {
  for (const ModelTerm& piece : pieces()) {
    const Term& term = terms()[piece.term];
    result_.dropped.push_back({.candidate = term.candidate, .name = name_of(term, piece), .refutation = why});
  }
  result_.found.clear();
  result_.refinements.clear();
  restore(begun_);
  set_deadline({});
  return_to_given();
  result_.not_better = why;
  result_.is_given = true;
}

void Search::put_aside() {
  const bool searched = !pieces().empty();
  SearchOptions aside = options_;
  if (!searched) aside.max_effects = 0;
  const auto ask = [&] {
    std::vector<std::vector<std::string>> names;
    for (const EffectFinding& found : result_.found) names.push_back(found.names());
    result_.cross_fit = cross_fit(folds_of(problem().design), problem().design, problem().data, model_, candidates_,
                                  aside, names, searched ? searched_folds_ : std::vector<FoldResult>{});
    if (result_.cross_fit.time_expired) throw TimeExpired();
    if (searched) searched_folds_ = result_.cross_fit.folds;
  };
  ask();
  if (result_.cross_fit.complete || described_ || result_.found.empty()) return;
  describe_all();  // what folds did without they may have by another name
  ask();
}

bool Search::drop_refuted(const std::function<std::string(EffectFinding&)>& question) {
  bool changed = false;
  for (std::size_t f = result_.found.size(); f-- > 0;) {
    EffectFinding& found = result_.found[f];
    found.refutation = question(found);
    if (found.refutation.empty()) continue;
    dismiss({model_.size() + f, std::nullopt}, std::move(found));
    result_.found.erase(result_.found.begin() + static_cast<std::ptrdiff_t>(f));
    changed = true;
  }
  return changed;
}

void Search::weigh(EffectFinding& found) const {
  if (result_.cross_fit.empty()) return;
  found.chosen = result_.cross_fit.condition_gram_of(found.names());
  found.improvement = held_out_improvement_of(result_.cross_fit, found.names(), options_.seed);
}

bool Search::is_proved(const ModelTerm& piece) const {
  if (piece.refinement || result_.cross_fit.empty()) return false;
  EffectFinding found{.name = terms()[piece.term].candidate->name()};
  weigh(found);
  return held_out_failure(found).empty();
}

bool Search::all_proved() {
  const bool each = std::ranges::all_of(result_.found, [&](EffectFinding& found) {
    weigh(found);
    return held_out_failure(found).empty();
  });
  return each && why_not_together().empty();
}

std::string Search::why_not_together() const {
  std::vector<std::string> names;
  for (const EffectFinding& found : result_.found) std::ranges::copy(found.names(), std::back_inserter(names));
  const CrossFit::Depth depth = result_.cross_fit.depth_with_only(names);
  const std::string why = gap_worsened(depth.before, depth.after, "what was found");
  return why.empty() || depth.alone ? why : "most folds chose others beside it, and with these " + why;
}

bool Search::prove() {
  if (result_.cross_fit.empty()) return false;
  if (!result_.time_expired && !all_proved()) describe_all();
  const bool changed = drop_refuted([&](EffectFinding& found) {
    weigh(found);
    std::string why = held_out_failure(found);
    note(
        {"proved",
         {found.name},
         {{"chosen", found.chosen}, {"chi2_without", found.improvement.without}, {"chi2_with", found.improvement.with}},
         why.empty() ? "stays" : why});
    return why;
  });
  const std::string why = why_not_together();
  return (!why.empty() && drop_refuted([&](EffectFinding& found) -> const std::string& {
           note({"proved", {found.name}, {}, why});
           return why;
         })) ||
         changed;
}

}  // namespace tofgraph::diagnosis
