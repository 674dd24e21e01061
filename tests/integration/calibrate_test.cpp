// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Calibrate.EveryCommandOfTheGuideWorks
// Rooms: calibration cli
// The command `calibrate`, and every command of docs/calibrate_offset.md.
#include "io/calibration.hpp"
#include "tests/guide.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

class Calibrate : public testing::Test {
 protected:
  Calibrate() {
    for (const char* name : {"pipelines", "devices"})
      fs::copy(fs::path(TOFGRAPH_SOURCE_DIR) / name, folder.path() / name, fs::copy_options::recursive);
    fs::remove_all(folder.path() / "pipelines/out");
    fs::create_directories(folder.path() / "out");
  }
  Outcome run(const std::string& command) const {
    return shell("tofgraph() { \"$TOFGRAPH\" \"$@\"; }\n" + command, folder.path());
  }
  TemporaryFolder folder;
};

TEST_F(Calibrate, EveryCommandOfTheGuideWorks) {
  const fs::path page = TOFGRAPH_SOURCE_DIR "/docs/calibrate_offset.md";
  std::string said;
  const std::vector<std::string> blocks = commands_of(page);
  ASSERT_GE(blocks.size(), 5U);
  for (const std::string& block : blocks) {
    const Outcome outcome = run(block);
    ASSERT_EQ(outcome.exit_code, 0) << block << outcome.err;
    said += outcome.err;
  }
  // The results stated in the page are obtained.
  EXPECT_NE(said.find("32.9 mm remain of 77.6 mm (95 %: 27.5 to 38.2 mm, 12 levels)"), std::string::npos) << said;
  EXPECT_NE(said.find("0.8 mm remain of 16.6 mm"), std::string::npos) << said;
  const auto board = nlohmann::json::parse(read_text(folder.path() / "out/board.json"));
  EXPECT_NEAR(board["inputs"][0]["mean"].get<double>(), 3.4, 0.1e-3);
  EXPECT_TRUE(fs::exists(folder.path() / "out/rail_times.html"));
}

TEST_F(Calibrate, WhatIsShippedIsWhatTheCommandMakes) {
  const Outcome outcome =
      run("cd devices/calibrations && cp camcube2_offset.yaml shipped.yaml && tofgraph calibrate offset "
          "camcube2_published_boards.yaml -o camcube2_offset.yaml --force && cmp camcube2_offset.yaml shipped.yaml");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err << outcome.out;
}

/// The published boards at 2 m were measured with 5 to 19 ms: other times are extrapolated.
TEST_F(Calibrate, TimesFarFromTheCalibratedOnesAreExtrapolated) {
  const std::pair<const char*, bool> times[] = {{"50 us", false}, {"1 ms", false}, {"8 ms", true}, {"200 ms", false}};
  for (const auto& [time, known] : times) {
    const Outcome outcome =
        run("tofgraph run \"simulator distance='2 m' noise=none integration_time='" + std::string(time) +
            "' ! four_phase_decoder ! offset_correction extrapolation=refuse "
            "calibration=devices/calibrations/camcube2_offset.yaml ! statistics path=out/t.json\" "
            "--camera camcube2 --force");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const auto table = nlohmann::json::parse(read_text(folder.path() / "out/t.json"));
    EXPECT_EQ(table["inputs"][0]["count"].get<std::size_t>(), known ? 204U * 204U : 0U) << time;
  }
}

TEST_F(Calibrate, OutputsAppearWholeOrNotAtAllAndAreNotReplacedUnasked) {
  const std::string command =
      "tofgraph calibrate offset devices/calibrations/camcube2_published_boards.yaml -o out/a.yaml";
  ASSERT_EQ(run(command).exit_code, 0);
  EXPECT_EQ(run(command).exit_code, 2);
  fs::remove(folder.path() / "out/a.yaml");
  const Outcome report_there = run(command);
  EXPECT_EQ(report_there.exit_code, 2);
  EXPECT_NE(report_there.err.find("a.html already exists"), std::string::npos) << report_there.err;
  EXPECT_FALSE(fs::exists(folder.path() / "out/a.yaml"));
  EXPECT_EQ(run(command + " --force --quiet").err, "");
}

TEST_F(Calibrate, RepeatedConditionsAreMergedWithANote) {
  std::string rows = read_text(folder.path() / "devices/calibrations/camcube2_published_boards.csv");
  rows += "white,0.85,500,0.5,102,102,525.26,507.86,3.84\n";
  write_text(folder.path() / "devices/calibrations/camcube2_published_boards.csv", rows);
  const Outcome outcome =
      run("tofgraph calibrate offset devices/calibrations/camcube2_published_boards.yaml -o out/a.yaml");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.err.find("line 2, line 86: the same target, distance and integration time: merged"),
            std::string::npos)
      << outcome.err;
  const std::string text = read_text(folder.path() / "out/a.yaml");
  EXPECT_NE(text.find("507.76"), std::string::npos) << "the mean of 507.66 and 507.86 mm";
}

TEST_F(Calibrate, AnUnknownSpreadIsNotStated) {
  write_text(folder.path() / "boards.csv",
             "target,distance,time,depth\nwhite,500,1,507\nwhite,750,1,758\nwhite,1000,1,1005\nwhite,1250,1,1254\n"
             "white,1500,1,1507\nwhite,1500,1,1509\n");
  write_text(folder.path() / "boards.yaml",
             "campaign: 1\ncamera: camcube2\ntable:\n  file: boards.csv\n"
             "  distance: {column: distance, unit: mm}\n  integration_time: {column: time, unit: ms}\n"
             "  target: {column: target}\n  measured_depth: {column: depth, unit: mm}\n");
  const Outcome outcome = run("tofgraph calibrate offset boards.yaml -o out/a.yaml --force");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  io::CalibrationReader file(folder.path() / "out/a.yaml", "offset", "camcube2");
  for (const double sd : file.column("depth", "m", 5, "").sd) EXPECT_TRUE(std::isnan(sd)) << sd;
}

/// A column of a calibration of integration times, SI.
std::vector<double> column_of(const fs::path& file, const std::string& key, const char* unit) {
  io::CalibrationReader reader(file, "integration-time", "camcube2");
  return reader.column(key, unit, 0, "{value: [1]}").value;
}

// Standard deviations of depths chosen so that the best times are known: 1 ms at 0.5 m, 2 ms at 1 m, 4 ms at 2 m.
class IntegrationTime : public Calibrate {
 protected:
  IntegrationTime() {
    write_text(folder.path() / "boards.csv",
               "target,distance,time,depth,sd\n"
               "white,500,1,500,3\nwhite,500,2,500,4\nwhite,500,4,500,9\n"
               "white,1000,1,1000,6\nwhite,1000,2,1000,4\nwhite,1000,4,1000,4.1\n"
               "white,2000,1,2000,20\nwhite,2000,2,2000,9\nwhite,2000,4,2000,4.5\n");
    write_text(folder.path() / "boards.yaml",
               "campaign: 1\ncamera: camcube2\ntable:\n  file: boards.csv\n"
               "  distance: {column: distance, unit: mm}\n  integration_time: {column: time, unit: ms}\n"
               "  target: {column: target}\n  measured_depth: {column: depth, unit: mm}\n"
               "  measured_depth_sd: {column: sd, unit: mm}\n");
  }
};

TEST_F(IntegrationTime, BestTimesAreFoundWithThoseThatAreNearlyAsGood) {
  const Outcome outcome = run("tofgraph calibrate integration-time boards.yaml -o out/t.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const fs::path file = folder.path() / "out/t.yaml";
  EXPECT_EQ(column_of(file, "integration_time", "s"), (std::vector<double>{1e-3, 2e-3, 4e-3}));
  EXPECT_EQ(column_of(file, "longest", "s"), (std::vector<double>{1e-3, 4e-3, 4e-3})) << "4.1 mm is within 5 % of 4 mm";
  const std::vector<double> rmse = column_of(file, "rmse", "m");
  EXPECT_NEAR(rmse[0], 3e-3, 0.05 * 3e-3) << "distances spread a little more than depths";
  // One time for all: 2 ms and 4 ms both leave 9 mm, at different distances; 1 ms leaves 20 mm.
  EXPECT_NE(outcome.err.find("one integration time for all targets and distances (3): "), std::string::npos)
      << outcome.err;
  EXPECT_EQ(outcome.err.find("distances: 1 ms"), std::string::npos) << outcome.err;
}

TEST_F(IntegrationTime, ARangeAndAnAccuracyNarrowTheAdvice) {
  const Outcome one =
      run("tofgraph calibrate integration-time boards.yaml -o out/t.yaml --range 0.4m..1.2m --accuracy 5mm");
  EXPECT_NE(one.err.find("one integration time for all targets and distances (2): 2 ms"), std::string::npos) << one.err;
  const Outcome two = run("tofgraph calibrate integration-time boards.yaml -o out/u.yaml --accuracy 5mm");
  EXPECT_NE(two.err.find("several together (wanted: 5 mm): 2 ms for 2 of them, 4 ms for 1 of them"), std::string::npos)
      << two.err;
  const Outcome none = run("tofgraph calibrate integration-time boards.yaml -o out/v.yaml --accuracy 3.5mm");
  EXPECT_NE(none.err.find("2 of 3 targets and distances do not reach 3.5 mm"), std::string::npos) << none.err;
}

TEST_F(IntegrationTime, WithoutAContrastNoTimeIsSaidToReachAnAccuracy) {
  std::string profile = read_text(folder.path() / "devices/profiles/camcube2.yaml");
  const std::string contrast = "contrast: 0.5\n";
  ASSERT_NE(profile.find(contrast), std::string::npos);
  write_text(folder.path() / "plain.yaml", profile.erase(profile.find(contrast), contrast.size()));
  write_text(folder.path() / "boards.yaml",
             "campaign: 1\ncamera: ./plain.yaml\ntable:\n  file: boards.csv\n"
             "  distance: {column: distance, unit: mm}\n  integration_time: {column: time, unit: ms}\n"
             "  reflectivity: {column: reflectivity}\n  measured_depth: {column: depth, unit: mm}\n"
             "  measured_depth_sd: {column: sd, unit: mm}\n");
  write_text(folder.path() / "boards.csv",
             "reflectivity,distance,time,depth,sd\n0.85,500,1,500,3\n0.85,500,2,500,4\n0.85,1000,1,1000,6\n"
             "0.85,1000,2,1000,4\n");
  const Outcome outcome = run("tofgraph calibrate integration-time boards.yaml -o out/t.yaml --accuracy 5mm");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string page = read_text(folder.path() / "out/t.html");
  EXPECT_NE(page.find("<table"), std::string::npos);
  EXPECT_EQ(page.find("1e+06"), std::string::npos);
}

// Best times that jump between 1 and 64 ms from board to board: predictions from the others are far off, and the median
// of the others is better.
TEST_F(IntegrationTime, TimesThatDistancesDoNotPredictAreNotWrittenUnlessForced) {
  std::string rows = "target,distance,time,depth,sd\n";
  const int best[] = {8, 1, 64, 8, 1, 64, 8};  // ms
  for (int place = 0; place < 7; ++place) {
    const std::string distance = std::to_string(500 + 250 * place);
    for (const int time : {1, 8, 64}) {
      const double apart = std::abs(std::log2(time) - std::log2(best[place]));  // octaves
      rows += "white," + distance + "," + std::to_string(time) + "," + distance + "," +
              std::to_string(3 * std::pow(1 + apart / 3, 3)) + "\n";
    }
  }
  write_text(folder.path() / "boards.csv", rows);
  const Outcome refused = run("tofgraph calibrate integration-time boards.yaml -o out/t.yaml");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("does not improve held-out conditions: each distance held out"), std::string::npos)
      << refused.err;
  EXPECT_FALSE(fs::exists(folder.path() / "out/t.yaml"));
  const Outcome forced = run("tofgraph calibrate integration-time boards.yaml -o out/t.yaml --force");
  EXPECT_EQ(forced.exit_code, 0) << forced.err;
  EXPECT_TRUE(fs::exists(folder.path() / "out/t.yaml"));
}

// Two inner distances: at the first both times are equally good, at the second 1 ms, the best time at all others,
// leaves half as much again as 64 ms. An interval of two values is wide.
TEST_F(IntegrationTime, TheIntervalOfFewDistancesIsStudents) {
  write_text(folder.path() / "boards.csv",
             "target,distance,time,depth,sd\nwhite,500,1,500,4\nwhite,500,64,500,9\nwhite,1000,1,1000,4\n"
             "white,1000,64,1000,4\nwhite,2000,1,2000,6\nwhite,2000,64,2000,4\nwhite,4000,1,4000,4\n"
             "white,4000,64,4000,9\n");
  const Outcome outcome = run("tofgraph calibrate integration-time boards.yaml -o out/t.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<double> excess = column_of(folder.path() / "out/t.yaml", "held_out_excess", "");
  ASSERT_EQ(excess.size(), 3U);
  EXPECT_NEAR(excess[0], 1.25, 0.02) << "the mean of 1 and 1.5";
  EXPECT_EQ(excess[1], 1);
  // Standard error (1.5 - 1) / 2, times Student's 12.706 for one degree of freedom.
  EXPECT_NEAR((excess[2] - excess[0]) / (excess[0] - 1), 12.706, 0.1);
}

TEST_F(Calibrate, PublishedOptimaAreTheOptimumByTargetAndDistance) {
  const Outcome outcome =
      run("tofgraph calibrate integration-time devices/calibrations/camcube2_published_boards.yaml -o out/t.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err.find("nothing to compare"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("  white: 500 us at 500 mm, 2 ms at 1 m, 3 ms at 1.5 m"), std::string::npos)
      << outcome.err;
  const fs::path file = folder.path() / "out/t.yaml";
  const std::vector<double> target = column_of(file, "target", ""), distance = column_of(file, "distance", "m"),
                            time = column_of(file, "integration_time", "s");
  std::istringstream table(read_text(TOFGRAPH_SOURCE_DIR "/pipelines/chapter6/thesis_optimal_integration_time.csv"));
  const std::vector<double> black = {0, 12.5, 25, 50, 75, 100};
  std::string line;
  std::getline(table, line);
  std::size_t rows = 0;
  while (std::getline(table, line)) {
    double percent = 0, mm = 0, ms = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &percent, &mm, &ms), 3) << line;
    for (std::size_t k = 0; k < time.size(); ++k) {
      if (black[static_cast<std::size_t>(target[k])] != percent || std::abs(distance[k] - 1e-3 * mm) > 1e-9) continue;
      EXPECT_NEAR(time[k], 1e-3 * ms, 1e-9) << line;
      ++rows;
    }
  }
  EXPECT_EQ(rows, 30U);
}

TEST_F(Calibrate, SaturatedTimesAreNotRecommended) {
  write_text(folder.path() / "scene.yaml",
             "scene: 1\ncamera: camcube2\nmodel: {effects: [{effect: saturation, full_well: 30000 counts}]}\n"
             "frames: 2\noutput: taps\nobjects:\n  - {name: board, type: board, distance: 500 mm}\n"
             "sequence:\n  - {key: board.distance, values: [500 mm, 1500 mm]}\n"
             "  - {key: integration_time, values: [0.5 ms, 2 ms, 20 ms]}\n");
  const Outcome outcome =
      run("tofgraph simulate scene.yaml -o out/boards && "
          "tofgraph calibrate integration-time out/boards/campaign.yaml -o out/t.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("excluded: every pixel is saturated"), std::string::npos) << outcome.err;
  EXPECT_EQ(column_of(folder.path() / "out/t.yaml", "integration_time", "s"), (std::vector<double>{2e-3, 20e-3}));
}

TEST_F(Calibrate, PhasesSaturateByTheProfilesFullWell) {
  write_text(folder.path() / "scene.yaml",
             "scene: 1\ncamera: camcube2\nframes: 2\noutput: phases\nobjects:\n"
             "  - {name: board, type: board, distance: 500 mm}\n"
             "sequence:\n  - keys: [board.distance, roi]\n    values:\n"
             "      - [500 mm, {columns: [0, 203], rows: [0, 203]}]\n"
             "      - [1500 mm, {columns: [31, 172], rows: [67, 136]}]\n"
             "  - {key: integration_time, values: [0.5 ms, 2 ms, 20 ms]}\n");
  const Outcome outcome =
      run("tofgraph simulate scene.yaml -o out/boards && "
          "tofgraph calibrate integration-time out/boards/campaign.yaml -o out/t.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<double> best = column_of(folder.path() / "out/t.yaml", "integration_time", "s"),
                            full = column_of(folder.path() / "out/t.yaml", "saturates", "s");
  ASSERT_EQ(full.size(), 2U);
  // The light falls with the square of the path: means of the modelled board, 517.32 and 1515.46 mm (table 6.2).
  EXPECT_NEAR(full[1] / full[0], std::pow(1515.46 / 517.32, 2), 0.01);
  EXPECT_EQ(best[0], 2e-3);
  EXPECT_GT(full[0], 2e-3);
  EXPECT_LT(full[0], 20e-3);
  const std::string page = read_text(folder.path() / "out/t.html");
  EXPECT_NE(page.find("would be by the profile's full well"), std::string::npos);
}

}  // namespace
}  // namespace tofgraph::tests
