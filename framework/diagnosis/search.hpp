// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Looks for the effects that a model is missing: score all, refit the best, add, look again, swap and drop.
#pragma once

#include "diagnosis/contribution.hpp"
#include "diagnosis/patterns.hpp"
#include "diagnosis/probes.hpp"

#include <array>
#include <functional>
#include <numeric>

namespace tofgraph::diagnosis {

struct SearchOptions {
  std::size_t max_effects = 6;
  std::uint64_t seed = 1;
  std::size_t flips = 1000;
  std::function<void(const std::string& what)> progress;  ///< may be empty
};

/// Another effect in the place of one that was found.
struct Rival {
  const Candidate* candidate = nullptr;
  double deviance = 0;  ///< more than with the one that was found
  double bic = 0;       ///< likewise
  bool tied = false;    ///< these data cannot tell which of the two it is
};

struct Found {
  const Candidate* candidate = nullptr;
  std::string name;  ///< of the effect, or "effect.parameter" of a refinement
  double gain = 0;   ///< of the deviance, when it is taken out again
  double p_value = 1;
  double capture = 0;          ///< its gain over that of the best generic pattern in its place
  HeldOutFall held_out;        ///< what it brings on conditions that were put aside
  std::vector<Rival> rivals;   ///< best first
  std::vector<Pattern> where;  ///< what the gap looks like without it
  std::string refutation;      ///< why it is not to be named, or empty
};

struct SearchResult {
  Fit before, after;                           ///< the model as it was, and with what was found
  std::vector<Found> found;                    ///< in the order of after.state.terms, from the first that was added
  std::vector<Found> refinements;              ///< of any effect of the model
  std::vector<Found> dropped;                  ///< what was tried and did not pass the gates, in that order
  std::map<std::string, std::string> refused;  ///< candidates that cannot be used, and why
  std::vector<Pattern> where;                  ///< patterns of the gap before the search, by p-value and gain
  std::vector<Pattern> rest;                   ///< significant patterns that no candidate explains
  double lack_of_fit = 1;                      ///< chi-square over freedom after the search
  double freedom = 0;
  std::array<std::size_t, observables> structure{};  ///< patterns in the rest that follow no axis (parallel analysis)
  std::vector<std::vector<double>> correction, brightening;  ///< of the problem, at the end
  std::vector<Rival> nearest;                                ///< candidates that come nearest to the rest; bic: capture

  std::size_t patterns_without_axis() const { return std::accumulate(structure.begin(), structure.end(), 0UL); }
  bool something_left() const { return !rest.empty() || patterns_without_axis() > 0; }
};

/// @param model terms of the model as it is; these are refitted
/// @param candidates effects that may be added; those of the model are not taken twice
SearchResult search(const Problem& problem, const std::vector<Term>& model,
                    const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options);

}  // namespace tofgraph::diagnosis
