// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Cases for the gap search: campaigns with something hidden, suite by suite.
#pragma once

#include "tests/hidden_effects/campaign.hpp"

#include <map>
#include <string>
#include <vector>

namespace tofgraph::hidden {

struct Case {
  std::string suite, design = "C";
  std::vector<std::string> experiments;  ///< appended to the design
  std::vector<std::string> effects;      ///< hidden
  double size = 1;                       ///< size of effects and patterns, as a factor on the typical one
  Drawn drawn = Drawn::all;              ///< parameters of the effects
  std::string pattern;                   ///< hidden, in no catalogue
  std::string without;                   ///< taken out of the search's catalogue
  NoiseKind noise = NoiseKind::gaussian;
  Output output = Output::taps;
  std::vector<std::string> clutter;  ///< warp, sessions, residue, misplaced: at their usual sizes
  /// Parameters of effects that are not drawn, "offset=4mm" by effect, as --effect of hidden_effects_make takes them.
  std::map<std::string, std::string> given;
  double jitter = 1;       ///< factor on 0.5 mm of the boards' places
  std::size_t frames = 0;  ///< of each condition; 0: as many as the bench takes
  Order order = Order::shuffled;
  std::uint64_t seed = 1;

  /// Unique line of a case.
  std::string key() const;
};

struct Suite {
  std::string name, text;
  std::vector<Case> (*make)(std::uint64_t seed, std::size_t draws);
};

/// Clutter by its names: 1 mm of warp, 3 sessions, 0.3 mm of residue, a board misplaced by 20 mm.
Clutter clutter_of(const std::vector<std::string>& names);

/// quick, single, nothing, pairs, lab, triples, without, patterns, ties.
const std::vector<Suite>& suites();

/// Cases of a suite, drawn as often as are asked for. @param draws of each case at least
std::vector<Case> cases_of(const Suite& suite, std::uint64_t seed, std::size_t draws, std::size_t count);

/// Effects that a campaign of boards cannot show: they act on the noise, on masked pixels or on edges alone.
bool is_hidden_from_boards(const std::string& effect);

/// Effects that stay alike in ordinary designs (the reference's table of ties): the verdict `tie` is the right one.
bool are_alike(const std::string& a, const std::string& b);
/// Likewise in the design of a case: where nothing but a warm camera was measured, or a single integration time, what
/// these change is an offset.
bool are_alike(const Case& what, const std::string& a, const std::string& b);

}  // namespace tofgraph::hidden
