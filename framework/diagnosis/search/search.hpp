// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Looks for the effects that a model is missing: the best set of them, each questioned, and what is left.
#pragma once

#include "diagnosis/model/board_offsets.hpp"
#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/given_model.hpp"
#include "diagnosis/search/search_result.hpp"
#include "diagnosis/search/selection.hpp"

#include <array>
#include <numeric>

namespace tofgraph::diagnosis {

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
