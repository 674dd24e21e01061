// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The command `calibrate`, and every command of docs/calibrate_offset.md.
#include "tests/guide.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
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
  // What the page says came out.
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

}  // namespace
}  // namespace tofgraph::tests
