// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Effects that a search has selected, while they are tested: one by one they are dropped, with the reason; and
/// their rivals.
#pragma once

#include "diagnosis/model/intervals.hpp"
#include "diagnosis/search/search.hpp"
#include "diagnosis/search/selection.hpp"

#include <functional>

namespace tofgraph::diagnosis {

// ---- Alternatives to effects that were found: to one, or to several at once ----

class Rivals {
 public:
  /// @param selection this and the others must live on
  Rivals(Selection& selection, const Trials& trials, const std::vector<std::unique_ptr<Candidate>>& candidates,
         std::uint64_t seed)
      : selection_(selection), problem_(selection.problem()), trials_(trials), candidates_(candidates), seed_(seed) {}

  /// In the place of a term that was found, best first.
  std::vector<Rival> of(const EffectFinding& found, std::size_t term);
  /// Effects that cannot be told from several that were found together: each becomes a rival of all that it takes the
  /// place of, and no effect that was found has two such rivals. @param first_term of the first one that was found
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

// ---- Effects that a search has selected, while they are tested ----

/// Findings and tools that all tests of a search share.
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

  /// Patterns of the gap beside a model, beyond chance.
  std::vector<Pattern> patterns_of(const ModelFit& fit) const;
  /// Takes an addition out of the model. The last reason counts.
  void dismiss(const ModelTerm& addition, EffectFinding finding);
  /// Takes all additions out of the model.
  void dismiss_all(const std::string& why);
  /// Drops the effects that a test refutes. @returns whether there was such a one
  bool drop_refuted(const std::function<std::string(EffectFinding&)>& test);
  /// Replaces an effect of which a nonlinear parameter is not identifiable by others, if these explain as much.
  /// @returns whether they do
  bool replace_by_others(EffectFinding finding, const Unidentified& why);

  /// Compares each effect with its rivals, once; again after one was dropped.
  void compare_with_rivals();
  bool are_compared() const { return compared_; }
  /// Has effects compared again with their rivals.
  void forget_comparison() { compared_ = false; }
  /// Adds what was dropped to the result, without what came back.
  void report_dropped();

 private:
  /// An effect of which a nonlinear parameter is not identifiable, or at its limit, and the set that explains as much.
  struct Replaced {
    EffectFinding finding;
    ModelFit fit;  ///< with it
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
