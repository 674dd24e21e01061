// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/score_run.hpp"

#include "tests/hidden_effects/effects.hpp"
#include "tests/hidden_effects/patterns.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <fstream>

namespace tofgraph::hidden {

Score run(const Case& what, const Bench& bench) {
  const std::filesystem::path folder = bench.scratch / fmt::format("{}_{}", what.suite, what.seed);
  std::filesystem::remove_all(folder);
  Effects effects;
  for (const std::string& name : what.effects) effects.add_text(name, what.size, what.seed, what.drawn);
  CampaignOptions options;
  options.design = what.design;
  options.experiments = what.experiments;
  options.effects = effects;
  if (!what.pattern.empty()) options.patterns.push_back(parse_pattern(what.pattern, what.size));
  options.noise = what.noise;
  options.output = what.output;
  options.clutter = clutter_of(what.clutter);
  options.seed = what.seed;
  options.folder = folder;
  make_campaign(options);
  const auto start = std::chrono::steady_clock::now();
  const std::string command =
      fmt::format("'{}' diagnose --model '{}/model.yaml' --data '{}/campaign.yaml' -o '{}/gap' --quiet --seed {}{}",
                  bench.program, folder.string(), folder.string(), folder.string(), what.seed,
                  what.without.empty() ? "" : " --without " + what.without);
  if (std::system(command.c_str()) != 0) throw std::runtime_error("the search failed: " + command);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::ifstream file(folder / "gap/report.json");
  const Score score = judge(what, nlohmann::json::parse(file), effects, seconds);
  if (!bench.keep) std::filesystem::remove_all(folder);
  return score;
}

}  // namespace tofgraph::hidden
