// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Align.ATilted*:Align.APlan*
// Rooms: recording cli
// Alignment of a board using the depths in the image corners: sections 5.6, 6.3 and 7.3 of the reference.
#include "tests/program.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <sstream>

namespace tofgraph::tests {
namespace {

class Align : public testing::Test {
 protected:
  void board(const std::string& tilt) const {
    write_text(folder.path() / "world.yaml",
               "scene: 1\ncamera: camcube2\nframes: 1\nintegration_time: 2 ms\nnoise: none\n"
               "objects:\n  - {name: board, type: board, distance: 1 m, reflectivity: 0.8" +
                   tilt + "}\n");
    write_text(
        folder.path() / "plan.yaml",
        "campaign: 1\ncamera: camcube2\nconditions:\n  - {id: one, capture: one.h5, board: {distance: 1 m}, target: "
        "white, integration_time: 2 ms}\n");
  }
  Outcome run(const std::string& command) const { return shell(command, folder.path()); }
  Outcome look() const {
    return run("timeout --preserve-status -s INT 3 \"$TOFGRAPH\" record --align --camera simulated:world.yaml");
  }
  /// Depths in mm: top left, top right, bottom left, bottom right.
  static std::array<double, 4> corners(const std::string& text) {
    std::array<double, 4> c{};
    const auto at = text.find("corners: ");
    EXPECT_NE(at, std::string::npos) << text;
    if (at != std::string::npos) {
      EXPECT_EQ(std::sscanf(text.c_str() + at, "corners: top %lf and %lf mm, bottom %lf and %lf mm", &c[0], &c[1],
                            &c[2], &c[3]),
                4)
          << text;
    }
    return c;
  }

  TemporaryFolder folder;
};

TEST_F(Align, EqualCornersMeanAPerpendicularBoard) {
  board("");
  const Outcome outcome = look();
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_NE(outcome.err.find("distance 1000 mm"), std::string::npos) << outcome.err;
  for (const double c : corners(outcome.err)) EXPECT_NEAR(c, 1000, 1);
}

TEST_F(Align, ATiltedBoardHasCornersAtOtherDepths) {
  board(", tilt_y: 2 deg");
  const auto c = corners(look().err);
  // The centre of a corner window is 96.5 px off the axis: tan of the ray's angle 96.5 x 40 um / 12.8 mm.
  const double ray = 96.5 * 40e-6 / 12.8e-3, slope = std::tan(2 * std::acos(-1.0) / 180);
  const double near = 1000 / (1 + slope * ray), far = 1000 / (1 - slope * ray);
  EXPECT_NEAR(std::min(c[0], c[1]), near, 1.5);
  EXPECT_NEAR(std::max(c[0], c[1]), far, 1.5);
  EXPECT_NEAR(c[0], c[2], 1);
  EXPECT_NEAR(c[1], c[3], 1);
}

TEST_F(Align, APlanWithAToleranceRecordsNoTiltedBoard) {
  board(", tilt_y: 2 deg");
  const std::string record =
      "\"$TOFGRAPH\" record --plan plan.yaml --camera simulated:world.yaml --alignment 3mm --frames 1 -o out";
  const Outcome tilted = run("printf '\\nquit\\n' | " + record);
  EXPECT_NE(tilted.exit_code, 0);
  EXPECT_NE(tilted.err.find("not recorded: the board is not perpendicular: its corners differ by"), std::string::npos)
      << tilted.err;
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "out/captures/one.h5"));
  board("");
  const Outcome straight = run("printf '\\n' | " + record);
  EXPECT_EQ(straight.exit_code, 0) << straight.err;
}

TEST_F(Align, SaysWhatDoesNotGoWithIt) {
  board("");
  const Outcome both = run("\"$TOFGRAPH\" record --align --camera simulated:world.yaml -o a.h5");
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_NE(both.err.find("--align: error: records nothing: remove -o"), std::string::npos) << both.err;
  for (const std::string option : {"--frames 5", "--duration '3 s'", "--comment mine", "--force"}) {
    const Outcome ignored = run("timeout 20 \"$TOFGRAPH\" record --align --camera simulated:world.yaml " + option);
    EXPECT_EQ(ignored.exit_code, 2) << option;
    const std::string words = option.substr(0, option.find(' ')) + ": error: --align records nothing";
    EXPECT_NE(ignored.err.find(words), std::string::npos) << ignored.err;
  }
  const Outcome none = run("\"$TOFGRAPH\" record --camera simulated:world.yaml");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("--out: error: is missing"), std::string::npos) << none.err;
}

}  // namespace
}  // namespace tofgraph::tests
