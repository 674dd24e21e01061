// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/search.hpp"

#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/findings.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// The whole method: run() lists its steps in order.
class Search {
 public:
  Search(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
         const SearchOptions& options, const std::map<std::string, std::string>& refused)
      : findings_(problem, model, candidates, options, refused) {}

  SearchResult run() {
    selection_.begin();
    result_.refitted_given = selection_.best();
    begun_ = selection_.selected();
    try {
      screen();
      selection_.forward_select();
      test();
      cross_fit();
      confirm();
    } catch (const TimeExpired&) {
      return_to_tested();
    }
    compare_with_given_model();
    compare_with_rivals();
    look_at_residual();
    return report();
  }

 private:
  /// A model that passed the tests, with their results.
  struct Tested {
    SelectedModel model;
    std::vector<EffectFinding> found, refinements;
  };

  /// Linearises each candidate about the given model, and locates the gap.
  void screen() {
    selection_.linearise_candidates();
    findings_.trials.prepare(selection_.best().state, selection_.task().refused);
    selection_.task().report_progress("asking where the gap is");
    result_.where = findings_.patterns_of(selection_.best());
  }

  /// Tests on all data until all remaining effects pass; if none remains, selects once more with the nuisances of
  /// conditions, which refuted effects may have imitated.
  /// @returns true if effects were selected again; at most twice, because the new ones may fail each time
  bool test() {
    tests_.run();
    const bool again = selection_.additions().empty() && !result_.dropped.empty() && reselected_ < 2 &&
                       selection_.select_beside_nuisances(true);
    if (again) {
      ++reselected_;
      tests_.run();
    }
    tested_ = Tested{selection_.selected(), result_.found, result_.refinements};
    return again;
  }

  /// Searches again without whole levels of a setting. If most folds agree on a better model, that is tested, too.
  void cross_fit() {
    tests_.cross_fit();
    if (!tests_.follow_folds()) return;
    test();
    tests_.cross_fit();
  }

  /// Drops effects that held-out data do not confirm. The remaining ones are tested again, because dropped effects may
  /// have supported them.
  void confirm() {
    bool dropped = false;
    for (; tests_.drop_unconfirmed(); dropped = true) {
      // New additions must be tested in all folds, because these were searched for the earlier ones.
      if (test() && !selection_.additions().empty() && !result_.cross_fit.complete) tests_.cross_fit();
    }
    if (dropped && (selection_.additions().empty() || !result_.cross_fit.complete)) tests_.cross_fit();
  }

  /// After the time limit: returns to the last model that passed the tests, or if none was tested, to the last one to
  /// which effects had been added.
  void return_to_tested() {
    result_.time_expired = true;
    selection_.set_deadline(options().verification);
    findings_.forget_comparison();
    untested_ = !tested_;
    selection_.select(tested_ ? tested_->model : selection_.reached());
    result_.found = tested_ ? tested_->found : std::vector<EffectFinding>{};
    result_.refinements = tested_ ? tested_->refinements : std::vector<EffectFinding>{};
  }

  /// After the time limit: tests a better set on which most of the searched folds agree, as far as time allows.
  void follow_searched_folds() {
    selection_.set_deadline(options().following);
    try {
      if (tests_.follow_folds()) test();
    } catch (const TimeExpired&) {
      return_to_tested();
    }
    selection_.set_deadline(options().verification);
  }

  /// Drops effects while the model predicts distances worse than the given one. If it still predicts them worse without
  /// any effect, the given values are kept.
  void compare_with_given_model() {
    selection_.task().report_progress("comparing with the given model");
    selection_.set_deadline(options().verification);
    try {
      if (untested_)
        tests_.run();
      else if (result_.time_expired)
        follow_searched_folds();
      while (result_.time_expired && tests_.drop_unconfirmed()) {
      }
      hold_given_values();
      std::string why = why_worse();
      for (; !why.empty() && !selection_.additions().empty(); why = why_worse()) drop_least(why);
      // What remains of a larger model was not tested by the folds.
      const bool remains = !result_.not_better.empty() && !selection_.additions().empty();
      if (why.empty() && remains && result_.verified.grows()) why = result_.not_better;
      if (!why.empty()) keep_given(why);
      if (!result_.not_better.empty() && selection_.terms().empty()) forget_refused();
    } catch (const TimeExpired&) {
      result_.time_expired = true;
      keep_given("the time limit left no time to compare it with the given one");
    }
    selection_.set_deadline({});
  }

  void hold_given_values() {
    GivenModel* const given = options().given;
    if (given == nullptr) return;
    std::optional<ModelFit> held = given->hold_undetermined_in(selection_.problem(), selection_.best());
    if (!held) return;
    selection_.task().given_terms = given->terms();
    findings_.forget_comparison();
    selection_.accept(*std::move(held));
  }

  /// Reason why the best model must not be written, or "".
  std::string why_worse() {
    if (selection_.terms().empty()) return "";
    result_.verified =
        compared_with_given(result_.cross_fit, selection_.problem(), findings_.given_terms(), selection_.best().state);
    return result_.verified.why_worse();
  }

  void drop_least(const std::string& why) {
    result_.not_better = why;
    if (result_.found.empty()) return findings_.drop_all(why);
    const auto least = std::ranges::min_element(result_.found, {}, &EffectFinding::gain);
    least->refutation = why;
    findings_.drop_found(static_cast<std::size_t>(least - result_.found.begin()));
    result_.refinements.clear();
  }

  /// Forgets results of models that are not written: the given one is, as it was.
  void forget_refused() {
    result_.cross_fit = {};
    for (GapComparison* gaps : {&result_.verified.all, &result_.verified.held_out}) gaps->model = gaps->given;
  }

  void keep_given(const std::string& why) {
    for (const ModelTerm& addition : selection_.additions()) {
      const Term& term = selection_.terms()[addition.term];
      result_.dropped.push_back({.candidate = term.candidate, .name = name_of(term, addition), .refutation = why});
    }
    result_.found.clear();
    result_.refinements.clear();
    selection_.select(begun_);
    selection_.set_deadline({});
    selection_.return_to_given();
    result_.not_better = why;
    result_.is_given = true;
    forget_refused();
  }

  /// Compares the written effects with rivals, as far as the time limit allows.
  void compare_with_rivals() {
    selection_.set_deadline(options().comparison);
    try {
      findings_.compare_with_rivals();
    } catch (const TimeExpired&) {
      result_.time_expired = result_.not_compared = true;
    }
    selection_.set_deadline({});
    for (EffectFinding& finding : result_.found) tests_.set_held_out_results(finding);
  }

  /// Lists patterns that no candidate explains, and the candidates closest to them.
  void look_at_residual() {
    const Problem& problem = selection_.problem();
    const ModelFit& best = selection_.best();
    selection_.task().report_progress("looking at what is left");
    PatternScan left = findings_.finder.find(best, options().seed + 1);
    for (Pattern& pattern : left.patterns) {
      if (pattern.significant && pattern.largest > settings.practical_threshold[pattern.observable])
        result_.rest.push_back(std::move(pattern));
    }
    for (std::optional<Pattern> pattern : {unsteady_camera(problem, best), large_smooth_field(problem, best)}) {
      if (pattern) result_.rest.push_back(std::move(*pattern));
    }
    result_.misplaced = misplaced(board_offsets_of(problem, best.state));
    result_.lack_of_fit = left.square / left.freedom;
    result_.freedom = left.freedom;
    result_.structure = parallel_analysis(problem, best.state, options().seed);
    if (!result_.something_left()) return;
    for (const Trial& t : findings_.trials.best(best, nullptr, settings.min_nearest_gain)) {
      const Group group{signature(problem, best.state, t.fit.state, {selection_.terms().size(), std::nullopt})};
      const double fraction = left.most > 0 ? std::min(score_of(problem, best, group).gain / left.most, 1.0) : 1.0;
      if (fraction > settings.min_nearest_fraction) result_.nearest.push_back({t.candidate, fraction});
    }
    std::ranges::stable_sort(result_.nearest, std::greater<>{}, &Near::fraction_of_largest);
  }

  SearchResult report() {
    findings_.report_dropped();
    result_.refused = findings_.trials.refused();
    for (const auto& [name, why] : selection_.task().refused) result_.refused.emplace(name, why);
    result_.after = selection_.best();
    result_.trace = std::move(selection_.task().trace);
    return std::move(result_);
  }

  const SearchOptions& options() const { return findings_.options(); }

  Findings findings_;
  EffectTests tests_{findings_};
  Selection& selection_ = findings_.selection;
  SearchResult& result_ = findings_.result;
  SelectedModel begun_;  ///< before any effect
  std::optional<Tested> tested_;
  bool untested_ = false;  ///< true: the time limit came before the tests
  int reselected_ = 0;
};

}  // namespace

SearchResult search(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
                    const SearchOptions& options) {
  // If a candidate fails where every fit needs it, it is left out and the search starts again.
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
