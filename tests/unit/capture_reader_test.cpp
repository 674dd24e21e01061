// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The stage capture_reader: channels with their meaning, flags consistent with NaN, the camera.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <tofgraph/harness.hpp>

#include <cmath>
#include <cstring>

#include "tests/program.hpp"
#include "tests/unit/cameras.hpp"
#include "tests/unit/full_disk.hpp"
#include "tests/unit/raw_capture.hpp"

namespace tofgraph::tests {
namespace {

const std::string recording = TOFGRAPH_SOURCE_DIR "/pipelines/data/o3d303_scene.h5";
const float none = std::nanf("");

class ReaderStage : public testing::Test {
 protected:
  TemporaryFolder folder;
  std::string path = (folder.path() / "a.h5").string();
  std::string line(const std::string& more = {}) const { return "capture_reader file=" + path + " " + more; }
  std::string why(const std::string& more = {}) const {
    return thrown([&] { Harness(line(more)).prepare(); });
  }
};

void expect_words(const std::string& message, const std::string& words) {
  EXPECT_NE(message.find(words), std::string::npos) << words << " is not in: " << message;
}

/// NaN equals NaN.
void expect_same(const std::vector<float>& found, const std::vector<float>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_TRUE(found[i] == expected[i] || (std::isnan(found[i]) && std::isnan(expected[i]))) << i << ": " << found[i];
  }
}

TEST_F(ReaderStage, TheRealRecordingComesAsItIs) {
  Harness stage("capture_reader file=" + recording);
  const auto range = raw_values<float>(recording, "/frames/range");
  const auto points = raw_values<float>(recording, "/frames/points");
  const auto amplitude = raw_values<float>(recording, "/frames/amplitude");
  const auto flags = raw_values<std::uint8_t>(recording, "/frames/flags");
  constexpr std::size_t pixels = 132 * 176;
  const auto same = [](const std::vector<float>& found, const std::vector<float>& all, std::size_t from) {
    return std::memcmp(found.data(), all.data() + from, found.size() * sizeof(float)) == 0;
  };
  for (std::size_t frame = 0; frame < 3; ++frame) {
    ASSERT_TRUE(stage.run());
    EXPECT_TRUE(same(stage.get<float>("range"), range, frame * pixels));
    EXPECT_TRUE(same(stage.get<float>("points"), points, frame * pixels * 3));
    EXPECT_TRUE(same(stage.get<float>("amplitude"), amplitude, frame * pixels));
    const auto bits = stage.get<std::uint16_t>("flags");
    for (std::size_t i = 0; i < pixels; ++i) ASSERT_EQ(bits[i], flags[frame * pixels + i]);
  }
  EXPECT_EQ(stage.extent("points"), std::vector<std::uint64_t>({132, 176, 3}));
  EXPECT_FALSE(stage.run()) << "three frames";
  EXPECT_EQ(std::string(stage.camera_out().name), "o3d303");
  EXPECT_TRUE(stage.messages().empty()) << stage.messages().front();
}

TEST_F(ReaderStage, AnInvalidPixelIsNanEverywhereAndFlagged) {
  RawCapture(path)
      .head(5, 1)
      .dataset<float>("range", {1, 1, 5}, {1, none, 3, 4, 5})
      .dataset<float>("points", {1, 1, 5, 3}, {1, 1, 1, 2, 2, 2, 3, none, 3, 4, 4, 4, 5, 5, 5})
      .dataset<float>("amplitude", {1, 1, 5}, {10, 20, 30, 40, 50})
      .dataset<float>("sigma", {1, 1, 5}, {none, 2, 3, 4, 5})
      .dataset<std::uint8_t>("flags", {1, 1, 5}, {0, 2, 8, 1, 4})
      .metadata(1);
  Harness stage(line());
  ASSERT_TRUE(stage.run());
  expect_same(stage.get<float>("range"), {1, none, none, none, 5});
  expect_same(stage.get<float>("points"), {1, 1, 1, none, none, none, none, none, none, none, none, none, 5, 5, 5});
  expect_same(stage.get<float>("amplitude"), {10, 20, 30, 40, 50});
  expect_same(stage.get<float>("sigma"), {none, none, none, none, 5});
  EXPECT_EQ(stage.get<std::uint16_t>("flags"), std::vector<std::uint16_t>({0, 3, 9, 1, 4}));
}

TEST_F(ReaderStage, LengthsHaveFlagsEvenWhereTheCaptureHasNone) {
  RawCapture(path).head(2, 1).dataset<float>("depth", {1, 1, 2}, {1, none}).metadata(1);
  Harness stage(line());
  ASSERT_TRUE(stage.run());
  EXPECT_EQ(stage.get<std::uint16_t>("flags"), std::vector<std::uint16_t>({0, 1}));
}

TEST_F(ReaderStage, ASelectionOfLengthsBringsTheirFlags) {
  RawCapture(path)
      .head(2, 1)
      .dataset<float>("depth", {1, 1, 2}, {1, 2})
      .dataset<float>("amplitude", {1, 1, 2}, {1, 2})
      .dataset<std::uint8_t>("flags", {1, 1, 2}, {0, 1})
      .metadata(1);
  Harness stage(line("channels=[depth]"));
  ASSERT_TRUE(stage.run());
  expect_same(stage.get<float>("depth"), {1, none});
  EXPECT_TRUE(stage.has("flags"));
  EXPECT_FALSE(stage.has("amplitude"));
  Harness samples(line("channels=amplitude"));
  ASSERT_TRUE(samples.run());
  EXPECT_FALSE(samples.has("flags"));
  expect_words(why("channels=[depth, range]"), "the capture has no 'range', it has amplitude, depth, flags");
}

TEST_F(ReaderStage, PhasesKeepTheirTypeAndHistoryIsKept) {
  RawCapture(path)
      .head(2, 1)
      .dataset<std::int32_t>("phases", {2, 4, 1, 2}, std::vector<std::int32_t>(16, -70000))
      .dataset<float>("distance", {2, 1, 2}, {1, 2, 3, 4}, {}, "offset_correction linear")
      .metadata(2);
  Harness stage(line());
  ASSERT_TRUE(stage.run());
  EXPECT_EQ(stage.get<std::int32_t>("phases"), std::vector<std::int32_t>(8, -70000));
  EXPECT_EQ(stage.applied("distance"), "offset_correction linear");
}

TEST_F(ReaderStage, FramesAreCountedFromZeroAndBothEndsBelong) {
  RawCapture(path).head(1, 1).dataset<float>("depth", {5, 1, 1}, {0, 1, 2, 3, 4}).metadata(5);
  Harness stage(line("frames=[1,3]"));
  for (const float value : {1.0F, 2.0F, 3.0F}) {
    ASSERT_TRUE(stage.run());
    EXPECT_EQ(stage.get<float>("depth"), std::vector<float>{value});
  }
  EXPECT_FALSE(stage.run());
  expect_words(why("frames=[1,5]"), "the capture has the frames 0 to 4; there is no frame 5");
  expect_words(why("frames=[3,1]"), "expected the first and the last frame, e.g. frames: [0, 19]");
  expect_words(why("frames=[1.5,2]"), "expected the first and the last frame");
  expect_words(why("frames=[1]"), "expected the first and the last frame");
}

TEST_F(ReaderStage, MistakesOfTheFileAreMistakesOfTheParameter) {
  expect_words(why(), "parameter 'file': " + path + ": there is no such file");
}

TEST_F(ReaderStage, ThePipelinesCameraWins) {
  {
    RawCapture(path)
        .head(2, 1, 1, "tofgraph-capture", "recorded")
        .dataset<float>("depth", {1, 1, 2}, {1, 2})
        .metadata(1);
  }
  const test::Camera small(2, 1, 12.8e-3, 40e-6, {{"lamp", {0, 0, 0}, 1}});
  Harness stage(line());
  stage.camera(test::profile_of(small.view));
  ASSERT_TRUE(stage.run());
  EXPECT_EQ(std::string(stage.camera_out().name), "test");
  ASSERT_EQ(stage.messages().size(), 1U);
  expect_words(stage.messages()[0], "the capture is of the camera 'recorded', the pipeline's 'test' is used");
  const std::string other = thrown([&] {
    Harness wrong(line());
    wrong.camera("camcube2");
    wrong.prepare();
  });
  expect_words(other, "the capture is 2 x 1 px (camera 'recorded'), the pipeline's camera 'camcube2' is 204 x 204 px");
}

TEST_F(ReaderStage, TheCapturesOwnProfileComesFirst) {
  const test::Camera small(2, 1, 12.8e-3, 40e-6, {{"lamp", {0, 0, 0}, 1}});
  const std::string profile = read_text(test::profile_of(small.view));
  {
    RawCapture(path)
        .head(2, 1, 1, "tofgraph-capture", "nowhere")
        .text("profile", profile)
        .dataset<float>("depth", {1, 1, 2}, {1, 2})
        .metadata(1);
  }
  Harness stage(line());
  ASSERT_TRUE(stage.run());
  EXPECT_EQ(std::string(stage.camera_out().name), "test");
  EXPECT_DOUBLE_EQ(stage.camera_out().focal_length, 12.8e-3);
}

TEST_F(ReaderStage, AProfileOfAnotherSizeIsAMistake) {
  const test::Camera small(3, 2, 12.8e-3, 40e-6, {{"lamp", {0, 0, 0}, 1}});
  RawCapture(path)
      .head(2, 1, 1, "tofgraph-capture", "camcube2")
      .text("profile", read_text(test::profile_of(small.view)))
      .dataset<float>("depth", {1, 1, 2}, {1, 2})
      .metadata(1);
  expect_words(why(), "parameter 'file': the capture is 2 x 1 px, the profile in it 'test' has 3 x 2 px");
  RawCapture(path).head(2, 1, 1, "tofgraph-capture", "camcube2").dataset<float>("depth", {1, 1, 2}, {1, 2}).metadata(1);
  expect_words(why(), "the capture is 2 x 1 px, the profile of its camera 'camcube2' has 204 x 204 px");
}

TEST_F(ReaderStage, MistakesOfTheProfileInACaptureAreTold) {
  const auto with_profile = [&](const std::string& profile) {
    RawCapture(path)
        .head(2, 1, 1, "tofgraph-capture", "camcube2")
        .text("profile", profile)
        .dataset<float>("depth", {1, 1, 2}, {1, 2})
        .metadata(1);
    return why();
  };
  const std::string wrong = with_profile("profile: 1\nname: x\nwidth: -3\nheight: 1\nfocal_length: 5 s\n");
  expect_words(wrong, "the profile that came with it cannot be used:\nprofile of camcube2:1:1: error: ");
  expect_words(wrong, "profile of camcube2:3:8: error: 'width' is -3");
  expect_words(wrong, "profile of camcube2:5:15: error: ");
  expect_words(with_profile("profile: [1"), "profile of camcube2:1:");
  EXPECT_EQ(wrong.find("there is no profile"), std::string::npos) << wrong;
}

TEST_F(ReaderStage, ACameraWithoutProfileIsARemark) {
  {
    RawCapture(path)
        .head(2, 1, 1, "tofgraph-capture", "nowhere")
        .dataset<float>("depth", {1, 1, 2}, {1, 2})
        .dataset<double>("voltage", {1}, {12})
        .metadata(1);
  }
  Harness stage(line());
  ASSERT_TRUE(stage.run());
  ASSERT_EQ(stage.messages().size(), 2U);
  expect_words(stage.messages()[0], "there is no profile for the capture's camera 'nowhere'");
  expect_words(stage.messages()[1], "'voltage' is not a channel");
}

}  // namespace
}  // namespace tofgraph::tests
