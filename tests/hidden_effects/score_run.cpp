// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/score_run.hpp"

#include "tests/hidden_effects/effects.hpp"
#include "tests/hidden_effects/like.hpp"
#include "tests/hidden_effects/patterns.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <fstream>

namespace tofgraph::hidden {

CampaignOptions campaign_of(const Case& what) {
  CampaignOptions options;
  for (const std::string& name : what.effects) {
    const auto given = what.given.find(name);
    options.effects.add_text(given == what.given.end() ? name : name + ":" + given->second, what.size, what.seed,
                             what.drawn);
  }
  options.design = what.design;
  options.experiments = what.experiments;
  if (!what.pattern.empty()) options.patterns.push_back(parse_pattern(what.pattern, what.size));
  options.noise = what.noise;
  options.output = what.output;
  options.clutter = clutter_of(what.clutter);
  options.jitter = what.jitter;
  options.order = what.order;
  options.seed = what.seed;
  return options;
}

nlohmann::json searched(const std::filesystem::path& campaign, const Bench& bench, const std::string& options) {
  const std::string command =
      fmt::format("'{}' diagnose --model '{}/model.yaml' --data '{}/campaign.yaml' -o '{}/gap' --quiet{}",
                  bench.program, campaign.string(), campaign.string(), campaign.string(), options);
  if (std::system(command.c_str()) != 0) throw std::runtime_error("the search failed: " + command);
  std::ifstream file(campaign / "gap/report.json");
  return nlohmann::json::parse(file);
}

namespace {

/// Depth gap of the unchanged extended model on a new campaign of the same camera, m.
double gap_again(const std::filesystem::path& campaign, std::uint64_t seed, const Bench& bench) {
  CampaignOptions options = like(campaign / "truth.yaml", seed);
  options.folder = campaign / "again";
  make_campaign(options);
  // Also copies the maps that the model names.
  for (const auto& file : std::filesystem::directory_iterator(campaign / "gap")) {
    if (file.path().filename() == "model.yaml" || file.path().extension() == ".h5")
      std::filesystem::copy_file(file.path(), options.folder / file.path().filename(),
                                 std::filesystem::copy_options::overwrite_existing);
  }
  return searched(options.folder, bench, " --max-effects 0")["gap"]["before"];
}

}  // namespace

Score run(const Case& what, const Bench& bench) {
  CampaignOptions options = campaign_of(what);
  options.every = bench.every;
  options.frames = what.frames > 0 ? what.frames : bench.frames;
  options.folder = bench.scratch / fmt::format("{}_{}", what.suite, what.seed);
  std::filesystem::remove_all(options.folder);
  make_campaign(options);
  const auto start = std::chrono::steady_clock::now();
  const nlohmann::json report =
      searched(options.folder, bench,
               fmt::format(" --seed {}{}", what.seed, what.without.empty() ? "" : " --without " + what.without));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  Score score = judge(what, report, options.effects, seconds);
  if (bench.again) score.again = gap_again(options.folder, what.seed + 1'000'000, bench);
  if (!bench.keep) std::filesystem::remove_all(options.folder);
  return score;
}

}  // namespace tofgraph::hidden
