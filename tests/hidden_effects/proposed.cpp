// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// hidden_effects_proposed: benefit of the condition that a report proposes to measure next. A campaign that leaves an
// effect undetermined, in a tie or undetectable, is extended by the proposed condition, and by a random one.
#include "tests/hidden_effects/designs.hpp"
#include "tests/hidden_effects/effects.hpp"
#include "tests/hidden_effects/score_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace {

using namespace tofgraph;
using hidden::Score;
using nlohmann::json;

struct Asked {
  std::string design = "A", effect;
  double size = 0.5;
  std::uint64_t seed = 62000;
  std::size_t first = 0;  ///< effects; 0: all
  std::size_t repeats = 6;
  hidden::Bench bench;
};

struct Count {
  int open = 0, proposed = 0, closed = 0, closed_at_random = 0;
};

bool names(const Score& score, const std::string& effect) {
  return std::ranges::find(score.names, effect) != score.names.end();
}

/// Returns whether a question is resolved: the hidden effect is found, and not tied with the alternatives of the
/// proposal; if it was not visible before, by its own name.
bool is_closed(const Score& score, const std::vector<std::string>& effects) {
  const std::string& hidden = score.what.effects.front();
  if (effects.size() == 1 && !names(score, hidden)) return false;
  return score.found == 1 && score.wrong == 0 && std::ranges::none_of(effects, [&](const std::string& other) {
           return other != hidden && (names(score, other) || std::ranges::find(score.tied, other) != score.tied.end());
         });
}

constexpr double longest_of_camera = 50e-3;  ///< s

double number(const json& value) { return value.is_null() ? io::unknown : value.get<double>(); }

/// Proposal of the report for an effect; nullptr: none, as no condition would be more informative.
const json* proposal_for(const json& report, const std::string& effect) {
  for (const json& next : report["next"]) {
    const double sigma = next["standard_deviations"];
    const bool tells = sigma >= 2 && sigma > 1.1 * next["standard_deviations_measured"].get<double>();
    if (tells && std::ranges::find(next["effects"], json(effect)) != next["effects"].end()) return &next;
  }
  return nullptr;
}

io::Condition proposed(const json& from) {
  io::Condition condition;
  if (from["lens"] == "capped") condition.lens = "capped";
  condition.board_distance = number(from["distance"]);
  condition.board_tilt_x = number(from["tilt_x"]);
  condition.board_tilt_y = number(from["tilt_y"]);
  condition.target = from["target"];
  condition.integration_time = number(from["integration_time"]);
  condition.time_since_power_on = number(from["time_since_power_on"]);
  condition.sources = from["sources"];
  condition.ambient = from["ambient"];
  if (from["rail"].is_string()) condition.rail = from["rail"];
  if (from["reference"].is_string()) condition.reference = from["reference"];
  condition.roll = from["roll"];
  return condition;
}

/// Any condition that a lab could measure on the same rail: a target of the campaign, from 0.7 times its shortest to
/// 1.3 times its longest distance, half its shortest to twice its longest time, facing the camera or tilted by 20 deg,
/// a camera just switched on or on for as long or twice as long; every second one with the lens capped, a single
/// source, a lamp, the rail covered, a laser, or the camera rotated.
io::Condition random_one(const std::vector<io::Condition>& campaign, std::mt19937_64& random) {
  const auto range = [&](double io::Condition::*value) {
    const auto [least, most] = std::ranges::minmax(campaign, {}, value);
    return std::pair(least.*value, most.*value);
  };
  const auto between = [&](double least, double most) { return std::uniform_real_distribution(least, most)(random); };
  const auto [near, far] = range(&io::Condition::board_distance);
  const auto [shortest, longest] = range(&io::Condition::integration_time);
  const auto any = [&](std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random); };
  io::Condition condition;
  condition.target = campaign[any(campaign.size())].target;
  condition.board_distance = between(0.7 * near, 1.3 * far);
  condition.integration_time = std::exp(between(std::log(shortest / 2), std::log(2 * longest)));
  const double since = campaign[any(campaign.size())].time_since_power_on;
  condition.time_since_power_on = std::array{60.0, since, 2 * since}.at(any(3));
  constexpr double tilt = 20 * std::numbers::pi / 180;
  constexpr std::array<std::array<double, 2>, 5> tilts = {{{0, 0}, {tilt, 0}, {-tilt, 0}, {0, tilt}, {0, -tilt}}};
  const auto [x, y] = tilts.at(any(tilts.size()));
  condition.board_tilt_x = x;
  condition.board_tilt_y = y;
  switch (any(12)) {
    case 0:
      condition.lens = "capped";
      condition.integration_time = std::exp(between(std::log(shortest / 2), std::log(longest_of_camera)));
      break;
    case 1:
      condition.sources = {any(2) == 0 ? "left" : "right"};
      break;
    case 2:
      condition.ambient = "lamp";
      break;
    case 3:
      condition.rail = "covered";
      break;
    case 4:
      condition.reference = "laser";
      break;
    case 5:
      condition.roll = std::numbers::pi / 2;
      break;
    default:
      break;
  }
  return condition;
}

Score search(const Asked& asked, const hidden::Case& what, const char* with, const std::vector<io::Condition>& more,
             json& report) {
  hidden::CampaignOptions options = campaign_of(what);
  options.more = more;
  options.folder = asked.bench.scratch / fmt::format("{}_{}_{}", asked.design, what.seed, with);
  std::filesystem::remove_all(options.folder);
  make_campaign(options);
  report = searched(options.folder, asked.bench, fmt::format(" --seed {}", what.seed));
  if (!asked.bench.keep) std::filesystem::remove_all(options.folder);
  return judge(what, report, options.effects, 0);
}

std::string outcome(const Score& score) {
  std::string text = score.names.empty() ? score.verdict : fmt::format("{}", fmt::join(score.names, ", "));
  if (!score.tied.empty()) text += fmt::format(" (or {})", fmt::join(score.tied, ", "));
  return text;
}

std::string text_of(const io::Condition& c) {
  std::string text =
      c.is_capped() ? "lens capped"
                    : fmt::format("{} at {:.2f} m, tilted by {:.0f} and {:.0f} deg", c.target, c.board_distance,
                                  c.board_tilt_x * 180 / std::numbers::pi, c.board_tilt_y * 180 / std::numbers::pi);
  text += fmt::format(", {:.2f} ms, {:.0f} s", c.integration_time * 1e3, c.time_since_power_on);
  if (!c.sources.empty()) text += ", " + c.sources.front();
  for (const std::string& other : {c.ambient, c.rail, c.reference})
    if (other == "lamp" || other == "covered" || other == "laser") text += ", " + other;
  return text + (c.roll != 0 ? ", turned" : "");
}

void run(const Asked& asked, const std::string& effect, std::uint64_t seed, Count& tied, Count& unseen) {
  const hidden::Case what{
      .suite = "proposed", .design = asked.design, .effects = {effect}, .size = asked.size, .seed = seed};
  json report;
  const Score before = search(asked, what, "alone", {}, report);
  if (names(before, effect) && before.tied.empty() && before.wrong == 0) return;
  Count& count = before.found > 0 ? tied : unseen;
  ++count.open;
  fmt::print("{} ({}): {}\n", effect, seed, outcome(before));
  const json* proposal = proposal_for(report, effect);
  if (!proposal) return fmt::print("  nothing proposed\n");
  ++count.proposed;
  const auto try_one = [&](const char* which, const io::Condition& condition, int& closed) {
    json again;
    const Score after = search(asked, what, which, std::vector(asked.repeats, condition), again);
    if (is_closed(after, (*proposal)["effects"])) ++closed;
    fmt::print("  {}, {}: {}\n", which, text_of(condition), outcome(after));
  };
  fmt::print("  {}\n", (*proposal)["text"].get<std::string>());
  try_one("proposed", proposed((*proposal)["condition"]), count.closed);
  std::mt19937_64 random(seed);
  const std::vector<io::Condition> design = hidden::conditions_of(asked.design, {});
  try_one("random", random_one(design, random), count.closed_at_random);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Measures campaigns that leave their hidden effect open again, with the condition that the report proposes."};
  Asked asked;
  app.add_option("--design", asked.design, "small, A, B or C")->capture_default_str();
  app.add_option("--effect", asked.effect, "this one only");
  app.add_option("--size", asked.size, "as a factor on the typical one")->capture_default_str();
  app.add_option("--seed", asked.seed, "of the first campaign; the others count on")->capture_default_str();
  app.add_option("--first", asked.first, "campaigns; default: one an effect");
  app.add_option("--repeats", asked.repeats, "how often the condition is measured, the board set up anew each time")
      ->capture_default_str();
  app.add_option("--program", asked.bench.program, "the tofgraph to score")->capture_default_str();
  app.add_flag("--keep", asked.bench.keep, "keeps the campaigns");
  app.add_option("--scratch", asked.bench.scratch, "a folder for the campaigns")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  Count tied, unseen;
  std::size_t made = 0;
  try {
    for (const hidden::Effect& effect : hidden::catalogue()) {
      if (hidden::is_hidden_from_boards(effect.name) || (!asked.effect.empty() && asked.effect != effect.name))
        continue;
      if (asked.first != 0 && made == asked.first) break;
      run(asked, effect.name, asked.seed + made++, tied, unseen);
    }
  } catch (const std::exception& failure) {
    fmt::print(stderr, "hidden_effects_proposed: {}\n", failure.what());
    return 1;
  }
  fmt::print("\n{} campaigns\n\n| left open | campaigns | with a proposal | told with it | with a random one |\n",
             made);
  fmt::print("| --- | --- | --- | --- | --- |\n");
  for (const auto& [name, c] : {std::pair("a tie", tied), {"not seen", unseen}})
    fmt::print("| {} | {} | {} | {} | {} |\n", name, c.open, c.proposed, c.closed, c.closed_at_random);
  return 0;
}
