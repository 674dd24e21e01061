// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: *PutAside.WhereverItStands*
// Rooms: diagnosis simulation
// Excluded conditions: whichever they are, and wherever they are in the file, the search continues with the
// others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "diagnosis/diagnose.hpp"
#include "io/profile.hpp"
#include "tests/program.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace tofgraph::diagnosis {
namespace {

namespace fs = std::filesystem;
using tests::write_text;

/// Distances that a search holds out one by one.
constexpr std::array depths = {0.8, 1.3, 1.9, 2.6, 3.4};  // m
/// A camera with wiggling: its distance error at a depth.
double wiggle(double depth) { return 6e-3 * std::sin(4 * depth); }

/// Five boards on a rail, as captures or as a table of their means.
class PutAside : public testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() {
    folder = std::make_unique<tests::TemporaryFolder>();
    write_text(path("model.yaml"), "model: 1\ncamera: camcube2\neffects: []\n");
    write_text(path("truth.yaml"),
               "model: 1\ncamera: camcube2\neffects: [{effect: wiggling, amplitude: 6 mm, phase: 0.5 rad}]\n");
    write_text(path("scene.yaml"),
               fmt::format("scene: 1\ncamera: camcube2\nframes: 2\noutput: taps\nseed: 3\ntime_since_power_on: 3600 s\n"
                           "integration_time: 2 ms\n"
                           "objects:\n  - {{name: board, type: board, distance: 1 m, reflectivity: 0.6}}\n"
                           "sequence:\n  - {{key: board.distance, values: [{} m]}}\n",
                           fmt::join(depths, " m, ")));
    const tests::Outcome made =
        tests::shell("$TOFGRAPH simulate scene.yaml --model truth.yaml -o data", folder->path());
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  static void TearDownTestSuite() { folder.reset(); }
  static fs::path path(const std::string& name) { return folder->path() / name; }

  /// The campaign file with another condition first, the others after it in their original order.
  static fs::path campaign_from(std::size_t first) {
    const auto from = static_cast<std::ptrdiff_t>(first);
    if (GetParam() == std::string("table")) {
      std::array turned = depths;
      std::rotate(turned.begin(), turned.begin() + from, turned.end());
      std::string rows = "depth,seen,time\n";
      for (const double depth : turned) rows += fmt::format("{},{},2\n", depth, depth + wiggle(depth));
      write_text(path("table.csv"), rows);
      write_text(path("table.yaml"),
                 "campaign: 1\ncamera: camcube2\ntable:\n  file: table.csv\n  distance: {column: depth, unit: m}\n"
                 "  integration_time: {column: time, unit: ms}\n  measured_depth: {column: seen, unit: m}\n");
      return path("table.yaml");
    }
    io::Campaign campaign = read(path("data/campaign.yaml"));
    std::rotate(campaign.conditions.begin(), campaign.conditions.begin() + from, campaign.conditions.end());
    io::write_campaign(campaign, path("data/turned.yaml"));
    return path("data/turned.yaml");
  }

  static io::Campaign read(const fs::path& file) {
    config::Diagnostics diagnostics;
    io::Campaign campaign = io::read_campaign(file, diagnostics);
    EXPECT_TRUE(diagnostics.ok()) << diagnostics.text();
    return campaign;
  }
  static Measurements measured() {
    const io::Campaign campaign = read(campaign_from(0));
    return campaign.from_table ? measure_table(campaign, {}) : measure(campaign, {});
  }

  static inline std::unique_ptr<tests::TemporaryFolder> folder;
  const graph::PluginRegistry catalogue{graph::plugin_path({})};
  const Candidate wiggling{catalogue.load(*catalogue.find("wiggling"))};
};

TEST_P(PutAside, WhereverItStandsThereIsAVerdict) {
  std::set<Verdict> verdicts;
  for (std::size_t first = 0; first < depths.size(); ++first) {
    const auto found = diagnose(catalogue, {.model = path("model.yaml"), .data = campaign_from(first)});
    ASSERT_EQ(found->search.cross_fit.folds.size(), depths.size());
    for (const FoldResult& fold : found->search.cross_fit.folds) EXPECT_EQ(fold.fold.held.size(), 1U);
    EXPECT_TRUE(std::isfinite(found->gaps[distance].held_out_after));
    verdicts.insert(found->verdict);
  }
  EXPECT_EQ(verdicts.size(), 1U) << "the order says nothing of the camera";
}

TEST_P(PutAside, WhicheverItIsItIsAsIfItWereNotThere) {
  const Measurements all = measured();
  const State start{{{&wiggling, wiggling.start()}}, {}, {}};
  for (std::size_t aside = 0; aside < depths.size(); ++aside) {
    SCOPED_TRACE(aside);
    const Fold fold{"distance", "", {aside}};
    const FoldProblem training(*all.design, all.observations, left_by(fold, depths.size()));
    const ModelFit with = fit(training.problem, start);
    std::vector<io::Condition> conditions = all.design->conditions();
    conditions.erase(conditions.begin() + static_cast<std::ptrdiff_t>(aside));
    std::vector<Observations> observations = all.observations;
    observations.erase(observations.begin() + static_cast<std::ptrdiff_t>(aside));
    const Design fewer(all.design->camera_pointer(), false, conditions, all.design->side());
    const ModelFit without = fit(make_problem(fewer, observations), start);
    EXPECT_NEAR(with.deviance, without.deviance, 1e-6 * std::abs(without.deviance));
    EXPECT_NEAR(with.state.terms[0].values[0], without.state.terms[0].values[0], 1e-9);
  }
}

TEST_P(PutAside, TwoThatAreLeftAreTooFew) {
  const Measurements all = measured();
  const State start{{{&wiggling, wiggling.start()}}, {}, {}};
  try {
    fit(FoldProblem(*all.design, all.observations, {1, 4}).problem, start);
    FAIL() << "a fit of two conditions";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("2 conditions can be used, and a search needs 3 at least"));
    EXPECT_THAT(error.what(), testing::HasSubstr("excluded: 3 that are held out"));
  }
  EXPECT_NO_THROW(fit(FoldProblem(*all.design, all.observations, {1, 3, 4}).problem, start));
}

INSTANTIATE_TEST_SUITE_P(Of, PutAside, testing::Values("captures", "table"),
                         [](const auto& tested) { return std::string(tested.param); });

/// Four conditions in which every setting has four levels.
TEST(Folds, LeaveEnoughForAFit) {
  std::vector<io::Condition> conditions(4);
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    conditions[i].board_distance = 1 + static_cast<double>(i);
    conditions[i].board_tilt_x = conditions[i].board_tilt_y = 0;
    conditions[i].integration_time = 1e-3 * static_cast<double>(1 + i);
    conditions[i].target = std::string(1, static_cast<char>('a' + i));
  }
  const Design design(io::load_profile(io::find_profile("camcube2", {})), false, conditions, single);
  for (const Fold& fold : folds_of(design)) EXPECT_EQ(fold.held.size(), 1U);
  EXPECT_EQ(folds_of(design).size(), 8U);
}

}  // namespace
}  // namespace tofgraph::diagnosis
