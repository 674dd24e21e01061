// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/search_steps.hpp"

#include "diagnosis/model/contribution.hpp"
#include "diagnosis/model/residual_structure.hpp"
#include "diagnosis/model/validation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace tofgraph::diagnosis {
namespace {}  // namespace

SearchResult Search::run() {
  begin();
  result_.before = best();
  begun_ = kept();
  try {
    find();
  } catch (const TimeExpired&) {
    return_to_established();
  }
  verify();
  compare();
  look_at_rest();
  for (StoodFor& stood : stood_for_)
    if (!stands(stood)) result_.dropped.push_back(std::move(stood.found));
  std::erase_if(result_.dropped, [&](const EffectFinding& tried) {  // what came back is not what was dropped
    const auto is = [&](const EffectFinding& one) { return one.name == tried.name; };
    return std::ranges::any_of(result_.found, is) || std::ranges::any_of(result_.refinements, is);
  });
  result_.refused = trials_.refused();
  for (const auto& [name, why] : refused()) result_.refused.emplace(name, why);
  result_.after = best();
  result_.trace = take_trace();
  return std::move(result_);
}

void Search::find() {
  linearise();
  trials_.prepare(best().state, refused());
  report_progress("asking where the gap is");
  result_.where = patterns_of(best());
  forward_select();
  establish();
  put_aside();
  if (follow_folds()) {
    establish();
    put_aside();
  }
  bool dropped = false;
  for (; prove(); dropped = true) {
    // What was added has to be asked in all folds: these were searched whatever was found in all conditions.
    if (establish() && !pieces().empty() && !result_.cross_fit.complete) put_aside();
  }
  if (dropped && (pieces().empty() || !result_.cross_fit.complete)) put_aside();
}

std::vector<Pattern> Search::patterns_of(const ModelFit& base) {
  return finder_.find(problem(), base, options_.flips, options_.seed + 1).patterns;
}

void Search::dismiss(const ModelTerm& piece, EffectFinding found) {
  report_progress(fmt::format("dropping {}", found.name));
  described_ = false;
  drop(piece);
  std::erase_if(result_.dropped,
                [&](const EffectFinding& one) { return one.name == found.name; });  // the last reason counts
  result_.dropped.push_back(std::move(found));
}

void Search::dismiss_all(const std::string& why) {
  for (std::vector<ModelTerm> left = pieces(); !left.empty(); left = pieces()) {
    const Term& term = terms()[left.back().term];
    EffectFinding found{.candidate = term.candidate, .name = name_of(term, left.back()), .refutation = why};
    note({"questioned", {found.name}, {}, why});
    dismiss(left.back(), std::move(found));
  }
}

bool Search::confirm() {
  const std::vector<ModelTerm> all = pieces();
  if (!all.empty() && bic(best()) > bic(original())) {
    dismiss_all("without those that were dropped it explains less than nothing");
    return true;
  }
  std::vector<EffectFinding> found;
  std::size_t worst = 0;
  const auto rank = [](const EffectFinding& f) {
    return std::pair(f.refutation.empty(), std::isnan(f.explained_fraction) ? HUGE_VAL : f.explained_fraction);
  };
  const PatternScan left = finder_.find(problem(), best(), 0, 0);
  for (const ModelTerm& piece : all) {
    report_progress(fmt::format("checking {}", name_of(terms()[piece.term], piece)));
    found.push_back(gates_.evaluate_term(best(), without(piece), left, piece, is_proved(piece)));
    if (found.back().refutation.empty() && std::isnan(found.back().explained_fraction) &&
        left.square > settings.explained * left.freedom)
      found.back().refutation = "beside what is left it cannot be tested: it lowers no pattern";
    const EffectFinding& now = found.back();
    note({"questioned",
          {now.name},
          {{"gain", now.gain}, {"p_value", now.p_value}, {"capture", now.explained_fraction}},
          now.refutation.empty() ? "passes" : now.refutation});
    if (rank(found.back()) < rank(found[worst])) worst = found.size() - 1;
  }
  if (!found.empty() && !found[worst].refutation.empty()) {
    dismiss(all[worst], std::move(found[worst]));
    return false;
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    (all[i].refinement ? result_.refinements : result_.found).push_back(std::move(found[i]));
  return true;
}

bool Search::establish() {
  confirm_all();
  const bool again = pieces().empty() && !result_.dropped.empty() && regrown_ < 2 && select_beside_nuisances(true);
  if (again) {
    ++regrown_;
    confirm_all();
  }
  keep_established();
  return again;
}

void Search::confirm_all() {
  described_ = false;
  do {
    result_.found.clear();
    result_.refinements.clear();
    while (!confirm()) {
    }
    refit();
  } while (require_told());
}

bool Search::require_told() {
  const double rest = lack_of_fit(problem(), best());
  const std::vector<Interval> all = intervals(problem(), best(), options_.seed + 2, rest, Refinements::as_they_are);
  for (std::size_t f = result_.found.size(); f-- > 0;) {
    EffectFinding& found = result_.found[f];
    const Unidentified unidentified = identifiability_of(best(), model_.size() + f, all, rest);
    if (unidentified.why.empty()) continue;
    note({"valued", {found.name}, {}, unidentified.why});
    found.refutation = unidentified.why;
    const bool fits = unidentified.nonlinear && rest < settings.explained;
    if (fits && !unidentified.at_limit) found.untold = Untold{best().state, model_.size() + f, *unidentified.nonlinear};
    if ((fits || unidentified.at_limit) && stand_in_for({found, best(), unidentified, {}})) return true;
    dismiss({model_.size() + f, std::nullopt}, std::move(found));
    return true;
  }
  return false;
}

bool Search::stand_in_for(StoodFor stood) {
  report_progress(fmt::format("looking for others in the place of {}", stood.name()));
  const bool found = exchange(*stood.found.candidate);
  for (const Term& term : terms())
    if (!is_in(stood.fit.state, *term.candidate)) stood.by.push_back(term.candidate->name());
  note({"exchanged",
        found ? stood.by : std::vector{stood.name()},
        {{"bic_rise", found ? bic(best()) - bic(stood.fit) : NAN}},
        found ? "as good as " + stood.name() : "others do not explain as much: all stays as it was"});
  if (found) stood_for_.push_back(std::move(stood));
  return found;
}

void Search::describe_all() {
  if (described_) return;
  for (std::size_t t = model_.size(); t < terms().size(); ++t) describe(t);
  rivals_.add_of_several(result_.found, model_.size());
  described_ = true;
}

void Search::describe(std::size_t t) {
  EffectFinding& found = result_.found[t - model_.size()];
  report_progress(fmt::format("comparing {} with its rivals", found.name));
  const ModelFit& less = without({t, std::nullopt});
  found.where = patterns_of(less);
  found.rivals = rivals_.of(found, t);
  for (const StoodFor& stood : stood_for_) {
    if (!stands(stood) || std::ranges::find(stood.by, found.name) == stood.by.end()) continue;
    const Candidate* const other = &stood.found.candidate->root();
    std::erase_if(found.rivals, [&](const Rival& rival) { return rival.candidate == other; });
    found.rivals.insert(found.rivals.begin(),
                        {other, stood.by, stood.fit.deviance - best().deviance, bic(stood.fit) - bic(best()),
                         !stood.unidentified.at_limit, stood.fit.state, stood.unidentified.nonlinear,
                         stood.unidentified.at_limit ? stood.unidentified.why : ""});
  }
}

void Search::look_at_rest() {
  report_progress("looking at what is left");
  PatternScan left = finder_.find(problem(), best(), options_.flips, options_.seed + 1);
  for (Pattern& pattern : left.patterns) {
    if (pattern.significant && pattern.largest > settings.practical_threshold[pattern.observable])
      result_.rest.push_back(std::move(pattern));
  }
  for (std::optional<Pattern> pattern :
       {unsteady_camera(problem(), best(), weight()), large_smooth_field(problem(), best())}) {
    if (pattern) result_.rest.push_back(std::move(*pattern));
  }
  result_.misplaced = misplaced(board_offsets_of(problem(), best().state));
  result_.lack_of_fit = left.square / left.freedom;
  result_.freedom = left.freedom;
  result_.structure = parallel_analysis(problem(), best().state, options_.seed);
  if (!result_.something_left()) return;
  for (const Trial& t : trials_.best(best(), nullptr, settings.min_nearest_gain)) {
    const Group group{t.candidate->name(),
                      signature(problem(), best().state, t.fit.state, {terms().size(), std::nullopt})};
    const double explained_fraction = std::min(gates_.explained_fraction(best(), group), 1.0);
    if (explained_fraction > settings.min_nearest_fraction)
      result_.nearest.push_back({t.candidate, explained_fraction});
  }
  std::ranges::stable_sort(result_.nearest, std::greater<>{}, &Near::explained_fraction);
}

bool Search::stands(const StoodFor& stood) const {
  return beside_the_same(best().state, stood.by, stood.fit.state, stood.name());
}

SearchResult search(const Problem& problem, const std::vector<Term>& model,
                    const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options) {
  // A candidate that fails where no fit can do without it is left out, and the search begins anew.
  std::map<std::string, std::string> refused;
  for (;;) {
    try {
      return Search(problem, model, candidates, options, refused).run();
    } catch (const simulation::EffectError& error) {
      const bool one_of_them =
          std::ranges::any_of(candidates, [&](const auto& candidate) { return candidate->name() == error.effect; });
      if (!one_of_them || !refused.emplace(error.effect, error.what()).second) throw;
    }
  }
}

}  // namespace tofgraph::diagnosis
