// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// hidden_effects_mistyped: how often the check before the gap search names a wrongly written condition, how often it
// names a correct one, and whether the search without the named conditions finds the hidden effect. Prints missed and
// falsely named conditions, then a table.
#include "diagnosis/data/plausibility.hpp"
#include "diagnosis/data/search_settings.hpp"
#include "tests/hidden_effects/effects.hpp"
#include "tests/hidden_effects/mistakes.hpp"
#include "tests/hidden_effects/score_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <map>

namespace {

using namespace tofgraph;

struct Count {
  int made = 0, named = 0, accused = 0;  ///< campaigns: all wrong conditions named; some correct one named
  int searched = 0, found = 0;           ///< visible cases named exactly: correct without the named conditions
};

struct Asked {
  std::string design = "B";
  std::uint64_t seed = 61000;
  std::size_t first = 0;  ///< effects; 0: all
  int draws = 1;
  bool clutter = false, search = false;
  hidden::Bench bench{.scratch = std::filesystem::temp_directory_path() / "hidden_effects_mistyped"};
};

/// Measurements of a campaign in which only some conditions have changed.
diagnosis::Measurements updated(const diagnosis::Measurements& before, const io::Campaign& campaign,
                                const std::vector<std::size_t>& wrong) {
  io::Campaign part = campaign;
  part.conditions.clear();
  for (const std::size_t i : wrong) part.conditions.push_back(campaign.conditions[i]);
  for (std::size_t i = 0; i < diagnosis::settings.min_conditions; ++i)  // to reach the minimum number
    if (std::ranges::find(wrong, i) == wrong.end()) part.conditions.push_back(campaign.conditions[i]);
  for (std::size_t i = 0; part.conditions.size() < diagnosis::settings.min_conditions; ++i)
    part.conditions.push_back(campaign.conditions[diagnosis::settings.min_conditions + i]);
  const diagnosis::Measurements read = diagnosis::measure(part, {});
  diagnosis::Measurements after = before;
  std::vector<io::Condition> conditions = before.design->conditions();
  for (std::size_t k = 0; k < wrong.size(); ++k) {
    conditions[wrong[k]] = read.design->conditions()[k];
    after.observations[wrong[k]] = read.observations[k];
    after.recorded_times[wrong[k]] = read.recorded_times[k];
  }
  after.design = std::make_shared<const diagnosis::Design>(campaign.camera, false, conditions);
  return after;
}

/// @returns whether it named all wrong conditions and no others
bool count(const std::string& name, const io::Campaign& campaign, const diagnosis::Measurements& measurements,
           const std::vector<std::size_t>& wrong, std::map<std::string, Count>& counts) {
  std::size_t named = 0;
  bool accused = false;
  std::string said;
  for (const diagnosis::Contradiction& one : contradictions(measurements)) {
    const bool right = std::ranges::find(wrong, one.condition) != wrong.end();
    right ? static_cast<void>(++named) : static_cast<void>(accused = true);
    said += fmt::format("  {}: {}\n", campaign.conditions[one.condition].id, one.text);
  }
  Count& here = counts[name];
  ++here.made;
  if (named == wrong.size()) ++here.named;
  if (accused) ++here.accused;
  if (named == wrong.size() && !accused) return true;
  fmt::print("{}: {}", campaign.name, name);
  for (const std::size_t i : wrong) fmt::print(", {} is wrong", campaign.conditions[i].id);
  fmt::print("\n{}", said);
  return false;
}

/// Repeats the search as a user who was told of an error would: those conditions are skipped.
void search_beside(const Asked& asked, const hidden::CampaignOptions& made, const std::string& effect,
                   const io::Campaign& campaign, const std::vector<std::size_t>& wrong, Count& here) {
  std::string skipped = fmt::format(" --seed {}", made.seed);
  for (const std::size_t i : wrong) skipped += fmt::format(" --skip '{}'", campaign.conditions[i].id);
  const hidden::Case what{.suite = "mistyped", .design = asked.design, .effects = {effect}, .seed = made.seed};
  const hidden::Score score = judge(what, hidden::searched(made.folder, asked.bench, skipped), made.effects, 0);
  if (score.blind) return;
  ++here.searched;
  if (is_right(score)) ++here.found;
  if (!is_right(score)) fmt::print("{}: {}, {}\n", campaign.name, score.verdict, fmt::join(score.names, ", "));
}

void run(const Asked& asked, const std::string& effect, std::uint64_t seed, std::map<std::string, Count>& counts) {
  hidden::CampaignOptions options;
  options.design = asked.design;
  options.seed = seed;
  options.frames = 2;
  options.folder = asked.bench.scratch / fmt::format("{}_{}", asked.design, seed);
  options.effects.add_text(effect, 1, seed);
  if (asked.clutter) options.clutter = hidden::clutter_of({"warp", "sessions", "residue", "misplaced"});
  std::filesystem::remove_all(options.folder);
  hidden::make_campaign(options);
  config::Diagnostics diagnostics;
  io::Campaign right = io::read_campaign(options.folder / "campaign.yaml", diagnostics);
  right.name += ", " + effect;
  const diagnosis::Measurements measured = diagnosis::measure(right, {});
  count("nothing wrong", right, measured, {}, counts);
  std::mt19937_64 random(seed);
  for (int draw = 0; draw < asked.draws; ++draw) {
    for (std::size_t m = 0; m < hidden::mistake_names.size(); ++m) {
      for (const bool recorded : {true, false}) {
        io::Campaign wrong = right;
        const auto at = make_mistake(wrong, static_cast<hidden::Mistake>(m), random);
        if (at.empty()) continue;
        diagnosis::Measurements after = updated(measured, wrong, at);
        if (!recorded) std::ranges::fill(after.recorded_times, io::unknown);
        const std::string name =
            fmt::format("{}{}", hidden::mistake_names.at(m), recorded ? "" : ", no recorded times");
        const bool exactly = count(name, wrong, after, at, counts);
        // A search takes long: one error per campaign, each kind in turn.
        const bool turn = draw == 0 && recorded && seed % hidden::mistake_names.size() == m;
        if (asked.search && exactly && turn) search_beside(asked, options, effect, right, at, counts[name]);
      }
    }
  }
  std::filesystem::remove_all(options.folder);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Counts how often a mistake in a campaign file is named, one campaign an effect of the catalogue."};
  Asked asked;
  app.add_option("--design", asked.design, "small, A, B or C")->capture_default_str();
  app.add_option("--seed", asked.seed, "of the first campaign; the others count on")->capture_default_str();
  app.add_option("--first", asked.first, "campaigns; default: one an effect");
  app.add_option("--draws", asked.draws, "of each mistake in each campaign")->capture_default_str();
  app.add_flag("--clutter", asked.clutter, "warp, sessions, residue and a misplaced board at their usual sizes");
  app.add_flag("--search", asked.search, "searches without what was named, one mistake a campaign");
  app.add_option("--program", asked.bench.program, "the tofgraph that searches")->capture_default_str();
  app.add_option("--scratch", asked.bench.scratch, "a folder for the campaigns");
  CLI11_PARSE(app, argc, argv);
  std::map<std::string, Count> counts;
  std::size_t made = 0;
  try {
    for (const hidden::Effect& effect : hidden::catalogue()) {
      if (hidden::is_hidden_from_boards(effect.name)) continue;
      if (asked.first != 0 && made == asked.first) break;
      run(asked, effect.name, asked.seed + made++, counts);
    }
  } catch (const std::exception& failure) {
    fmt::print(stderr, "hidden_effects_mistyped: {}\n", failure.what());
    return 1;
  }
  fmt::print(
      "\n| mistake | named | right ones accused | of these searched, right effect beside it |\n| --- | --- | --- | --- "
      "|\n");
  for (const auto& [name, c] : counts)
    fmt::print("| {} | {} of {} | {} of {} | {} of {} |\n", name, c.named, c.made, c.accused, c.made, c.found,
               c.searched);
  return 0;
}
