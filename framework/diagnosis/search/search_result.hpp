// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Result of a search: effects that were found, their rivals, and what was tried.
#pragma once

#include "diagnosis/model/candidate.hpp"
#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/patterns.hpp"

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

}  // namespace tofgraph::diagnosis
