// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Cases for the gap search: campaigns with hidden effects, suite by suite.
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
  double size = 1;                       ///< amplitude of effects and patterns, as a factor on the typical one
  Drawn drawn = Drawn::all;              ///< parameters of the effects
  std::string pattern;                   ///< hidden, in no catalogue
  std::string without;                   ///< removed from the search's catalogue
  NoiseKind noise = NoiseKind::gaussian;
  Output output = Output::taps;
  std::vector<std::string> clutter;  ///< warp, sessions, residue, misplaced: with their usual amplitudes
  /// Parameters of effects that are not drawn, "offset=4mm" by effect, in the form of --effect of hidden_effects_make.
  std::map<std::string, std::string> given;
  double jitter = 1;       ///< factor on the 0.5 mm jitter of the board positions
  std::size_t frames = 0;  ///< per condition; 0: default of the bench
  Order order = Order::shuffled;
  std::uint64_t seed = 1;

  /// Unique text of a case.
  std::string key() const;
};

struct Suite {
  std::string name, text;
  std::vector<Case> (*make)(std::uint64_t seed, std::size_t draws);
};

/// Clutter by its names: 1 mm of warp, 3 sessions, 0.3 mm of residual, a board misplaced by 20 mm.
Clutter clutter_of(const std::vector<std::string>& names);

/// quick, single, nothing, pairs, lab, triples, without, patterns, ties.
const std::vector<Suite>& suites();

/// Cases of a suite, with at least `count` of them if possible. @param draws minimum number of draws of each case
std::vector<Case> cases_of(const Suite& suite, std::uint64_t seed, std::size_t draws, std::size_t count);

/// Effects that a campaign of boards cannot show: they act only on the noise, on masked pixels or on edges.
bool is_hidden_from_boards(const std::string& effect);

/// Effects that are equivalent in ordinary designs (the reference's table of ties): `tie` is the correct verdict.
bool are_alike(const std::string& a, const std::string& b);
/// Likewise in the design of a case: if only a warm camera was measured, or a single integration time, the change by
/// these effects is an offset.
bool are_alike(const Case& what, const std::string& a, const std::string& b);

}  // namespace tofgraph::hidden
