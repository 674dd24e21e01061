// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: LightOnlyCaptures.TheLensFollowsFrom*
// Rooms: io calibration
// Captures with amplitude or intensity alone: the lens of an independent camera, and commands that need distances.
#include <hdf5.h>

#include "tests/program.hpp"
#include "tests/unit/lens_images.hpp"
#include "tests/unit/raw_capture.hpp"

#include "io/calibration.hpp"

namespace tofgraph::tests {
namespace {

constexpr std::size_t size = 204;

class LightOnlyCaptures : public testing::Test {
 protected:
  /// Views of a chessboard, one frame each. @param dead fraction of pixels without a signal
  void record(const std::string& channel, std::size_t views, double dead) {
    const test::TrueBoard board;
    const auto rays = test::subpixel_rays(lens, static_cast<int>(size));
    const auto poses = test::true_poses(lens, board, views);
    std::mt19937_64 random(3);
    std::vector<bool> is_dead(size * size);
    for (std::size_t i = 0; i < is_dead.size(); ++i) is_dead[i] = std::bernoulli_distribution(dead)(random);
    std::string text =
        "campaign: 1\ncamera: camcube2\npattern: {type: chessboard, columns: 8, rows: 6, square: 30 mm}\nconditions:\n";
    for (std::size_t i = 0; i < views; ++i) {
      const calibration::Image image = test::rendered(rays, static_cast<int>(size), poses[i],
                                                      test::chessboard(board, {}), {}, static_cast<unsigned>(i));
      std::vector<float> values(image.values.begin(), image.values.end());
      for (std::size_t p = 0; p < values.size(); ++p)
        if (is_dead[p]) values[p] = 1;
      const std::string name = "v" + std::to_string(i);
      RawCapture capture(folder.path() / (name + ".h5"));
      capture.head(size, size, 1, "tofgraph-capture", "camcube2");
      capture.dataset(channel, {1, size, size}, values, {1, size, size}).metadata(1, 1e-3);
      text += "  - {id: " + name + ", capture: " + name + ".h5, board: {distance: 1 m}}\n";
    }
    write_text(folder.path() / "views.yaml", text);
  }
  Outcome run(const std::string& command) const { return shell("\"$TOFGRAPH\" " + command, folder.path()); }
  void expect_lens() const {
    const Outcome outcome = run("calibrate intrinsics views.yaml -o lens.yaml");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    io::CalibrationReader file(folder.path() / "lens.yaml", "intrinsics", "camcube2");
    const io::Calibrated focal = file.need("focal_length", "px", 2, ""),
                         point = file.need("principal_point", "px", 2, "");
    const double truth[] = {lens.fx, lens.fy, lens.cx, lens.cy};
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(focal.value[i], truth[i], 4.5 * focal.sd[i]);
      EXPECT_NEAR(point.value[i], truth[2 + i], 4.5 * point.sd[i]);
      EXPECT_LT(focal.sd[i], 1);
      EXPECT_LT(point.sd[i], 1);
    }
  }

  test::TrueLens lens;
  TemporaryFolder folder;
};

TEST_F(LightOnlyCaptures, TheLensFollowsFromAmplitudes) {
  record("amplitude", 12, 0);
  expect_lens();
}

TEST_F(LightOnlyCaptures, TheLensFollowsFromIntensitiesWithDeadPixels) {
  record("intensity", 12, 0.015);
  expect_lens();
}

TEST_F(LightOnlyCaptures, OtherCommandsReadThemOrSayWhatIsMissing) {
  record("amplitude", 1, 0);
  EXPECT_EQ(run("info v0.h5").exit_code, 0);
  const Outcome pipeline = run("run \"capture_reader file=v0.h5 ! capture_writer path=copy.h5\"");
  EXPECT_EQ(pipeline.exit_code, 0) << pipeline.err;
  EXPECT_EQ(raw_values<float>(folder.path() / "copy.h5", "/frames/amplitude"),
            raw_values<float>(folder.path() / "v0.h5", "/frames/amplitude"));
  for (const char* kind : {"offset", "noise", "warm-up", "fixed-pattern"}) {
    const Outcome outcome = run(std::string("calibrate ") + kind + " views.yaml -o x.yaml");
    EXPECT_NE(outcome.exit_code, 0) << kind;
    EXPECT_EQ(outcome.exit_code, 2) << kind << outcome.err;
  }
  const Outcome offset = run("calibrate offset views.yaml -o x.yaml");
  EXPECT_NE(offset.err.find("views.yaml:5:5: error: the capture"), std::string::npos) << offset.err;
  EXPECT_NE(offset.err.find("has neither taps nor phases nor distance"), std::string::npos) << offset.err;
}

}  // namespace
}  // namespace tofgraph::tests
