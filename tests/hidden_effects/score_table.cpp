// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/score_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tofgraph::hidden {
namespace {

std::string percent(std::size_t part, std::size_t all) {
  return all == 0 ? "-"
                  : fmt::format("{} of {} ({:.0f} %)", part, all,
                                100.0 * static_cast<double>(part) / static_cast<double>(all));
}

/// Median; NaN counts as less than all numbers.
double median(std::vector<double> values) {
  for (double& value : values) value = std::isnan(value) ? -std::numeric_limits<double>::infinity() : value;
  std::ranges::sort(values);
  return values[values.size() / 2];
}

/// Counts of a group of cases.
template <class Wanted> std::size_t count(const std::vector<Score>& scores, Wanted&& wanted) {
  return static_cast<std::size_t>(std::ranges::count_if(scores, wanted));
}

bool is_single_name(const Score& score) { return score.verdict == "named"; }

/// True if a tie or a mimic is documented as possible for the name.
bool has_partner(const std::string& effect) {
  return std::ranges::any_of(catalogue(), [&](const Effect& other) { return are_alike(effect, other.name); });
}

std::string row(const std::string& group, const std::string& asked, const std::string& seen) {
  return fmt::format("| {} | {} | {} |\n", group, asked, seen);
}

/// Ratio of the gap on another campaign to the held-out gap.
std::string again_row(const std::vector<Score>& scores) {
  std::vector<double> ratios;
  for (const Score& score : scores) {
    if (score.again) ratios.push_back(*score.again / score.after);
  }
  if (ratios.empty()) return "";
  std::ranges::sort(ratios);
  return row("gap on another campaign of the same camera over the held-out one", "0.9 to 1.1",
             fmt::format("{:.2f} (median of {}), {:.2f} to {:.2f}", median(ratios), ratios.size(), ratios.front(),
                         ratios.back()));
}

std::vector<Score> of_suite(const std::vector<Score>& scores, const std::string& suite) {
  std::vector<Score> result;
  std::ranges::copy_if(scores, std::back_inserter(result), [&](const Score& s) { return s.what.suite == suite; });
  return result;
}

std::string single_rows(const std::vector<Score>& all) {
  std::string text;
  for (const double size : {0.5, 1.0, 2.0}) {
    std::vector<Score> scores;
    std::ranges::copy_if(all, std::back_inserter(scores), [&](const Score& s) { return s.what.size == size; });
    if (scores.empty()) continue;
    const std::size_t blind = count(scores, [](const Score& s) { return s.blind; });
    std::erase_if(scores, [](const Score& s) { return s.blind; });
    text += row(fmt::format("one effect, {} x typical: right name or tie", size), size == 0.5 ? "85 %" : "95 %",
                percent(count(scores, is_right), scores.size()) + fmt::format(", {} more blind by the audit", blind));
    text +=
        row(fmt::format("one effect, {} x typical: a wrong single name", size), "at most 2 %",
            percent(count(scores, [](const Score& s) { return is_single_name(s) && s.wrong != 0; }), scores.size()));
  }
  return text;
}

std::string several_row(const std::string& name, const std::vector<Score>& scores, std::size_t needed) {
  if (scores.empty()) return "";
  return row(fmt::format("{}: at least {} found", name, needed), "90 %",
             percent(count(scores, [&](const Score& s) { return s.found >= needed; }), scores.size()));
}

/// @returns rows of the laboratory campaigns
std::string lab_rows(const std::vector<Score>& scores) {
  if (scores.empty()) return "";
  const auto all_named = [](const Score& s) { return s.found == s.what.effects.size() && s.wrong == 0; };
  // Excludes the scatter estimated by the search, which absorbs unexplained errors.
  const auto gap = [](const Score& s) { return !(s.after <= 3 * std::hypot(s.noise, 0.5e-3 * s.what.jitter)); };
  return row("lab: the set and nothing else, or tied", "90 %", percent(count(scores, all_named), scores.size())) +
         row("lab: a false name", "at most 1 %",
             percent(count(scores, [](const Score& s) { return s.wrong != 0; }), scores.size())) +
         row("lab: a gap above three times the noise", "none", percent(count(scores, gap), scores.size()));
}

std::string worse_row(const std::vector<Score>& scores) {
  std::size_t worse = 0;
  for (const Score& score : scores) worse += score.worse_fits;
  return row("fits that end worse than a model which they contain", "none", fmt::format("{}", worse));
}

std::string unknown_rows(const std::string& name, const std::vector<Score>& scores) {
  if (scores.empty()) return "";
  const auto honest = [](const Score& s) { return s.verdict == "unknown" || s.verdict == "named_with_rest"; };
  return row(name + ": `unknown` or `named_with_rest`", "80 %", percent(count(scores, honest), scores.size())) +
         row(name + ": `named`", "at most 10 %", percent(count(scores, is_single_name), scores.size()));
}

std::string gap_rows(const std::vector<Score>& scores) {
  std::vector<double> shares;
  std::size_t intervals = 0, hold = 0, level = 0;
  for (const Score& score : scores) {
    intervals += score.intervals.size();
    hold += static_cast<std::size_t>(std::ranges::count(score.intervals, true, &HeldInterval::holds));
    if (score.what.effects.empty() || !score.what.without.empty() || score.blind) continue;
    if (const std::optional<double> share = closed(score))
      shares.push_back(*share);
    else
      ++level;
  }
  if (shares.empty()) return "";
  const auto enough = static_cast<std::size_t>(std::ranges::count_if(shares, [](double s) { return s >= 0.9; }));
  return row("held-out gap above the noise closed to 90 %", "all",
             percent(enough, shares.size()) +
                 fmt::format(", median {:.0f} %, {} more with no gap above the noise", 100 * median(shares), level)) +
         row("95 % intervals that hold the truth", "90 to 99 %", percent(hold, intervals));
}

}  // namespace

std::string table(const std::vector<Score>& scores) {
  std::string text = "| what | asked for | seen |\n| --- | --- | --- |\n";
  text += single_rows(of_suite(scores, "single"));
  if (const auto nothing = of_suite(scores, "nothing"); !nothing.empty())
    text += row("nothing hidden: a name", "at most 1 of 100",
                percent(count(nothing, [](const Score& s) { return !s.names.empty(); }), nothing.size()));
  text += several_row("two effects", of_suite(scores, "pairs"), 2);
  text += lab_rows(of_suite(scores, "lab"));
  text += several_row("three effects", of_suite(scores, "triples"), 2);
  std::vector<Score> without = of_suite(scores, "without"), with_partner;
  std::erase_if(without, [](const Score& s) { return s.blind; });
  std::ranges::copy_if(without, std::back_inserter(with_partner),
                       [](const Score& s) { return has_partner(s.what.without); });
  std::erase_if(without, [](const Score& s) { return has_partner(s.what.without); });
  text += unknown_rows("an effect that the search does not know", without);
  text += unknown_rows("the same, with a partner that is alike", with_partner);
  text += unknown_rows("patterns of no catalogue", of_suite(scores, "patterns"));
  if (const auto ties = of_suite(scores, "ties"); !ties.empty()) {
    std::vector<Score> resolved;
    std::ranges::copy_if(ties, std::back_inserter(resolved),
                         [](const Score& s) { return !s.what.experiments.empty(); });
    text +=
        row("ties resolved by their experiment", "all",
            percent(count(resolved, [](const Score& s) { return is_right(s) && s.tied.empty(); }), resolved.size()));
  }
  text += gap_rows(scores) + again_row(scores) + worse_row(scores);
  return text;
}

}  // namespace tofgraph::hidden
