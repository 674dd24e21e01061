// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What a search asks of effects outside of the data that they were chosen on, and of the model before it is written.
#include "diagnosis/fold_agreement.hpp"
#include "diagnosis/proof.hpp"
#include "diagnosis/search_steps.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {

void Search::keep_established() { established_ = {kept(), result_.found, result_.refinements}; }

void Search::return_to_established() {
  result_.time_expired = true;
  mutable_problem().deadline = options_.verification;
  restore(established_.kept);
  result_.found = established_.found;
  result_.refinements = established_.refinements;
}

bool Search::follow_folds() {
  for (State& state : agreed_models(result_.cross_fit, best().fit.state, model_.size())) {
    std::vector<std::string> names;
    for (std::size_t t = model_.size(); t < state.terms.size(); ++t) names.push_back(state.terms[t].candidate->name());
    state.light = best().fit.state.light;
    double fall = NAN;
    try {
      Fit there = settled(state);
      fall = bic(best().fit) - bic(there);
      state = std::move(there.state);
    } catch (const simulation::EffectError&) {  // no number on all data
    }
    const bool better = fall > worth && try_refine(std::move(state));
    note({"followed", names, {{"bic_fall", fall}}, better ? "better than what all data led to" : "not better"});
    if (better) return true;
  }
  return false;
}

void Search::verify() {
  say("comparing with the given model");
  mutable_problem().deadline = options_.verification;
  try {
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
  mutable_problem().deadline = {};
}

void Search::hold_given_values() {
  if (!options_.hold_given) return;
  if (std::optional<Fit> held = options_.hold_given(problem(), best().fit)) take(*std::move(held));
}

std::string Search::why_worse() {
  if (terms().empty()) return "";
  result_.verified = compared_with_given(result_.cross_fit, problem(), model_, best().fit.state);
  return result_.verified.why_worse();
}

void Search::drop_least(const std::string& why) {
  result_.not_better = why;
  if (result_.found.empty()) return dismiss_all(why);
  const auto least = std::ranges::min_element(result_.found, {}, &Found::gain);
  const auto f = static_cast<std::size_t>(least - result_.found.begin());
  Found found = std::move(*least);
  result_.found.erase(least);
  found.refutation = why;
  for (Found& other : result_.found) {
    std::erase_if(other.rivals, [&](const Rival& rival) {  // in the place of both
      return std::ranges::find(rival.in_place_of, found.name) != rival.in_place_of.end();
    });
  }
  dismiss({model_.size() + f, std::nullopt}, std::move(found));
  result_.refinements.clear();
}

void Search::keep_given(const std::string& why) {
  for (Found& found : result_.found) {
    found.refutation = why;
    result_.dropped.push_back(std::move(found));
  }
  result_.found.clear();
  result_.refinements.clear();
  restore(begun_);
  mutable_problem().deadline = {};
  return_to_given();
  result_.not_better = why;
  result_.is_given = true;
}

void Search::put_aside() {
  const bool searched = !pieces().empty();
  SearchOptions aside = options_;
  if (!searched) aside.max_effects = 0;
  std::vector<std::vector<std::string>> names;
  for (const Found& found : result_.found) names.push_back(found.names());
  result_.cross_fit = cross_fit(folds_of(problem().design), problem().design, problem().data, model_, candidates_,
                                aside, names, searched ? searched_folds_ : std::vector<FoldResult>{});
  if (searched) searched_folds_ = result_.cross_fit.folds;
}

bool Search::drop_refuted(const std::function<std::string(Found&)>& question) {
  bool changed = false;
  for (std::size_t f = result_.found.size(); f-- > 0;) {
    Found& found = result_.found[f];
    found.refutation = question(found);
    if (found.refutation.empty()) continue;
    dismiss({model_.size() + f, std::nullopt}, std::move(found));
    result_.found.erase(result_.found.begin() + static_cast<std::ptrdiff_t>(f));
    changed = true;
  }
  return changed;
}

bool Search::is_proved(const Piece& piece) const {
  if (piece.refinement || result_.cross_fit.empty()) return false;
  Found found;
  const std::vector<std::string> names = {terms()[piece.term].candidate->name()};
  found.chosen = result_.cross_fit.share_of(names);
  found.fall = fall_of(result_.cross_fit, names, options_.seed);
  return unproved(found).empty();
}

bool Search::prove() {
  if (result_.cross_fit.empty()) return false;
  const bool changed = drop_refuted([&](Found& found) {
    found.chosen = result_.cross_fit.share_of(found.names());
    found.fall = fall_of(result_.cross_fit, found.names(), options_.seed);
    std::string why = unproved(found);
    note({"proved",
          {found.name},
          {{"chosen", found.chosen}, {"chi2_without", found.fall.without}, {"chi2_with", found.fall.with}},
          why.empty() ? "stays" : why});
    return why;
  });
  std::vector<std::string> names;
  for (const Found& found : result_.found) std::ranges::copy(found.names(), std::back_inserter(names));
  const CrossFit::Depth depth = result_.cross_fit.depth_with_only(names);
  std::string why = ruined(depth.before, depth.after, "what was found");
  if (!why.empty() && !depth.alone) why = "most folds chose others beside it, and with these " + why;
  return (!why.empty() && drop_refuted([&](Found& found) -> const std::string& {
           note({"proved", {found.name}, {}, why});
           return why;
         })) ||
         changed;
}

}  // namespace tofgraph::diagnosis
