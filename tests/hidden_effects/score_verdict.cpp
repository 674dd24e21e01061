// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/score_verdict.hpp"

#include "report/plot.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>

namespace tofgraph::hidden {
namespace {

using nlohmann::json;

/// Counts the intervals of an effect, and those that hold the truth.
void count_intervals(const json& effect, const Effects& hidden, Score& score) {
  const std::string name = effect["name"];
  const auto known = std::ranges::find(catalogue(), name, &Effect::name);
  for (const auto& [parameter, value] : effect["parameters"].items()) {
    if (known == catalogue().end() ||
        std::ranges::find(known->parameters, parameter, &Parameter::name) == known->parameters.end())
      continue;
    // Of a map that is estimated, only the product with its scale is known.
    if (name == "fixed_pattern" || name == "pixel_response") continue;
    if (name == "specular" && parameter == "strength") continue;  // goes with the light's power, which is not told
    if (!value.contains("low") || !value["low"].is_number() || !value["high"].is_number()) continue;
    const double low = value["low"], high = value["high"];
    double truth = hidden.value(name, parameter);
    if (parameter.starts_with("phase")) truth += 2 * M_PI * std::round(((low + high) / 2 - truth) / (2 * M_PI));
    ++score.intervals;
    score.intervals_hold += low <= truth && truth <= high ? 1 : 0;
  }
}

std::string percent(std::size_t part, std::size_t all) {
  return all == 0 ? "-"
                  : fmt::format("{} of {} ({:.0f} %)", part, all,
                                100.0 * static_cast<double>(part) / static_cast<double>(all));
}

/// What is no number is less than all that are.
double median(std::vector<double> values) {
  for (double& value : values) value = std::isnan(value) ? -std::numeric_limits<double>::infinity() : value;
  std::ranges::sort(values);
  return values[values.size() / 2];
}

/// Counts of a group of cases.
template <class Wanted> std::size_t count(const std::vector<Score>& scores, Wanted&& wanted) {
  return static_cast<std::size_t>(std::ranges::count_if(scores, wanted));
}

/// A tie with an effect that the reference does not list as alike to what is hidden.
bool has_loose_tie(const Score& score) {
  return std::ranges::any_of(score.tied, [&](const std::string& tied) {
    return std::ranges::none_of(score.what.effects,
                                [&](const std::string& hidden) { return tied == hidden || are_alike(tied, hidden); });
  });
}

bool is_single_name(const Score& score) { return score.verdict == "named"; }

/// A name where a tie or a mimic is documented to be possible.
bool has_partner(const std::string& effect) {
  return std::ranges::any_of(catalogue(), [&](const Effect& other) { return are_alike(effect, other.name); });
}

std::string row(const std::string& group, const std::string& asked, const std::string& seen) {
  return fmt::format("| {} | {} | {} |\n", group, asked, seen);
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
    if (score.what.effects.empty() || !score.what.without.empty() || score.blind) continue;
    if (const std::optional<double> share = closed(score))
      shares.push_back(*share);
    else
      ++level;
    intervals += score.intervals;
    hold += score.intervals_hold;
  }
  if (shares.empty()) return "";
  const auto enough = static_cast<std::size_t>(std::ranges::count_if(shares, [](double s) { return s >= 0.9; }));
  return row("held-out gap above the noise closed to 90 %", "all",
             percent(enough, shares.size()) +
                 fmt::format(", median {:.0f} %, {} more with no gap above the noise", 100 * median(shares), level)) +
         row("95 % intervals that hold the truth", "90 to 99 %", percent(hold, intervals));
}

}  // namespace

std::string Score::line() const {
  return fmt::format("{},{},{},{},{},{},{},{:.4f},{:.4f},{:.4f},{},{},{:.1f}", what.key(), verdict,
                     fmt::join(names, "+"), fmt::join(tied, "+"), blind ? 1 : 0, found, wrong, 1e3 * before,
                     1e3 * after, 1e3 * floor, intervals, intervals_hold, seconds);
}

Score parse_score(const std::string& line) {
  const auto split = [](const std::string& text, char separator) {
    std::vector<std::string> parts;
    std::istringstream in(text);
    for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
    return parts;
  };
  const std::vector<std::string> c = split(line, ',');
  if (c.size() != 21) throw std::invalid_argument("this is not a line of scores: " + line);
  Score s;
  s.what = {.suite = c[0],
            .design = c[1],
            .experiments = split(c[2], '+'),
            .effects = split(c[3], '+'),
            .size = std::stod(c[4]),
            .pattern = c[5],
            .without = c[6],
            .noise = c[7] == "heavy"   ? NoiseKind::heavy
                     : c[7] == "drift" ? NoiseKind::drift
                                       : NoiseKind::gaussian,
            .seed = std::stoull(c[8])};
  s.verdict = c[9];
  s.names = split(c[10], '+');
  s.tied = split(c[11], '+');
  s.blind = c[12] == "1";
  s.found = std::stoul(c[13]);
  s.wrong = std::stoul(c[14]);
  s.before = std::stod(c[15]) / 1e3;
  s.after = std::stod(c[16]) / 1e3;
  s.floor = std::stod(c[17]) / 1e3;
  s.intervals = std::stoul(c[18]);
  s.intervals_hold = std::stoul(c[19]);
  return s;
}

Score judge(const Case& what, const json& report, const Effects& hidden, double seconds) {
  Score score{.what = what, .verdict = report["verdict"], .seconds = seconds};
  std::set<std::string> covered;
  for (const json& effect : report["effects"]) {
    if (effect["change"] != "added") continue;
    const std::string name = effect["name"];
    score.names.push_back(name);
    std::vector<std::string> alike = effect["tied_with"];
    std::ranges::copy(alike, std::back_inserter(score.tied));
    alike.push_back(name);
    const auto is_hidden = [&](const std::string& n) {
      return std::ranges::find(what.effects, n) != what.effects.end();
    };
    const auto match = std::ranges::find_if(alike, is_hidden);
    if (match == alike.end())
      ++score.wrong;
    else
      covered.insert(*match);
    if (alike.size() == 1 && match != alike.end()) count_intervals(effect, hidden, score);
  }
  score.found = covered.size();
  const std::vector<std::string> blind = report["blind"];
  score.blind = what.effects.size() == 1 && std::ranges::find(blind, what.effects.front()) != blind.end();
  score.before = report["gap"]["held_out_before"];
  score.after = report["gap"]["held_out_after"];
  score.floor = report["gap"]["noise_floor"];
  return score;
}

bool is_right(const Score& score) {
  return score.found == score.what.effects.size() && score.wrong == 0 && !has_loose_tie(score);
}

std::optional<double> closed(const Score& score) {
  const double open = score.before - score.floor;
  if (open <= 0.2 * score.floor) return std::nullopt;
  return (score.before - score.after) / open;
}

std::string table(const std::vector<Score>& scores) {
  std::string text = "| what | asked for | seen |\n| --- | --- | --- |\n";
  text += single_rows(of_suite(scores, "single"));
  if (const auto nothing = of_suite(scores, "nothing"); !nothing.empty())
    text += row("nothing hidden: a name", "at most 1 of 100",
                percent(count(nothing, [](const Score& s) { return !s.names.empty(); }), nothing.size()));
  text += several_row("two effects", of_suite(scores, "pairs"), 2);
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
  text += gap_rows(scores);
  return text;
}

std::string confusion_png(const std::vector<Score>& scores) {
  std::vector<std::string> hidden;
  for (const Effect& effect : catalogue())
    if (!is_hidden_from_boards(effect.name)) hidden.push_back(effect.name);
  std::vector<std::string> said = hidden;
  for (const char* other : {"unknown", "nothing", "(blind)"}) said.emplace_back(other);
  std::vector<double> share(hidden.size() * said.size(), 0.0), cases(hidden.size(), 0.0);
  const auto index = [](const std::vector<std::string>& names, const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
  };
  for (const Score& score : of_suite(scores, "single")) {
    const std::size_t from = index(hidden, score.what.effects.front());
    if (from == hidden.size()) continue;
    // a tie counts where the hidden effect is in it
    std::string name = score.names.empty() ? (score.blind                  ? "(blind)"
                                              : score.verdict == "unknown" ? "unknown"
                                                                           : "nothing")
                                           : score.names.front();
    if (score.found == 1) name = hidden[from];
    const std::size_t to = index(said, name);
    if (to < said.size()) share[from * said.size() + to] += 1;
    for (const std::string& other : score.names) {  // named beside what was hidden
      const std::size_t beside = index(said, other);
      if (score.found == 1 && score.wrong > 0 && beside != from && beside < said.size())
        share[from * said.size() + beside] += 1;
    }
    cases[from] += 1;
  }
  std::string script = fmt::format(
      "set rmargin 3\nset bmargin 12\nset lmargin 26\nset tmargin 3\nset title \"what was hidden, and what the search "
      "said (share of "
      "cases in %; a tie that contains it counts as found)\" font ',13'\nset palette defined (0 'white', 1 '#9ecae1', "
      "100 '#08306b')\n"
      "set cbrange [0:100]\nset cblabel 'share / %'\nset xtics rotate by 60 right noenhanced font ',9'\nset ytics "
      "noenhanced font ',9'\nset "
      "xlabel 'said' offset 0,-5\nset ylabel 'hidden' offset -12,0\n");
  const auto tics = [](const std::vector<std::string>& names) {
    std::string text;
    for (std::size_t i = 0; i < names.size(); ++i)
      text += fmt::format("{}{} {}", i == 0 ? "" : ", ", report::quoted(names[i]), i);
    return text;
  };
  script += fmt::format(
      "set xtics ({})\nset ytics ({})\nset xrange [-0.5:{}]\nset yrange [{}:-0.5]\nset style line 1 lc rgb '#dddddd' "
      "lw 0.5\nset grid front\nunset grid\n$m << E\n",
      tics(said), tics(hidden), static_cast<double>(said.size()) - 0.5, static_cast<double>(hidden.size()) - 0.5);
  for (std::size_t r = 0; r < hidden.size(); ++r) {
    for (std::size_t c = 0; c < said.size(); ++c)
      script += fmt::format("{} ", cases[r] > 0 ? 100 * share[r * said.size() + c] / cases[r] : 0.0);
    script += "\n";
  }
  script += "E\nplot $m matrix with image notitle\n";
  return report::gnuplot_png(script, 1150, 980);
}

}  // namespace tofgraph::hidden
