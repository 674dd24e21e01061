// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: CalibrateLens.ThePages*:CalibrateLens.AWrongSize*:CalibrateLens.CapturesOfAnother*
// Slow: CalibrateLens.TheSameView*:CalibrateLens.BoardsParallel*:CalibrateLens.TheStage*
// Rooms: calibration
// tofgraph calibrate intrinsics from end to end, with simulated views, and with possible errors in them.
#include "io/calibration.hpp"
#include "tests/guide.hpp"

#include <cmath>
#include <regex>

using namespace tofgraph;
using namespace tofgraph::tests;

namespace fs = std::filesystem;

namespace {

/// The simulated views of the documentation page, created once for all tests.
class CalibrateLens : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    for (const char* name : {"pipelines", "devices"})
      fs::create_directory_symlink(fs::path(TOFGRAPH_SOURCE_DIR) / name, folder_->path() / name);
    fs::create_directory(folder_->path() / "out");
    const Outcome outcome = run("tofgraph simulate pipelines/campaigns/chessboard_views.yaml -o out/views");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static Outcome run(std::string command) {
    command = std::regex_replace(command, std::regex("(^|\\n)tofgraph "), "$1\"$TOFGRAPH\" ");
    return shell(command, folder_->path());
  }
  static fs::path path() { return folder_->path(); }

  /// A campaign of some of the views. @param more text appended to the file
  static Outcome calibrate(const std::vector<std::string>& captures, const std::string& options,
                           const std::string& pattern = "columns: 8, rows: 6") {
    std::string text =
        "campaign: 1\ncamera: camcube2\npattern: {type: chessboard, " + pattern + ", square: 30 mm}\nconditions:\n";
    for (std::size_t i = 0; i < captures.size(); ++i)
      text += "  - {id: v" + std::to_string(i) + ", capture: views/captures/" + captures[i] + "}\n";
    write_text(path() / "out/some.yaml", text);
    for (const char* earlier : {"out/some_lens.yaml", "out/some_lens.html"}) fs::remove(path() / earlier);
    return run("tofgraph calibrate intrinsics out/some.yaml -o out/some_lens.yaml --force " + options);
  }
  static std::vector<std::string> captures() {
    std::vector<std::string> list;
    for (const auto& entry : fs::directory_iterator(path() / "out/views/captures"))
      list.push_back(entry.path().filename().string());
    std::sort(list.begin(), list.end());
    return list;
  }

  static TemporaryFolder* folder_;
};
TemporaryFolder* CalibrateLens::folder_ = nullptr;

TEST_F(CalibrateLens, ThePagesCommandsWorkAndFindTheLens) {
  const auto commands = commands_of(fs::path(TOFGRAPH_SOURCE_DIR) / "docs/calibrate_lens.md");
  ASSERT_EQ(commands.size(), 2U);
  fs::remove_all(path() / "out/views");
  for (const std::string& block : commands) {
    const Outcome outcome = run(block);
    ASSERT_EQ(outcome.exit_code, 0) << block << outcome.err;
  }
  io::CalibrationReader file(path() / "out/lens.yaml", "intrinsics", "camcube2");
  const io::Calibrated focal = file.need("focal_length", "px", 2, ""),
                       point = file.need("principal_point", "px", 2, ""),
                       distortion = file.need("distortion", "", 5, "");
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(focal.value[i], 320, 4 * focal.sd[i]) << "12.8 mm over 40 um";
    EXPECT_LT(focal.sd[i], 0.5);
    EXPECT_NEAR(point.value[i], 101.5, 4 * point.sd[i]);
    EXPECT_LT(point.sd[i], 0.6);
  }
  for (std::size_t i = 0; i < 4; ++i) {  // k1 k2 p1 p2; k3 is not free
    EXPECT_GT(distortion.sd[i], 0);
    EXPECT_NEAR(distortion.value[i], 0, 4 * distortion.sd[i]) << i;
  }
  const std::string page = read_text(path() / "out/lens.html");
  for (const char* heading : {"How exactly it projects", "On views left out", "Residuals and coverage", "Undistorted"})
    EXPECT_NE(page.find(heading), std::string::npos) << heading;
}

TEST_F(CalibrateLens, AWrongSizeIsSaidWithTheOneThatFits) {
  std::vector<std::string> list = captures();
  list.resize(8);
  const Outcome outcome = calibrate(list, "", "columns: 9, rows: 7");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("some.yaml:3:10: error: the pattern of 9 x 7 was found in 0 of 8 views"),
            std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("columns: 8, rows: 6"), std::string::npos) << outcome.err;
}

TEST_F(CalibrateLens, CapturesOfAnotherCameraAreRefused) {
  std::string text =
      "campaign: 1\ncamera: other.yaml\npattern: {type: chessboard, columns: 8, rows: 6, square: 30 mm}\nconditions:\n";
  for (const std::string& capture : captures())
    text += "  - {id: v" + capture + ", capture: views/captures/" + capture + "}\n";
  write_text(path() / "out/other.yaml",
             std::regex_replace(read_text(fs::path(TOFGRAPH_SOURCE_DIR) / "devices/profiles/camcube2.yaml"),
                                std::regex("name: camcube2"), "name: another"));
  write_text(path() / "out/foreign.yaml", text);
  const Outcome outcome = run("tofgraph calibrate intrinsics out/foreign.yaml -o out/foreign_lens.yaml");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(
      outcome.err.find("foreign.yaml:5:5: error: the capture is of the camera 'camcube2', the campaign's is 'another'"),
      std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("camera: camcube2"), std::string::npos) << outcome.err;
}

TEST_F(CalibrateLens, CapturesOfAnotherFrequencyAreRefused) {
  write_text(path() / "out/faster.yaml",
             std::regex_replace(read_text(fs::path(TOFGRAPH_SOURCE_DIR) / "devices/profiles/camcube2.yaml"),
                                std::regex("modulation_frequency: 20 MHz"), "modulation_frequency: 30 MHz"));
  write_text(path() / "out/fast.yaml",
             "campaign: 1\ncamera: ./faster.yaml\npattern: {type: chessboard, columns: 8, rows: 6, square: 30 mm}\n"
             "conditions:\n  - {id: v, capture: views/captures/" +
                 captures().front() + "}\n");
  const Outcome outcome = run("tofgraph calibrate intrinsics out/fast.yaml -o out/fast_lens.yaml");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("was recorded at 20 MHz, the camera 'camcube2' works at 30 MHz"), std::string::npos)
      << outcome.err;
}

TEST_F(CalibrateLens, TheSameViewTwiceIsNamedAndUsedOnce) {
  std::vector<std::string> list = captures();
  list.resize(8);
  list.push_back(list[2]);
  const Outcome outcome = calibrate(list, "--without distances");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("v8: not used: the same image as v2"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("8 of 9 views used"), std::string::npos) << outcome.err;
}

TEST_F(CalibrateLens, TooFewViewsAreRefusedWithWhatWouldDo) {
  std::vector<std::string> list = captures();
  list.resize(3);
  const Outcome outcome = calibrate(list, "");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("found in 3 of 3 views, at least 4 different ones are needed"), std::string::npos)
      << outcome.err;
  EXPECT_FALSE(fs::exists(path() / "out/some_lens.html"));
  EXPECT_FALSE(fs::exists(path() / "out/some_lens.yaml"));
}

TEST_F(CalibrateLens, BoardsParallelToTheSensorDoNotTellTheFocalLength) {
  std::vector<std::string> list = captures();
  std::erase_if(list, [](const std::string& name) { return name.find("mm_0deg_0deg") == std::string::npos; });
  ASSERT_EQ(list.size(), 5U);
  const Outcome outcome = calibrate(list, "--without distances");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("the focal length is not determined"), std::string::npos) << outcome.err;
}

TEST_F(CalibrateLens, TheStageTakesAFittedSkew) {
  std::vector<std::string> list = captures();
  list.resize(10);
  ASSERT_EQ(calibrate(list, "--without distances --free skew").exit_code, 0);
  const Outcome outcome =
      run("tofgraph run \"simulator distance='1 m' ! four_phase_decoder ! intrinsics calibration=out/some_lens.yaml ! "
          "statistics path=out/s.json\" --camera camcube2");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

}  // namespace
