// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: WildValues.ZerosAnd*
// Rooms: graph cli
// Captures as written by other programs: zeros for missing lengths, other units, clocks that run backwards.
#include <nlohmann/json.hpp>

#include <limits>

#include "tests/small_capture.hpp"

namespace tofgraph::tests {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

/// Five frames of a plane in which every third pixel of some frames holds a value.
SmallCapture with_holes(const std::string& channel, float hole) {
  SmallCapture capture;
  std::vector<SmallCapture::Image> images(5, plane_ranges(1));
  for (std::size_t f = 0; f < images.size(); ++f)
    for (std::size_t i = f % 2; i < small_pixels; i += 3) images[f][i] = hole;
  capture.channels = {{channel, images}};
  return capture;
}

using WildValues = SmallCamera;

TEST_F(WildValues, ZerosAndTheLikeGiveWhatNanGives) {
  with_holes("range", nan).write(file("nan.h5"));
  for (const std::string stages : {"average frames=5 ! statistics", "bilateral strength='20 mm' window=3 ! statistics",
                                   "point_cloud ! statistics channel=range"}) {
    const Outcome right = run("capture_reader file=nan.h5 ! " + stages);
    EXPECT_FALSE(says(right, "values of range")) << right.err;
    for (const float hole : {0.0F, -1.0F, 1e30F}) {
      std::filesystem::remove(file("hole.h5"));
      with_holes("range", hole).write(file("hole.h5"));
      const Outcome actual = run("capture_reader file=hole.h5 ! " + stages);
      EXPECT_EQ(actual.exit_code, 0) << actual.err;
      EXPECT_EQ(actual.out, right.out) << hole << ", " << stages;
      EXPECT_TRUE(says(actual, "80 of 240 values of range in 5 frames are ")) << actual.err;
    }
  }
}

TEST_F(WildValues, ZerosInDistanceAndBesideFlagsAreInvalid) {
  SmallCapture capture = with_holes("distance", 0);
  capture.flags.assign(5, std::vector<std::uint16_t>(small_pixels, 0));
  capture.write(file("a.h5"));
  const Outcome outcome = run("capture_reader file=a.h5 ! capture_writer path=b.h5");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(says(outcome, "80 of 240 values of distance in 5 frames are 0 m")) << outcome.err;
  const io::CaptureReader reader(file("b.h5"));
  std::vector<float> distance(small_pixels);
  std::vector<std::uint16_t> flags(small_pixels);
  for (std::size_t i = 0; i < reader.channels().size(); ++i)
    reader.read(i, 0, reader.channels()[i].name == "flags" ? static_cast<void*>(flags.data()) : distance.data());
  for (std::size_t i = 0; i < small_pixels; ++i) {
    EXPECT_EQ(flags[i], i % 3 == 0 ? 1 : 0);
    EXPECT_EQ(std::isnan(distance[i]), i % 3 == 0);
  }
}

TEST_F(WildValues, PointsAtTheLensAreInvalid) {
  SmallCapture capture;
  SmallCapture::Image points, range = plane_ranges(1);
  for (std::size_t i = 0; i < small_pixels; ++i)
    for (const float at : {0.1F, 0.0F, 1.0F}) points.push_back(i % 4 == 0 ? 0 : at);
  capture.channels = {{"points", {points}}, {"range", {range}}};
  capture.write(file("a.h5"));
  const Outcome outcome = run("capture_reader file=a.h5 ! ply_writer path=a.ply encoding=ascii");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(says(outcome, "12 of 48 values of points in 1 frame are 0 m")) << outcome.err;
  EXPECT_NE(read_text(file("a.ply")).find("element vertex 36\n"), std::string::npos);
}

TEST_F(WildValues, UnitsOfSettingsAreDoubtedOnceAndBeforeTheOrderOfTheTaps) {
  SmallCapture capture;
  capture.channels = {{"phases", {four_phases(1, 20e6), four_phases(1, 20e6)}}};
  capture.frequency = 20;
  capture.time = 1000;
  capture.timestamps = {1'000'000'000, 9'000'000'000'000};
  capture.write(file("a.h5"));
  for (const std::string command : {"run", "check"}) {
    const Outcome outcome =
        shell("\"$TOFGRAPH\" " + command +
                  " \"capture_reader file=a.h5 ! four_phase_decoder ! statistics\" --camera ./camera.yaml",
              folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(
        says(outcome,
             "the modulation frequency is 20 Hz, that of the camera 'tiny' is 20 MHz: it was probably written in MHz"))
        << outcome.err;
    EXPECT_TRUE(says(outcome, "the integration time is 1000 s")) << outcome.err;
    EXPECT_FALSE(says(outcome, "swapped")) << outcome.err;
    EXPECT_EQ(says(outcome, "no pixel is valid in 2 frames at 'statistics' (statistics): they are longer than 1000 km"),
              command == "run")
        << outcome.err;
    EXPECT_EQ(outcome.err.find("the modulation frequency"), outcome.err.rfind("the modulation frequency"));
  }
}

TEST_F(WildValues, LengthsInMillimetresAreDoubted) {
  SmallCapture capture;
  capture.channels = {{"range", {plane_ranges(1000)}}};
  capture.write(file("mm.h5"));
  const Outcome outcome = run("capture_reader file=mm.h5 ! point_cloud ! null");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_TRUE(says(outcome, "the median of range is 100")) << outcome.err;
  EXPECT_TRUE(says(outcome, "it was probably written in mm")) << outcome.err;
}

TEST_F(WildValues, InfoReportsClocksThatRunBack) {
  SmallCapture capture;
  capture.channels = {{"range", {plane_ranges(1), plane_ranges(1), plane_ranges(1)}}};
  capture.timestamps = {3'000'000'000, 1'000'000'000, 2'000'000'000};
  capture.power_on = {30, 31, 2};
  capture.write(file("back.h5"));
  const Outcome text = shell("\"$TOFGRAPH\" info back.h5", folder_.path());
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_TRUE(says(text, "the clock of the time stamps runs back")) << text.out;
  EXPECT_TRUE(says(text, "the time since power on runs back")) << text.out;
  EXPECT_FALSE(says(text, "duration")) << text.out;
  const auto json = nlohmann::json::parse(shell("\"$TOFGRAPH\" info back.h5 --json", folder_.path()).out);
  EXPECT_EQ(json["warnings"].size(), 2U);
  EXPECT_FALSE(json.contains("duration_s"));
}

TEST_F(WildValues, APlausibleCaptureRaisesNoDoubt) {
  with_holes("range", nan).write(file("a.h5"));
  const Outcome outcome = run("capture_reader file=a.h5 ! point_cloud ! null");
  EXPECT_EQ(outcome.err.find("warning: a.h5"), std::string::npos) << outcome.err;
  EXPECT_FALSE(says(outcome, "probably written")) << outcome.err;
}

// Runs that end without a valid pixel.

TEST_F(WildValues, ARunWithoutAValidPixelSaysWhy) {
  SmallCapture capture = with_holes("range", nan);
  for (auto& image : capture.channels[0].second) std::ranges::fill(image, nan);
  capture.flags.assign(5, std::vector<std::uint16_t>(small_pixels, 1 | 2));
  for (auto& flags : capture.flags) flags[0] = 1 | 8;
  capture.write(file("a.h5"));
  const Outcome organised = run("capture_reader file=a.h5 ! point_cloud ! pcd_writer path=a.pcd");
  EXPECT_EQ(organised.exit_code, 0) << organised.err;
  EXPECT_TRUE(
      says(organised, "warning: no pixel is valid in 5 frames at 'pcd_writer' (pcd_writer): 98 % are saturated"))
      << organised.err;
  for (const std::string sink : {"pcd_writer path=b.pcd dense=true", "ply_writer path=c.ply"}) {
    const Outcome dense = run("capture_reader file=a.h5 ! point_cloud ! " + sink);
    EXPECT_EQ(dense.exit_code, 1) << dense.err;
    EXPECT_TRUE(says(dense, "every cloud is empty: no point is valid")) << dense.err;
    EXPECT_TRUE(says(dense, "98 % are saturated")) << dense.err;
  }
  const Outcome voxels = run("capture_reader file=a.h5 ! point_cloud ! voxel_grid ! pcd_writer path=d.pcd");
  EXPECT_EQ(voxels.exit_code, 1) << voxels.err;
  EXPECT_TRUE(says(voxels, "every frame is empty at 'pcd_writer' (pcd_writer)")) << voxels.err;
}

TEST_F(WildValues, LengthsInMicrometresAreBeyondReachAndTheUnitIsNamed) {
  SmallCapture capture = with_holes("range", nan);
  for (auto& image : capture.channels[0].second) std::ranges::fill(image, 1.2e6F);
  capture.write(file("a.h5"));
  const Outcome outcome = run("capture_reader file=a.h5 ! statistics");
  EXPECT_TRUE(says(outcome, "probably written in um")) << outcome.err;
  EXPECT_TRUE(says(outcome, "in um")) << outcome.err;
  EXPECT_TRUE(says(outcome, "no pixel is valid")) << outcome.err;
}

TEST_F(WildValues, OneValidPixelIsEnough) {
  SmallCapture capture = with_holes("range", nan);
  for (auto& image : capture.channels[0].second) std::ranges::fill(image, nan);
  capture.channels[0].second[3][17] = 1;
  capture.write(file("a.h5"));
  const Outcome outcome = run("capture_reader file=a.h5 ! point_cloud ! ply_writer path=a.ply");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_FALSE(says(outcome, "no pixel is valid")) << outcome.err;
}

}  // namespace
}  // namespace tofgraph::tests
