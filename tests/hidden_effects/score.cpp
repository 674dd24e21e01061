// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// hidden_effects_score: hides effects in many campaigns, runs the gap search on them, and scores the results.
#include "tests/hidden_effects/score_run.hpp"
#include "tests/hidden_effects/score_table.hpp"
#include "tests/hidden_effects/truth.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace {

using namespace tofgraph::hidden;
namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

std::vector<Score> read(const std::vector<fs::path>& files) {
  std::vector<Score> scores;
  for (const fs::path& path : files) {
    std::ifstream file(path);
    std::ranges::move(read_scores(file), std::back_inserter(scores));
  }
  return scores;
}

void give(const std::vector<Score>& scores, const fs::path& out) {
  const std::string text = table(scores) + cells_markdown(scores) + intervals_markdown(scores);
  write(out / "scores.md", text);
  write(out / "cells.csv", cells_csv(scores));
  std::vector<Score> single;
  std::ranges::copy_if(scores, std::back_inserter(single), [](const Score& s) { return s.what.suite == "single"; });
  if (!single.empty()) write(out / "confusion.png", confusion_png(single));
  fmt::print("{}", text);
}

/// Arguments of the command line.
struct Asked {
  std::vector<std::string> suites = {"quick"};
  std::size_t draws = 1, limit = SIZE_MAX, every = 1, from = 0;
  std::uint64_t seed = 1000;
  std::string design;
  Output output = Output::taps;
  double size = 0;
  bool plain = false;
  std::vector<fs::path> joined;
  fs::path out = "hidden_effects_scores";
  Bench bench;
};

void declare(CLI::App& app, Asked& asked) {
  std::string known;
  for (const Suite& suite : suites()) known += fmt::format("\n  {:<10}{}", suite.name, suite.text);
  app.add_option("SUITE", asked.suites, "quick (default), single, nothing, pairs, triples, without, patterns, ties");
  app.add_option("--draws", asked.draws, "how often each case is drawn anew")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--seed", asked.seed, "of all that is drawn; choose another one for tuning than for reporting")
      ->capture_default_str();
  app.add_option("--first", asked.limit, "so many cases of each suite, drawn anew until there are as many");
  app.add_option("--from", asked.from, "leaves out so many cases of each suite");
  app.add_option("--every", asked.every, "only each n-th case")->check(CLI::PositiveNumber);
  app.add_option("--design", asked.design, "in place of the suite's: small, A, B or C");
  app.add_option("--output", asked.output, "what the captures hold: taps, phases, or distances (with amplitudes)")
      ->transform(CLI::CheckedTransformer(output_names()));
  app.add_option("--size", asked.size, "in place of the suite's, as a factor on the typical one")
      ->check(CLI::PositiveNumber);
  app.add_flag("--plain", asked.plain, "the effects' main parameters alone, as the first scores were made");
  app.add_option("--program", asked.bench.program, "the tofgraph to score")->capture_default_str();
  app.add_option("--scratch", asked.bench.scratch, "where campaigns are made")->capture_default_str();
  app.add_option("-o,--out", asked.out, "folder for scores.csv, scores.md, cells.csv and confusion.png")
      ->capture_default_str();
  app.add_option("--join", asked.joined, "scores.csv of earlier runs: makes their common table, runs nothing")
      ->check(CLI::ExistingFile);
  app.add_flag(
      "--again", asked.bench.again,
      "has what was found predict another campaign of the same camera, too, between the distances of the first");
  app.add_flag("--keep", asked.bench.keep, "keeps the campaigns and reports");
  app.footer("Suites:" + known);
}

std::vector<Case> chosen_cases(const Asked& asked, const std::string& name) {
  const auto suite = std::ranges::find(suites(), name, &Suite::name);
  if (suite == suites().end()) throw std::invalid_argument("there is no suite '" + name + "'");
  const bool all = asked.limit == SIZE_MAX;
  const std::vector<Case> cases =
      cases_of(*suite, asked.seed, asked.draws, all ? 0 : asked.from + asked.limit * asked.every);
  std::vector<Case> chosen;
  for (std::size_t i = asked.from; i < cases.size() && chosen.size() < asked.limit; i += asked.every) {
    Case& one = chosen.emplace_back(cases[i]);
    if (asked.plain) one.drawn = Drawn::plain;
    if (!asked.design.empty()) one.design = asked.design;
    one.output = asked.output;
    if (asked.size > 0) one.size = asked.size;
  }
  return chosen;
}

std::vector<Score> scored(const Asked& asked) {
  std::vector<Case> cases;
  for (const std::string& name : asked.suites) std::ranges::move(chosen_cases(asked, name), std::back_inserter(cases));
  std::ofstream csv(asked.out / "scores.csv");
  csv << score_header << std::endl;
  std::vector<Score> scores;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    scores.push_back(run(cases[i], asked.bench));
    csv << scores.back().line() << std::endl;  // finished scores are kept if the rest is interrupted
    fmt::print(stderr, "{}/{} {}\n", i + 1, cases.size(), scores.back().line());
  }
  return scores;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Hides effects in campaigns of boards, has `tofgraph diagnose` look for them, and counts."};
  Asked asked;
  declare(app, asked);
  CLI11_PARSE(app, argc, argv);
  try {
    fs::create_directories(asked.out);
    give(asked.joined.empty() ? scored(asked) : read(asked.joined), asked.out);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "hidden_effects_score: {}\n", error.what());
    return 1;
  }
}
