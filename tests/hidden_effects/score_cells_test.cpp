// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Counting of reports: cell by cell, including further parameters; files of scores, including old ones.
#include "tests/hidden_effects/score_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

namespace tofgraph::hidden {
namespace {

using nlohmann::json;
using testing::HasSubstr;

json effect(const std::string& name, const std::vector<std::string>& tied, const json& parameters) {
  return {{"name", name}, {"change", "added"}, {"tied_with", tied}, {"parameters", parameters}};
}

json interval(double low, double high) { return {{"value", (low + high) / 2}, {"low", low}, {"high", high}}; }

json report(const std::string& verdict, const std::vector<json>& effects, const std::vector<std::string>& blind = {}) {
  return {{"verdict", verdict},
          {"effects", effects},
          {"blind", blind},
          {"trace", {{{"outcome", "the best so far"}}, {{"outcome", "worse than a model that it contains"}}}},
          {"gap",
           {{"held_out_before", 5e-3}, {"held_out_after", 1e-3}, {"noise_and_scatter", 1e-3}, {"noise_floor", 1e-3}}}};
}

Case hiding(const std::string& suite, const std::vector<std::string>& effects, std::uint64_t seed = 1) {
  return {.suite = suite, .effects = effects, .seed = seed};
}

TEST(Judge, IntervalsOfAllThatIsRightWithTheFurtherParameters) {
  Effects hidden;
  hidden.add("wiggling", {{"amplitude", 5e-3}, {"phase", 0.1}, {"amplitude5", 1.75e-3}, {"phase5", -3}});
  hidden.add("rail_scale", {{"scale", 1e-3}});
  const json named =
      report("named_with_rest", {effect("wiggling", {},
                                        {{"amplitude", interval(4e-3, 6e-3)},
                                         {"phase", interval(6.3, 6.5)},  // one turn further
                                         {"amplitude5", interval(0, 1e-3)},
                                         {"phase5", interval(3.2, 3.4)},
                                         {"unheard_of", interval(0, 1)}}),
                                 effect("rail_scale", {"modulation_frequency"}, {{"scale", interval(0, 2e-3)}}),
                                 effect("crosstalk", {}, {{"real", interval(-1, 1)}})});
  const Score score = judge(hiding("pairs", {"wiggling", "rail_scale"}), named, hidden, 1);
  std::set<std::string> seen;
  for (const HeldInterval& one : score.intervals) seen.insert(one.parameter + (one.holds ? " holds" : " does not"));
  EXPECT_EQ(seen,
            (std::set<std::string>{"wiggling.amplitude holds", "wiggling.phase holds", "wiggling.amplitude5 does not",
                                   "wiggling.phase5 holds", "rail_scale.scale holds"}));
  EXPECT_EQ(score.intervals.size(), 5U);
  EXPECT_EQ(score.found, 2U);
  EXPECT_EQ(score.wrong, 1U);
}

std::vector<Score> some_scores() {
  Effects hidden;
  hidden.add_typical("wiggling", 1, 1);
  hidden.add_typical("rail_scale", 1, 1);
  hidden.add_typical("crosstalk", 1, 1);
  const json right = effect("wiggling", {}, {{"amplitude", interval(4e-3, 6e-3)}});
  const json tied = effect("modulation_frequency", {"rail_scale"}, json::object());
  std::vector<Score> scores;
  const auto add = [&](const Case& what, const json& said) { scores.push_back(judge(what, said, hidden, 1)); };
  add(hiding("single", {"wiggling"}, 1), report("named", {right}));
  add(hiding("single", {"wiggling"}, 2), report("named", {effect("crosstalk", {}, json::object())}));
  add(hiding("single", {"wiggling"}, 3), report("unknown", {}));
  add(hiding("single", {"wiggling"}, 4), report("nothing_found", {}, {"wiggling"}));
  add(hiding("single", {"rail_scale"}, 5), report("tie", {tied}));
  add(hiding("single", {"crosstalk"}, 6),
      report("tie", {effect("crosstalk", {"wiggling"}, json::object())}));  // not equivalent to that name
  add(hiding("pairs", {"wiggling", "rail_scale"}, 7), report("tie", {right, tied}));
  add(hiding("pairs", {"wiggling", "crosstalk"}, 8), report("named_with_rest", {right}));
  Case quiet = hiding("nothing", {}, 9);
  quiet.noise = NoiseKind::drift;
  quiet.clutter = {"sessions", "residue"};
  add(quiet, report("nothing_found", {}));
  quiet.seed = 10;
  add(quiet, report("unknown", {}));
  Case taken = hiding("without", {"wiggling"}, 11);
  taken.without = "wiggling";
  add(taken, report("unknown", {}));
  Case lab = hiding("lab", {"wiggling", "rail_scale"}, 12);
  lab.order = Order::unstated;
  lab.given = {{"rail_scale", "scale=0.001"}, {"wiggling", "amplitude=5mm,phase=0rad"}};
  add(lab, report("named", {right, tied}));
  lab.seed = 13;
  add(lab, report("unknown", {}));
  scores.back().after = 4e-3;
  return scores;
}

const Cell& cell(const std::vector<Cell>& cells, const std::string& suite, const std::string& what) {
  const auto found =
      std::ranges::find_if(cells, [&](const Cell& one) { return one.suite == suite && one.what == what; });
  if (found == cells.end()) throw std::runtime_error("no cell " + what);
  return *found;
}

TEST(Cells, EachCaseIsOneOfSix) {
  const std::vector<Cell> cells = cells_of(some_scores());
  for (const Cell& one : cells)
    EXPECT_EQ(one.right + one.tie + one.wrong + one.unknown + one.nothing + one.blind, one.cases) << one.what;
  const Cell& wiggling = cell(cells, "single", "wiggling");
  EXPECT_EQ(wiggling.right, 1U);
  EXPECT_EQ(wiggling.wrong, 1U);
  EXPECT_EQ(wiggling.unknown, 1U);
  EXPECT_EQ(wiggling.blind, 1U);
  EXPECT_EQ(wiggling.intervals_hold, 1U);
  EXPECT_DOUBLE_EQ(wiggling.share(), 1 / 3.0);
  EXPECT_EQ(cell(cells, "single", "rail_scale").tie, 1U);
  EXPECT_EQ(cell(cells, "single", "crosstalk").wrong, 1U);
  EXPECT_EQ(cell(cells, "pairs", "wiggling").right, 2U);
  EXPECT_EQ(cell(cells, "pairs", "rail_scale").tie, 1U);
  EXPECT_EQ(cell(cells, "pairs", "crosstalk").unknown, 1U);
  EXPECT_EQ(cell(cells, "nothing", "nothing, drift+sessions+residue").right, 1U);
  EXPECT_EQ(cell(cells, "nothing", "nothing, drift+sessions+residue").unknown, 1U);
  EXPECT_EQ(cell(cells, "nothing", "nothing, drift+sessions+residue").good(), 2U) << "something is there";
  EXPECT_EQ(cell(cells, "without", "wiggling").right, 1U);
  EXPECT_EQ(worst_of(cells)->what, "crosstalk");
  EXPECT_THAT(cells_markdown(some_scores()),
              HasSubstr("\nWorst cell: single, crosstalk, design C, size 1: 0 of 1 without a mistake, 1 wrong.\n"));
  EXPECT_THAT(intervals_markdown(some_scores()), HasSubstr("| wiggling.amplitude | 4 | 4 |\n"));
}

TEST(Table, CountsWhatALaboratoryNeeds) {
  const std::string text = table(some_scores());
  EXPECT_THAT(text, HasSubstr("| lab: the set and nothing else, or tied | 90 % | 1 of 2 (50 %) |\n"));
  EXPECT_THAT(text, HasSubstr("| lab: a false name | at most 1 % | 0 of 2 (0 %) |\n"));
  EXPECT_THAT(text, HasSubstr("| lab: a gap above three times the noise | none | 1 of 2 (50 %) |\n"));
  EXPECT_THAT(text, HasSubstr("| fits that end worse than a model which they contain | none | 13 |\n"));
}

TEST(Scores, ComeBackFromTheirFile) {
  std::stringstream file;
  file << score_header << '\n';
  const std::vector<Score> scores = some_scores();
  for (const Score& score : scores) file << score.line() << '\n';
  const std::vector<Score> again = read_scores(file);
  ASSERT_EQ(again.size(), scores.size());
  for (std::size_t i = 0; i < scores.size(); ++i) EXPECT_EQ(again[i].line(), scores[i].line());
  EXPECT_EQ(cells_csv(again), cells_csv(scores));
}

TEST(Scores, EarlierFilesArePlain) {
  std::istringstream file(
      "suite,design,experiments,effects,size,pattern,without,noise,seed,verdict,names,tied,blind,found,wrong,"
      "before_mm,after_mm,floor_mm,intervals,intervals_hold,seconds\n"
      "single,C,,wiggling,0.5,,,heavy,7,named,wiggling,,0,1,0,5.0,1.0,1.0,2,2,3.5\n");
  const std::vector<Score> scores = read_scores(file);
  ASSERT_EQ(scores.size(), 1U);
  EXPECT_EQ(scores[0].what.drawn, Drawn::plain);
  EXPECT_EQ(scores[0].what.noise, NoiseKind::heavy);
  EXPECT_EQ(scores[0].what.seed, 7U);
  EXPECT_TRUE(scores[0].what.clutter.empty());
  std::istringstream broken("suite,design\nsingle\n");
  EXPECT_THROW(read_scores(broken), std::invalid_argument);
}

TEST(Suites, GoOnToAsManyCasesAsAreAskedFor) {
  for (const Suite& suite : suites()) {
    if (suite.name == "quick") continue;
    const std::vector<Case> first = suite.make(500, 1), many = cases_of(suite, 500, 1, 200);
    ASSERT_GE(many.size(), 200U) << suite.name;
    std::set<std::string> keys;
    for (std::size_t i = 0; i < many.size(); ++i) {
      EXPECT_TRUE(keys.insert(many[i].key()).second) << many[i].key();
      EXPECT_TRUE(i >= first.size() || many[i].key() == first[i].key()) << many[i].key();
    }
  }
}

TEST(Suites, NothingHasEveryNoiseAndEveryClutter) {
  const auto suite = std::ranges::find(suites(), "nothing", &Suite::name);
  std::set<std::string> seen;
  for (const Case& one : suite->make(500, 1)) {
    seen.insert(one.clutter.begin(), one.clutter.end());
    const Clutter clutter = clutter_of(one.clutter);
    EXPECT_EQ(clutter.warp != 0 || clutter.sessions != 0 || clutter.residue != 0 || clutter.misplaced != 0,
              !one.clutter.empty());
  }
  EXPECT_EQ(seen, (std::set<std::string>{"misplaced", "residue", "sessions", "warp"}));
  EXPECT_THROW(clutter_of({"dust"}), std::invalid_argument);
}

}  // namespace
}  // namespace tofgraph::hidden
