// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// hidden_effects_score: hides effects in many campaigns, has the gap search look for them, and counts.
#include "tests/hidden_effects/score_run.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>
#include <fstream>

namespace {

using namespace tofgraph::hidden;
namespace fs = std::filesystem;

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

void give(const std::vector<Score>& scores, const fs::path& out) {
  write(out / "scores.md", table(scores));
  if (std::ranges::any_of(scores, [](const Score& s) { return s.what.suite == "single"; }))
    write(out / "confusion.png", confusion_png(scores));
  fmt::print("{}", table(scores));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Hides effects in campaigns of boards, has `tofgraph diagnose` look for them, and counts."};
  Bench bench;
  fs::path out = "hidden_effects_scores";
  std::vector<std::string> chosen = {"quick"};
  std::size_t draws = 1, limit = SIZE_MAX, every = 1, from = 0;
  std::uint64_t seed = 1000;
  std::vector<fs::path> joined;
  std::string known;
  for (const Suite& suite : suites()) known += fmt::format("\n  {:<10}{}", suite.name, suite.text);
  app.add_option("SUITE", chosen, "quick (default), single, nothing, pairs, triples, without, patterns, ties");
  app.add_option("--draws", draws, "how often each case is drawn anew")->capture_default_str();
  app.add_option("--seed", seed, "of all that is drawn; choose another one for tuning than for reporting")
      ->capture_default_str();
  app.add_option("--first", limit, "only so many cases of each suite");
  app.add_option("--from", from, "leaves out so many cases of each suite");
  app.add_option("--every", every, "only each n-th case")->check(CLI::PositiveNumber);
  app.add_option("--program", bench.program, "the tofgraph to score")->capture_default_str();
  app.add_option("--scratch", bench.scratch, "where campaigns are made")->capture_default_str();
  app.add_option("-o,--out", out, "folder for scores.csv, scores.md and confusion.png")->capture_default_str();
  app.add_option("--join", joined, "scores.csv of earlier runs: makes their common table, runs nothing")
      ->check(CLI::ExistingFile);
  app.add_flag("--keep", bench.keep, "keeps the campaigns and reports");
  app.footer("Suites:" + known);
  CLI11_PARSE(app, argc, argv);
  try {
    fs::create_directories(out);
    if (!joined.empty()) return give(read(joined), out), 0;
    std::ofstream csv(out / "scores.csv");
    csv << score_header << std::endl;
    std::vector<Score> scores;
    for (const std::string& name : chosen) {
      const auto suite = std::ranges::find(suites(), name, &Suite::name);
      if (suite == suites().end()) throw std::invalid_argument("there is no suite '" + name + "'");
      const std::vector<Case> cases = suite->make(seed, draws);
      for (std::size_t i = from; i < cases.size() && (i - from) / every < limit; i += every) {
        const Score score = run(cases[i], bench);
        scores.push_back(score);
        csv << score.line() << std::endl;  // what is scored stays when the rest is interrupted
        fmt::print(stderr, "{}/{} {}\n", i + 1, cases.size(), score.line());
      }
    }
    give(scores, out);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "hidden_effects_score: {}\n", error.what());
    return 1;
  }
}
