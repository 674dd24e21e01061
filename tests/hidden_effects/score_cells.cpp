// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/score_table.hpp"
#include "tests/hidden_effects/truth.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace tofgraph::hidden {
namespace {

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

/// Outcome of a report for a hidden effect of the catalogue.
std::size_t Cell::*outcome_of_effect(const Score& score, const std::string& effect) {
  const bool alone = score.what.effects.size() == 1;
  const bool tied = std::ranges::any_of(
      score.tied, [&](const std::string& other) { return other == effect || are_alike(score.what, other, effect); });
  if (alone && (score.wrong > 0 || has_loose_tie(score))) return &Cell::wrong;
  if (has(score.names, effect)) return tied ? &Cell::tie : &Cell::right;
  if (has(score.tied, effect)) return &Cell::tie;
  if (score.wrong > 0) return &Cell::wrong;
  if (alone && score.blind) return &Cell::blind;
  return score.verdict == "nothing_found" ? &Cell::nothing : &Cell::unknown;
}

/// Outcome without a name: no finding is right if nothing is hidden, "unknown" if something is.
std::size_t Cell::*outcome_without_name(const Score& score) {
  const bool something = !score.what.pattern.empty() || !score.what.without.empty();
  if (score.blind) return &Cell::blind;
  if (score.verdict == "nothing_found") return something ? &Cell::nothing : &Cell::right;
  if (score.verdict == "unknown") return something ? &Cell::right : &Cell::unknown;
  if (score.verdict == "named_with_rest" && something) return &Cell::right;
  return score.verdict == "tie" && something ? &Cell::tie : &Cell::wrong;
}

/// Nonstandard settings of a case.
std::string surroundings(const Case& what) {
  std::vector<std::string> all = what.clutter;
  if (what.noise != NoiseKind::gaussian) all.insert(all.begin(), name_of(what.noise));
  return all.empty() ? "" : fmt::format("{}", fmt::join(all, "+"));
}

class Cells {
 public:
  void take(const Score& score) {
    const Case& what = score.what;
    const std::string beside = surroundings(what);
    if (what.effects.empty() || !what.without.empty()) {
      std::string name = !what.without.empty() ? what.without : what.pattern;
      if (name.empty()) name = "nothing, " + (beside.empty() ? "gaussian" : beside);
      add(score, name, outcome_without_name(score)).disturbed =
          what.without.empty() && what.pattern.empty() && (what.noise == NoiseKind::drift || !what.clutter.empty());
      return;
    }
    for (const std::string& effect : what.effects) {
      Cell& cell = add(score, fmt::format("{}{}{}", effect, beside.empty() ? "" : ", ", beside),
                       outcome_of_effect(score, effect));
      for (const HeldInterval& interval : score.intervals) {
        if (!interval.parameter.starts_with(effect + ".")) continue;
        ++cell.intervals;
        cell.intervals_hold += interval.holds ? 1 : 0;
      }
    }
  }

  std::vector<Cell> all;

 private:
  Cell& add(const Score& score, const std::string& name, std::size_t Cell::*outcome) {
    std::vector<std::string> parts = with(score.what.design, score.what.experiments);
    if (score.what.output != Output::taps) parts.push_back(name_of(score.what.output));
    const std::string design = fmt::format("{}", fmt::join(parts, "+"));
    auto cell = std::ranges::find_if(all, [&](const Cell& c) {
      return c.suite == score.what.suite && c.what == name && c.design == design && c.size == score.what.size;
    });
    if (cell == all.end())
      cell = all.insert(all.end(),
                        Cell{.suite = score.what.suite, .what = name, .design = design, .size = score.what.size});
    ++cell->cases;
    ++((*cell).*outcome);
    cell->false_names += score.wrong;
    return *cell;
  }

  static std::vector<std::string> with(const std::string& first, std::vector<std::string> others) {
    others.insert(others.begin(), first);
    return others;
  }
};

}  // namespace

double Cell::share() const {
  return cases == blind ? std::nan("") : static_cast<double>(good()) / static_cast<double>(cases - blind);
}

std::vector<Cell> cells_of(const std::vector<Score>& scores) {
  Cells cells;
  for (const Score& score : scores) cells.take(score);
  return cells.all;
}

const Cell* worst_of(const std::vector<Cell>& cells) {
  const Cell* worst = nullptr;
  for (const Cell& cell : cells) {
    if (std::isnan(cell.share())) continue;
    if (worst == nullptr || cell.share() < worst->share() ||
        (cell.share() == worst->share() && cell.wrong > worst->wrong))
      worst = &cell;
  }
  return worst;
}

std::string cells_markdown(const std::vector<Score>& scores) {
  const std::vector<Cell> cells = cells_of(scores);
  std::string text;
  std::string suite;
  for (const Cell& cell : cells) {
    if (cell.suite != suite) {
      suite = cell.suite;
      text += fmt::format(
          "\n{}\n\n| what | design | size | cases | right | tie | wrong | unknown | nothing | blind | false names | "
          "intervals |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
          suite);
    }
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} of {} |\n", cell.what, cell.design,
                        cell.size, cell.cases, cell.right, cell.tie, cell.wrong, cell.unknown, cell.nothing, cell.blind,
                        cell.false_names, cell.intervals_hold, cell.intervals);
  }
  if (const Cell* worst = worst_of(cells))
    text +=
        fmt::format("\nWorst cell: {}, {}, design {}, size {}: {} of {} without a mistake, {} wrong.\n", worst->suite,
                    worst->what, worst->design, worst->size, worst->good(), worst->cases - worst->blind, worst->wrong);
  return text;
}

std::string cells_csv(const std::vector<Score>& scores) {
  std::string text =
      "suite,what,design,size,cases,right,tie,wrong,unknown,nothing,blind,false_names,intervals,intervals_hold\n";
  for (const Cell& cell : cells_of(scores))
    text += fmt::format("{},\"{}\",{},{},{},{},{},{},{},{},{},{},{},{}\n", cell.suite, cell.what, cell.design,
                        cell.size, cell.cases, cell.right, cell.tie, cell.wrong, cell.unknown, cell.nothing, cell.blind,
                        cell.false_names, cell.intervals, cell.intervals_hold);
  return text;
}

std::string intervals_markdown(const std::vector<Score>& scores) {
  std::map<std::string, std::pair<std::size_t, std::size_t>> held;  // and all
  for (const Score& score : scores)
    for (const HeldInterval& interval : score.intervals) {
      held[interval.parameter].first += interval.holds ? 1 : 0;
      ++held[interval.parameter].second;
    }
  if (held.empty()) return "";
  std::string text = "\n| 95 % intervals of | hold the truth | of |\n| --- | --- | --- |\n";
  for (const auto& [parameter, counts] : held)
    text += fmt::format("| {} | {} | {} |\n", parameter, counts.first, counts.second);
  return text;
}

}  // namespace tofgraph::hidden
