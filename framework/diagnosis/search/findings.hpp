// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Effects selected by a search, while they are tested: they are dropped one by one, with reasons.
#pragma once

#include "diagnosis/model/intervals.hpp"
#include "diagnosis/search/rivals.hpp"
#include "diagnosis/search/search.hpp"
#include "diagnosis/search/selection.hpp"

#include <functional>

namespace tofgraph::diagnosis {

/// Findings and tools shared by all tests of a search.
class Findings {
 public:
  Findings(const Problem& problem, const std::vector<Term>& model,
           const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options,
           const std::map<std::string, std::string>& refused);

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

  void compare(std::size_t term);
  bool stays_replaced(const Replaced& replaced) const;

  Rivals rivals_;
  std::vector<Replaced> replaced_;
  bool compared_ = false;
};

}  // namespace tofgraph::diagnosis
