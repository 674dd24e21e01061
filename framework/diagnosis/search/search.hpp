// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Looks for the effects that a model is missing: the best set of them, each questioned, and what is left.
#pragma once

#include "diagnosis/model/board_nuisances.hpp"
#include "diagnosis/model/candidate.hpp"
#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/given_model.hpp"
#include "diagnosis/search/patterns.hpp"
#include "diagnosis/search/selection.hpp"

#include <array>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Another effect in the place of one that was found, or of several.
struct Rival {
  const Candidate* candidate = nullptr;
  std::vector<std::string> in_place_of;    ///< names of what was found, itself among them
  double deviance = 0;                     ///< more than with the one that was found
  double bic = 0;                          ///< likewise
  bool tied = false;                       ///< these data cannot tell which of the two it is
  State state = {};                        ///< of the model with it, fitted
  std::optional<std::size_t> untold = {};  ///< of its parameters, a shape that these data do not tell
  std::string limit = {};  ///< what of it went to a limit, so that it is not a tie though it does as much; or empty

  /// As much as what it takes the place of, a tie or not.
  bool does_as_much() const { return tied || !limit.empty(); }
  bool of_several() const { return in_place_of.size() > 1; }
  /// True if it is to be listed beside this one of those that it takes the place of: once.
  bool is_told_at(const std::string& name) const { return in_place_of.front() == name; }
};

/// A candidate that comes near to what is left.
struct Near {
  const Candidate* candidate = nullptr;
  double explained_fraction = 0;  ///< its gain over that of the best generic pattern, 1 at most
};

/// A model that fits, but for a value that the conditions do not tell.
struct Untold {
  State state;                          ///< fitted
  std::size_t term = 0, nonlinear = 0;  ///< of the state, and of the term's parameters
};

/// Names of an effect, and of its rivals that explain as much.
std::vector<std::string> names_of(const std::string& effect, std::span<const Rival> rivals);

struct EffectFinding {
  const Candidate* candidate = nullptr;
  std::string name;  ///< of the effect, or "effect.parameter" of a refinement
  double gain = 0;   ///< of the deviance, when it is taken out again
  double p_value = 1;
  double explained_fraction = 0;   ///< its gain over that of the best generic pattern in its place
  std::vector<Rival> rivals;       ///< best first
  std::vector<Pattern> where;      ///< what the gap looks like without it
  std::string refutation;          ///< why it is not to be named, or empty
  std::optional<Untold> untold;    ///< that is because of a shape, where it leaves nothing else
  double chosen = NAN;             ///< share of the folds that chose it, or what does as much; NaN: no folds
  HeldOutImprovement improvement;  ///< what it brings out of fold

  /// Its own, and of those that do as much.
  std::vector<std::string> names() const { return names_of(name, rivals); }
};

/// True if two models differ by these effects of the one and that of the other alone.
bool beside_the_same(const State& one, std::span<const std::string> effects, const State& other,
                     const std::string& its);

struct SearchResult {
  ModelFit before, after;                      ///< the model as it was, and with what was found
  std::vector<EffectFinding> found;            ///< in the order of after.state.terms, from the first that was added
  std::vector<EffectFinding> refinements;      ///< of any effect of the model
  std::vector<EffectFinding> dropped;          ///< what was tried and did not pass the gates, in that order
  std::map<std::string, std::string> refused;  ///< candidates that cannot be used, and why
  std::vector<Pattern> where;                  ///< patterns of the gap before the search, by p-value and gain
  std::vector<Pattern> rest;                   ///< significant patterns that no candidate explains
  double lack_of_fit = 1;                      ///< chi-square over freedom after the search
  double freedom = 0;
  std::array<std::size_t, observables> structure{};  ///< patterns in the rest that follow no axis (parallel analysis)
  std::vector<Misplaced> misplaced;                  ///< boards that do not stand where the campaign says
  std::vector<Near> nearest;                         ///< candidates that come nearest to the rest, nearest first
  CrossFit cross_fit;                                ///< out of fold
  std::vector<Step> trace;                           ///< all of it
  /// Why effects, or new values of the model's own, are not written though the search took them; or nothing.
  std::string not_better;
  Verification verified;      ///< of the model that is left
  bool is_given = false;      ///< whether the model stays as it was given, with its values
  bool time_expired = false;  ///< whether the time limit ended the search, or the comparison with others
  bool not_compared = false;  ///< whether it left no time to ask what else could stand in the place of what was found

  std::size_t patterns_without_axis() const { return std::accumulate(structure.begin(), structure.end(), 0UL); }
  bool something_left() const { return !rest.empty() || patterns_without_axis() > 0; }
};

/// @param model terms of the model as it is; these are refitted
/// @param candidates effects that may be added; those of the model are not taken twice
SearchResult search(const Problem& problem, const std::vector<Term>& model,
                    const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options);

}  // namespace tofgraph::diagnosis
