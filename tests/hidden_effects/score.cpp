// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// hidden_effects_score: hides effects in many campaigns, has the gap search look for them, and counts.
#include "tests/hidden_effects/score_verdict.hpp"

#include "tests/hidden_effects/effects.hpp"
#include "tests/hidden_effects/patterns.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace {

using namespace tofgraph::hidden;
namespace fs = std::filesystem;

struct Bench {
  std::string program = TOFGRAPH_PROGRAM;
  fs::path scratch = fs::temp_directory_path() / "hidden_effects", out = "hidden_effects_scores";
  bool keep = false;
};

Effects effects_of(const Case& what) {
  Effects effects;
  for (const std::string& name : what.effects) effects.add_text(name, what.size, what.seed);
  return effects;
}

/// Makes the campaign, has it searched, compares. @throws std::runtime_error when the search fails
Score run(const Case& what, const Bench& bench) {
  const fs::path folder = bench.scratch / fmt::format("{}_{}", what.suite, what.seed);
  fs::remove_all(folder);
  const Effects effects = effects_of(what);
  CampaignOptions options;
  options.design = what.design;
  options.experiments = what.experiments;
  options.effects = effects;
  if (!what.pattern.empty()) options.patterns.push_back(parse_pattern(what.pattern, what.size));
  options.noise = what.noise;
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
  if (!bench.keep) fs::remove_all(folder);
  return score;
}

void write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

std::vector<Score> read(const std::vector<fs::path>& files) {
  std::vector<Score> scores;
  for (const fs::path& path : files) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);  // the names
    while (std::getline(file, line)) scores.push_back(parse_score(line));
  }
  return scores;
}

void give(const std::vector<Score>& scores, const Bench& bench) {
  write(bench.out / "scores.md", table(scores));
  if (std::ranges::any_of(scores, [](const Score& s) { return s.what.suite == "single"; }))
    write(bench.out / "confusion.png", confusion_png(scores));
  fmt::print("{}", table(scores));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Hides effects in campaigns of boards, has `tofgraph diagnose` look for them, and counts."};
  Bench bench;
  std::vector<std::string> chosen = {"quick"};
  std::size_t draws = 1, limit = SIZE_MAX, every = 1;
  std::uint64_t seed = 1000;
  std::vector<fs::path> joined;
  std::string known;
  for (const Suite& suite : suites()) known += fmt::format("\n  {:<10}{}", suite.name, suite.text);
  app.add_option("SUITE", chosen, "quick (default), single, nothing, pairs, triples, without, patterns, ties");
  app.add_option("--draws", draws, "how often each case is drawn anew")->capture_default_str();
  app.add_option("--seed", seed, "of all that is drawn; choose another one for tuning than for reporting")
      ->capture_default_str();
  app.add_option("--first", limit, "only so many cases of each suite");
  app.add_option("--every", every, "only each n-th case")->check(CLI::PositiveNumber);
  app.add_option("--program", bench.program, "the tofgraph to score")->capture_default_str();
  app.add_option("--scratch", bench.scratch, "where campaigns are made")->capture_default_str();
  app.add_option("-o,--out", bench.out, "folder for scores.csv, scores.md and confusion.png")->capture_default_str();
  app.add_option("--join", joined, "scores.csv of earlier runs: makes their common table, runs nothing")
      ->check(CLI::ExistingFile);
  app.add_flag("--keep", bench.keep, "keeps the campaigns and reports");
  app.footer("Suites:" + known);
  CLI11_PARSE(app, argc, argv);
  try {
    fs::create_directories(bench.out);
    if (!joined.empty()) return give(read(joined), bench), 0;
    std::ofstream csv(bench.out / "scores.csv");
    csv << score_header << std::endl;
    std::vector<Score> scores;
    for (const std::string& name : chosen) {
      const auto suite = std::ranges::find(suites(), name, &Suite::name);
      if (suite == suites().end()) throw std::invalid_argument("there is no suite '" + name + "'");
      const std::vector<Case> cases = suite->make(seed, draws);
      for (std::size_t i = 0; i < cases.size() && i / every < limit; i += every) {
        const Score score = run(cases[i], bench);
        scores.push_back(score);
        csv << score.line() << std::endl;  // what is scored stays when the rest is interrupted
        fmt::print(stderr, "{}/{} {}\n", i + 1, cases.size(), score.line());
      }
    }
    give(scores, bench);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "hidden_effects_score: {}\n", error.what());
    return 1;
  }
}
