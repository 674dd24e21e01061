// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Effects selected by a search and their tests: effects are dropped one by one, with reasons.
#pragma once

#include "diagnosis/model/intervals.hpp"
#include "diagnosis/search/rivals.hpp"
#include "diagnosis/search/search.hpp"
#include "diagnosis/search/selection.hpp"

#include <functional>
#include <span>

namespace tofgraph::diagnosis {

/// Findings and tools shared by all tests of a search.
class Findings {
 public:
  Findings(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
           const SearchOptions& options, const std::map<std::string, std::string>& refused);

  Selection selection;
  PatternFinder finder;
  Trials trials;
  SearchResult result;

  const std::vector<Term>& given_terms() const { return selection.task().given_terms; }
  const SearchOptions& options() const { return selection.task().options; }
  const Problem& problem() const { return selection.problem(); }
  const ModelFit& best() const { return selection.best(); }
  void note(Step step) { selection.task().note(std::move(step)); }

  /// Significant patterns of the gap that a model leaves.
  std::vector<Pattern> patterns_of(const ModelFit& fit) const;
  /// Removes an addition from the model. Replaces an earlier reason for the same effect.
  void drop_with_reason(const ModelTerm& addition, EffectFinding finding);
  /// Removes an added effect that was refuted. @param f its index in the result
  void drop_found(std::size_t f);
  /// Removes all additions from the model.
  void drop_all(const std::string& why);
  /// Drops the effects that a test refutes. @returns true if an effect was dropped
  bool drop_refuted(const std::function<std::string(EffectFinding&)>& test);
  /// Replaces an effect with an unidentifiable nonlinear parameter by others, if these explain as much.
  /// @returns true if they do
  bool replace_by_others(EffectFinding finding, const Unidentified& why);

  /// Compares each effect with its rivals, once; again after an effect was dropped.
  void compare_with_rivals();
  /// Compares one effect only with those of its confusable effects that folds chose in its place.
  void compare_with_choices_of_folds(std::size_t term);
  bool are_compared() const { return compared_; }
  /// Requests another comparison of the effects with their rivals.
  void forget_comparison() { compared_ = false; }
  /// Adds dropped effects to the result, except those that were selected again.
  void report_dropped();

 private:
  /// An effect with a nonlinear parameter that is unidentifiable or at its limit, and the set that explains as much.
  struct Replaced {
    EffectFinding finding;
    ModelFit fit;  ///< model with the effect
    Unidentified unidentified;
    std::vector<std::string> by;

    const std::string& name() const { return finding.name; }
  };

  bool simplify(const Candidate& form);
  void compare(std::size_t term);
  bool stays_replaced(const Replaced& replaced) const;

  Rivals rivals_;
  std::vector<Replaced> replaced_;
  bool compared_ = false;
};

// ---- Tests of effects, on the data that they were selected on and on held-out data ----

/// A new test of an effect is one more condition in test_on_all_data() (all data) or in held_out_failure() (held-out
/// data).
class EffectTests {
 public:
  /// @param findings must outlive this object
  explicit EffectTests(Findings& findings) : findings_(findings) {}

  /// Tests every addition on all data and drops the worst failing one, repeatedly until all pass; then drops effects
  /// whose values are not identifiable.
  void run();

  /// Cross-fits. If nothing is named, the model stays unchanged and predicts held-out conditions as it is. The
  /// selection in a fold does not depend on the tested effects, so folds are never searched twice. All folds are
  /// searched if they agree on an effect that the model lacks, see follow_folds().
  void cross_fit();
  /// Fits to all data the sets of folds that contain an effect which most folds chose and the model lacks, until one is
  /// better, with which the folds are then compared. @returns true if one was accepted
  bool follow_folds();
  /// Drops effects that held-out data do not confirm, each alone; those that pass alone must also pass together, in the
  /// folds that chose nothing else if these are the majority; if they fail together, all are dropped.
  /// @returns true if an effect was dropped
  bool drop_unconfirmed();
  /// Sets a finding's share of folds and improvement on held-out data, from all its names.
  void set_held_out_results(EffectFinding& finding) const;

 private:
  EffectFinding test_on_all_data(const ModelTerm& addition, const PatternScan& with_it, bool confirmed) const;
  double explained_fraction(const ModelFit& less, const PatternScan& with_it, double gain) const;
  double chance(const ModelFit& less, const Score& score) const;
  bool drop_worst_failing();
  bool drop_unidentifiable();
  bool is_confirmed(const ModelTerm& addition) const;
  bool all_confirmed() const;
  void compare_folds(std::span<FoldResult> folds) const;
  void compare_unconfirmed();
  std::string why_not_together() const;

  Findings& findings_;
  std::vector<FoldResult> searched_folds_;
};

}  // namespace tofgraph::diagnosis
