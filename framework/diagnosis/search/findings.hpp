// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Effects selected by a search, while they are tested: they are dropped one by one, with reasons; and their
/// rivals.
#pragma once

#include "diagnosis/model/intervals.hpp"
#include "diagnosis/search/search.hpp"
#include "diagnosis/search/selection.hpp"

#include <functional>

namespace tofgraph::diagnosis {

// ---- Rivals of effects that were found: of one, or of several together ----

class Rivals {
 public:
  /// @param selection this and the other arguments must outlive this object
  Rivals(Selection& selection, const Trials& trials, const std::vector<std::unique_ptr<Candidate>>& candidates,
         std::uint64_t seed)
      : selection_(selection), problem_(selection.problem()), trials_(trials), candidates_(candidates), seed_(seed) {}

  /// Rivals of a term that was found, best first.
  std::vector<Rival> of(const EffectFinding& found, std::size_t term);
  /// Adds single effects that cannot be distinguished from several found together: each becomes a rival of all that it
  /// replaces, and no effect has two such rivals. @param first_term index of the first found term
  void add_of_several(std::vector<EffectFinding>& all, std::size_t first_term);

 private:
  std::optional<Rival> compared(const ModelFit& less, const Candidate& candidate, std::vector<std::string> in_place_of,
                                ModelFit fit);
  std::optional<Rival> in_place_of_all(const Candidate& candidate, const std::vector<std::size_t>& terms);
  Unidentified nonlinear_identifiability(const ModelFit& fit, const Candidate& candidate) const;
  std::string limit_reached(const ModelFit& fit, const Candidate& candidate) const;

  Selection& selection_;
  const Problem& problem_;
  const Trials& trials_;
  const std::vector<std::unique_ptr<Candidate>>& candidates_;
  std::uint64_t seed_;
};

// ---- Effects selected by a search, while they are tested ----

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

  const std::vector<Term>& model() const { return selection.task().model; }
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
