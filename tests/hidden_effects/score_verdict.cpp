// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/score_verdict.hpp"

#include "tests/hidden_effects/truth.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

namespace tofgraph::hidden {
namespace {

using nlohmann::json;

/// Intervals of a correctly named effect, for every parameter contained in both the report and the catalogue.
void collect_intervals(const json& effect, const Effects& hidden, Score& score) {
  const std::string name = effect["name"];
  const auto known = std::ranges::find(catalogue(), name, &Effect::name);
  for (const auto& [parameter, value] : effect["parameters"].items()) {
    if (known == catalogue().end() ||
        std::ranges::find(known->parameters, parameter, &Parameter::name) == known->parameters.end())
      continue;
    // Of an estimated map, only the product with its scale is known.
    if (name == "fixed_pattern" || name == "pixel_response") continue;
    if (name == "specular" && parameter == "strength") continue;  // scales with the light's power, which is unknown
    if (!value.contains("low") || !value["low"].is_number() || !value["high"].is_number()) continue;
    const double low = value["low"], high = value["high"];
    double truth = hidden.value(name, parameter);
    if (parameter.starts_with("phase")) truth += 2 * M_PI * std::round(((low + high) / 2 - truth) / (2 * M_PI));
    score.intervals.push_back({name + "." + parameter, low <= truth && truth <= high});
  }
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

std::string interval_list(const std::vector<HeldInterval>& intervals) {
  std::vector<std::string> texts;
  for (const HeldInterval& one : intervals) texts.push_back(one.parameter + (one.holds ? "=1" : "=0"));
  return fmt::format("{}", fmt::join(texts, "+"));
}

/// "zero_offset:offset=4mm integration_time_offset:slope=4mm;exponent=0.5": a cell has no commas.
std::string given_text(const std::map<std::string, std::string>& given) {
  std::vector<std::string> texts;
  for (const auto& [name, values] : given) texts.push_back(name + ":" + values);
  std::string text = fmt::format("{}", fmt::join(texts, " "));
  std::ranges::replace(text, ',', ';');
  return text;
}

std::map<std::string, std::string> parse_given(std::string text) {
  std::ranges::replace(text, ';', ',');
  std::map<std::string, std::string> given;
  for (const std::string& one : split(text, ' ')) {
    const std::size_t colon = one.find(':');
    given[one.substr(0, colon)] = one.substr(colon + 1);
  }
  return given;
}

std::vector<HeldInterval> parse_intervals(const std::string& text) {
  std::vector<HeldInterval> intervals;
  for (const std::string& one : split(text, '+')) {
    const std::size_t equals = one.find('=');
    intervals.push_back({one.substr(0, equals), one.substr(equals + 1) == "1"});
  }
  return intervals;
}

Score parse_score(const std::map<std::string, std::string>& c) {
  Score s;
  s.what = {.suite = c.at("suite"),
            .design = c.at("design"),
            .experiments = split(c.at("experiments"), '+'),
            .effects = split(c.at("effects"), '+'),
            .size = std::stod(c.at("size")),
            // The first files had neither: they used plain draws, without clutter.
            .drawn = c.contains("drawn") && c.at("drawn") == "all" ? Drawn::all : Drawn::plain,
            .pattern = c.at("pattern"),
            .without = c.at("without"),
            .noise = c.at("noise") == "heavy"   ? NoiseKind::heavy
                     : c.at("noise") == "drift" ? NoiseKind::drift
                     : c.at("noise") == "none"  ? NoiseKind::none
                                                : NoiseKind::gaussian,
            .output = c.contains("output") ? output_names().at(c.at("output")) : Output::taps,
            .clutter = split(c.contains("clutter") ? c.at("clutter") : "", '+'),
            .seed = std::stoull(c.at("seed"))};
  if (c.contains("order")) s.what.order = order_names().at(c.at("order"));
  if (c.contains("given")) s.what.given = parse_given(c.at("given"));
  if (c.contains("noise_mm")) s.noise = std::stod(c.at("noise_mm")) / 1e3;
  if (c.contains("worse_fits")) s.worse_fits = std::stoul(c.at("worse_fits"));
  s.verdict = c.at("verdict");
  s.names = split(c.at("names"), '+');
  s.tied = split(c.at("tied"), '+');
  s.blind = c.at("blind") == "1";
  s.found = std::stoul(c.at("found"));
  s.wrong = std::stoul(c.at("wrong"));
  s.before = std::stod(c.at("before_mm")) / 1e3;
  s.after = std::stod(c.at("after_mm")) / 1e3;
  s.floor = std::stod(c.at("floor_mm")) / 1e3;
  if (c.contains("interval_list")) s.intervals = parse_intervals(c.at("interval_list"));
  s.seconds = std::stod(c.at("seconds"));
  if (c.contains("again_mm") && c.at("again_mm") != "-") s.again = std::stod(c.at("again_mm")) / 1e3;
  return s;
}

}  // namespace

std::string Score::line() const {
  const auto held = std::ranges::count(intervals, true, &HeldInterval::holds);
  return fmt::format("{},{},{},{},{},{},{},{:.4f},{:.4f},{:.4f},{},{},{},{:.1f},{},{},{},{},{:.4f}", what.key(),
                     verdict, fmt::join(names, "+"), fmt::join(tied, "+"), blind ? 1 : 0, found, wrong, 1e3 * before,
                     1e3 * after, 1e3 * floor, intervals.size(), held, interval_list(intervals), seconds,
                     again ? fmt::format("{:.4f}", 1e3 * *again) : "-", name_of(what.order), given_text(what.given),
                     worse_fits, 1e3 * noise);
}

std::vector<Score> read_scores(std::istream& in) {
  std::vector<Score> scores;
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> names = split(line, ',');
  while (std::getline(in, line)) {
    const std::vector<std::string> cells = split(line, ',');
    if (cells.size() != names.size()) throw std::invalid_argument("this is not a line of scores: " + line);
    std::map<std::string, std::string> row;
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = cells[i];
    scores.push_back(parse_score(row));
  }
  return scores;
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
    if (is_hidden(name)) collect_intervals(effect, hidden, score);
  }
  score.found = covered.size();
  const std::vector<std::string> blind = report["blind"];
  score.blind = what.effects.size() == 1 && std::ranges::find(blind, what.effects.front()) != blind.end();
  score.before = report["gap"]["held_out_before"];
  score.after = report["gap"]["held_out_after"];
  score.floor = report["gap"]["noise_and_scatter"];
  score.noise = report["gap"]["noise_floor"].is_number() ? report["gap"]["noise_floor"].get<double>() : NAN;
  score.worse_fits = static_cast<std::size_t>(std::ranges::count_if(
      report["trace"], [](const json& step) { return step["outcome"] == "worse than a model that it contains"; }));
  return score;
}

bool has_loose_tie(const Score& score) {
  return std::ranges::any_of(score.tied, [&](const std::string& tied) {
    return std::ranges::none_of(score.what.effects, [&](const std::string& hidden) {
      return tied == hidden || are_alike(score.what, tied, hidden);
    });
  });
}

bool is_right(const Score& score) {
  return score.found == score.what.effects.size() && score.wrong == 0 && !has_loose_tie(score);
}

std::optional<double> closed(const Score& score) {
  const double open = score.before - score.floor;
  if (open <= 0.2 * score.floor) return std::nullopt;
  return (score.before - score.after) / open;
}

}  // namespace tofgraph::hidden
