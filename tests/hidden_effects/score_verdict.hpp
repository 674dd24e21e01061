// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Result of the search in a case, compared with the hidden effects.
#pragma once

#include "tests/hidden_effects/score_cases.hpp"

#include <nlohmann/json.hpp>

#include <iosfwd>
#include <optional>

namespace tofgraph::hidden {

/// A 95 % interval of a report, and whether the truth lies in it.
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
  bool blind = false;                       ///< the search says that this design cannot show what is hidden
  std::size_t found = 0;                    ///< hidden effects that are among names or tied
  std::size_t wrong = 0;                    ///< names that are not hidden, nor tied with what is
  double before = 0, after = 0, floor = 0;  ///< held-out depth gap, m
  double noise = 0;                         ///< of the distance by frames and repeated conditions alone, m
  std::optional<double> again;              ///< depth gap of the extended model on another campaign, m
  std::vector<HeldInterval> intervals;      ///< intervals of hidden effects that were named, beside any others
  std::size_t worse_fits = 0;               ///< fits that ended worse than a model which they contain
  double seconds = 0;

  std::string line() const;
};

inline constexpr const char* score_header =
    "suite,design,experiments,effects,size,drawn,pattern,without,noise,clutter,output,seed,verdict,names,tied,blind,"
    "found,"
    "wrong,before_mm,after_mm,floor_mm,intervals,intervals_hold,interval_list,seconds,again_mm,order,given,worse_fits,"
    "noise_mm";

/// The lines of a scores.csv; columns that earlier files did not have may be missing.
/// @throws std::invalid_argument for a line that is none
std::vector<Score> read_scores(std::istream& in);

/// @param report what the search wrote, report.json
/// @param hidden the effects with their values
Score judge(const Case& what, const nlohmann::json& report, const Effects& hidden, double seconds);

/// Every hidden effect named, or in a documented tie with what is named, and nothing else.
bool is_right(const Score& score);

/// The share of what can be closed of the held-out gap that was closed; nothing where the gap does not rise above
/// the noise. Of a gap that is no number the share is NaN, which is no share that is great enough.
std::optional<double> closed(const Score& score);

/// A tie with an effect that the reference does not list as alike to what is hidden.
bool has_loose_tie(const Score& score);

}  // namespace tofgraph::hidden
