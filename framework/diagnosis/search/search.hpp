// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Search for the effects that a model lacks: the best set of them, tests of each, and the unexplained residual.
#pragma once

#include "diagnosis/model/board_nuisances.hpp"
#include "diagnosis/model/candidate.hpp"
#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/given_model.hpp"
#include "diagnosis/search/patterns.hpp"
#include "diagnosis/search/rivals.hpp"
#include "diagnosis/search/selection.hpp"

#include <array>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// A candidate close to the unexplained residual.
struct Near {
  const Candidate* candidate = nullptr;
  double fraction_of_largest = 0;  ///< gain over that of the largest generic pattern, at most 1
};

/// A fitted model with a value that the conditions do not determine.
struct UndeterminedValue {
  State state;                          ///< fitted
  std::size_t term = 0, nonlinear = 0;  ///< indices of the term in the state, and of the parameter in the term
};

struct EffectFinding {
  const Candidate* candidate = nullptr;
  std::string name;  ///< the effect's, or "effect.parameter" for a refinement
  double gain = 0;   ///< increase of the deviance if it is removed
  double p_value = 1;
  /// Gain over that of the best generic pattern that it lowers, see docs/method.md, test 5; NaN: it lowers none.
  double explained_fraction = 0;
  std::vector<Rival> rivals;                      ///< best first
  std::vector<Pattern> where;                     ///< patterns of the gap without it
  std::string refutation;                         ///< reason why it is not named; empty: it is
  std::optional<UndeterminedValue> undetermined;  ///< undetermined nonlinear parameter, if that is the reason
  double supported = NAN;                         ///< share of the folds that support one of names(); NaN: no folds
  HeldOutImprovement improvement;                 ///< improvement on held-out data

  /// Its own name, and those of rivals that explain as much.
  std::vector<std::string> names() const { return names_with_rivals(name, rivals); }
};

struct SearchResult {
  ModelFit refitted_given, after;              ///< given model with refitted parameters, and with the effects found
  std::vector<EffectFinding> found;            ///< in the order of after.state.terms, from the first added term
  std::vector<EffectFinding> refinements;      ///< refinements of any effect of the model
  std::vector<EffectFinding> dropped;          ///< effects that failed a test, in the order of the tests
  std::map<std::string, std::string> refused;  ///< candidates that cannot be used, with reasons
  std::vector<Pattern> where;                  ///< patterns of the gap before the search, by p-value and gain
  std::vector<Pattern> rest;                   ///< significant patterns that no candidate explains
  double lack_of_fit = 1;                      ///< chi-square over its expectation after the search
  double freedom = 0;
  std::array<std::size_t, observables> structure{};  ///< patterns of the residual along no axis (parallel analysis)
  std::vector<Misplaced> misplaced;                  ///< boards that are not where the campaign states
  std::vector<Near> nearest;                         ///< candidates closest to the residual, closest first
  CrossFit cross_fit;                                ///< results on held-out data
  std::vector<Step> trace;                           ///< all steps
  /// Reason why effects or new values of the given model were rejected after the search accepted them; or empty.
  std::string not_better;
  Verification verified;      ///< comparison of the resulting model with the given one
  bool is_given = false;      ///< true: the model stays as given, with its values
  bool time_expired = false;  ///< true: the time limit ended the search, or the comparison with others
  bool not_compared = false;  ///< true: no time remained to compare with rivals

  std::size_t patterns_without_axis() const { return std::accumulate(structure.begin(), structure.end(), 0UL); }
  bool something_left() const { return !rest.empty() || patterns_without_axis() > 0; }
};

/// @param model terms of the given model; these are refitted
/// @param candidates effects that may be added; those of the model are not added twice
SearchResult search(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
                    const SearchOptions& options);

}  // namespace tofgraph::diagnosis
