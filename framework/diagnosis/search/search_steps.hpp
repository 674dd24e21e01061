// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Steps of one search: a selection on all data whose effects are tested, cross-fitted and verified.
#pragma once

#include "diagnosis/model/identifiability.hpp"
#include "diagnosis/search/gates.hpp"
#include "diagnosis/search/rivals.hpp"
#include "diagnosis/search/search.hpp"

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// An effect of which a shape is not told, or at its limit, and the set that explains as much in its place.
struct StoodFor {
  EffectFinding found;
  ModelFit fit;  ///< with it
  Unidentified unidentified;
  std::vector<std::string> by;

  const std::string& name() const { return found.name; }
};

class Search : private Selection {
 public:
  Search(const Problem& problem, const std::vector<Term>& model,
         const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options,
         const std::map<std::string, std::string>& refused)
      : Selection(problem, model, candidates, options, refused),
        model_(model),
        candidates_(candidates),
        options_(options),
        finder_(Selection::problem()),
        gates_(Selection::problem(), finder_, alternatives(), options.flips, options.seed),
        trials_(Selection::problem(), candidates, weight()),
        rivals_(*this, trials_, candidates, options.seed + 2) {}

  SearchResult run();

 private:
  /// A model that passed the gates, with what they said.
  struct Established {
    Kept kept;
    std::vector<EffectFinding> found, refinements;
  };

  /// The search itself. @throws TimeExpired
  void find();
  void keep_established();
  /// The time limit ended the search: the last model that passed the gates, or if none has been put to them, that which
  /// effects had been added to by then.
  void return_to_established();

  /// Fits a model on which most folds agree to all data. @returns whether it is better, and taken
  bool follow_folds();

  /// Asks what else could stand in the place of what is written, as far as the time limit allows.
  void compare();

  /// Drops effects until the model predicts distances no worse than the given one; where it does not without any, the
  /// given values stay.
  void verify();
  void hold_given_values();
  /// Why the best model must not be written, or nothing.
  std::string why_worse();
  void drop_least(const std::string& why);
  void keep_given(const std::string& why);
  std::vector<Pattern> patterns_of(const ModelFit& base);
  void dismiss(const ModelTerm& piece, EffectFinding found);

  /// Back to the model as it was.
  void dismiss_all(const std::string& why);

  /// Puts the gates to every addition, and drops the one that does worst of those that do not pass.
  /// @returns whether all passed
  bool confirm();

  /// True if folds confirmed an effect already: where these led to a model, its predictions have been tested.
  bool is_proved(const ModelTerm& piece) const;

  /// Until all that is left passes beside the others, and says something; where nothing is left that does, once more
  /// beside what conditions have of their own, for which it may have stood.
  /// @returns whether effects were looked for again; that is so twice at most, as what comes may go each time
  bool establish();

  /// Repeats the tests, as effects that are dropped may have supported the others.
  void confirm_all();

  /// Cross-fits. If nothing is named, the model stays as it is, and predicts held-out conditions so. Folds search for
  /// themselves, whatever is asked of them: what they found once they would find again.
  void put_aside();

  /// Drops the effects that a question refutes. @returns whether there was such a one
  bool drop_refuted(const std::function<std::string(EffectFinding&)>& question);

  /// Drops the last one that has values that say nothing: without it those of another one may say more. Where all that
  /// is wrong with it is a shape, it is one of those that others cannot be told from, if these explain as much.
  /// @returns whether there was such a one
  bool require_told();

  /// @param stood all but the others @returns whether there are others that explain as much
  bool stand_in_for(StoodFor stood);

  /// Drops what does not prove itself out of fold, each alone; what passes alone has to pass together, too: in the
  /// folds that have nothing else beside it, where most are such. @returns whether there was such a one
  bool prove();

  /// Compares each effect with its rivals: if its own name is not confirmed, and for what
  /// is written, as fitting all the others takes as long as a search.
  void describe_all();
  /// True if all that was found is confirmed on held-out data by the names that it has.
  bool all_proved();
  /// Why what was found does not pass together, or nothing.
  std::string why_not_together() const;

  /// Describes the gap without an effect, and its rivals.
  void describe(std::size_t t);
  /// Shares and falls out of fold of what was found, by all its names.
  void weigh(EffectFinding& found) const;
  void look_at_rest();
  bool stands(const StoodFor& stood) const;

  const std::vector<Term>& model_;
  const std::vector<std::unique_ptr<Candidate>>& candidates_;
  const SearchOptions& options_;
  PatternFinder finder_;
  Gates gates_;
  Trials trials_;
  Rivals rivals_;
  int regrown_ = 0;
  bool described_ = false;  ///< whether what was found is compared with others
  std::vector<StoodFor> stood_for_;
  std::vector<FoldResult> searched_folds_;
  Kept begun_;                ///< before any effect
  bool unconfirmed_ = false;  ///< whether the time limit came before the gates
  std::optional<Established> established_;
  SearchResult result_;
};

}  // namespace tofgraph::diagnosis
