// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Result of the search in a case, compared with the hidden effects.
#pragma once

#include "tests/hidden_effects/score_cases.hpp"

#include <nlohmann/json.hpp>

#include <iosfwd>
#include <optional>

namespace tofgraph::hidden {

/// A 95 % interval of a report, with its coverage of the truth.
struct HeldInterval {
  std::string parameter;  ///< "wiggling.amplitude"
  bool holds = false;
};

/// Outcome of a case, as a line of scores.csv.
struct Score {
  Case what;
  std::string verdict;
  std::vector<std::string> names;           ///< effects that were added
  std::vector<std::string> tied;            ///< with one of them
  bool blind = false;                       ///< the search reports that this design cannot show the hidden effect
  std::size_t found = 0;                    ///< hidden effects that are among names or tied
  std::size_t wrong = 0;                    ///< names that are neither hidden nor tied with a hidden effect
  double before = 0, after = 0, floor = 0;  ///< held-out depth gap, m
  double noise = 0;                         ///< of the distance, from frames and repeated conditions alone, m
  std::optional<double> again;              ///< depth gap of the extended model on another campaign, m
  std::vector<HeldInterval> intervals;      ///< intervals of named hidden effects, also if others are named
  std::size_t worse_fits = 0;               ///< fits that ended worse than a submodel
  double seconds = 0;

  std::string line() const;
};

inline constexpr const char* score_header =
    "suite,design,experiments,effects,size,drawn,pattern,without,noise,clutter,output,seed,verdict,names,tied,blind,"
    "found,"
    "wrong,before_mm,after_mm,floor_mm,intervals,intervals_hold,interval_list,seconds,again_mm,order,given,worse_fits,"
    "noise_mm";

/// Lines of a scores.csv; columns missing in older files are allowed.
/// @throws std::invalid_argument for a malformed line
std::vector<Score> read_scores(std::istream& in);

/// @param report content of report.json @param hidden the effects with their
/// values
Score judge(const Case& what, const nlohmann::json& report, const Effects& hidden, double seconds);

/// True if every hidden effect is named, or in a documented tie with a name, and nothing else is named.
bool is_right(const Score& score);

/// Fraction of the closable held-out gap that was closed; nullopt if the gap is not above the noise. For a gap that is
/// NaN the fraction is NaN, which fails any comparison.
std::optional<double> closed(const Score& score);

/// True for a tie with an effect that the reference does not list as equivalent to the hidden one.
bool has_loose_tie(const Score& score);

}  // namespace tofgraph::hidden
