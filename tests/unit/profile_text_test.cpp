// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The profile of a camera modified by a stage: its text describes that camera, not the original one.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include <cmath>

#include "tests/program.hpp"
#include "tests/unit/cameras.hpp"

namespace tofgraph::tests {
namespace {

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void expect_same_camera(const tofgraph_camera& read, const tofgraph_camera& changed) {
  EXPECT_STREQ(read.name, changed.name);
  ASSERT_EQ(read.width, changed.width);
  ASSERT_EQ(read.height, changed.height);
  for (const auto member : {&tofgraph_camera::pitch, &tofgraph_camera::focal_px, &tofgraph_camera::principal_point,
                            &tofgraph_camera::integration_time}) {
    for (int i = 0; i < 2; ++i) EXPECT_TRUE(same((read.*member)[i], (changed.*member)[i])) << (changed.*member)[i];
  }
  for (int i = 0; i < 5; ++i) EXPECT_EQ(read.distortion[i], changed.distortion[i]);
  for (const auto member : {&tofgraph_camera::focal_length, &tofgraph_camera::modulation_frequency,
                            &tofgraph_camera::frame_rate, &tofgraph_camera::gain, &tofgraph_camera::contrast,
                            &tofgraph_camera::read_noise, &tofgraph_camera::shot_noise, &tofgraph_camera::full_well}) {
    EXPECT_TRUE(same(read.*member, changed.*member)) << changed.*member;
  }
  ASSERT_EQ(read.light_count, changed.light_count);
  for (std::size_t i = 0; i < read.light_count; ++i) {
    EXPECT_STREQ(read.lights[i].name, changed.lights[i].name);
    EXPECT_EQ(read.lights[i].amplitude, changed.lights[i].amplitude);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(read.lights[i].position[k], changed.lights[i].position[k]);
  }
  for (std::size_t i = 0; i < std::size_t{read.width} * read.height * 3; ++i) {
    const float a = read.rays[i], b = changed.rays[i];
    ASSERT_TRUE(std::abs(a - b) < 1e-6F || (std::isnan(a) && std::isnan(b))) << i << ": " << a << " and " << b;
  }
}

class ProfileText : public testing::Test {
 protected:
  TemporaryFolder folder;

  /// Reads the output camera of a stage back from its text.
  void expect_round_trip(const std::string& line, const std::string& camera) const {
    SCOPED_TRACE(line);
    Harness stage(line);
    stage.camera(camera);
    stage.put<float>("amplitude", {stage.camera().height, stage.camera().width},
                     std::vector<float>(std::size_t{stage.camera().height} * stage.camera().width));
    stage.prepare();
    const auto file = folder.path() / "changed.yaml";
    write_text(file, stage.camera_out().profile);
    Harness again("null");
    again.camera(file);
    expect_same_camera(again.camera(), stage.camera_out());
  }
};

TEST_F(ProfileText, IsOfTheNewLens) {
  test::Camera odd = test::camcube2({{"left", {-0.05, 1e-3 / 3, 0}, 0.7}, {"right", {0.05, 0, 1e-7}, 1}});
  odd.view.gain = 7e6 / 3;
  for (const std::string& camera : {test::profile_of(odd.view), std::string("camcube3")})
    expect_round_trip("intrinsics fx='316.7512345678901 px' k1=-0.44287 k2=0.21777 cx='101.3 px'", camera);
  expect_round_trip("intrinsics fx='300 px' fy='300 px'", "camcube2");
}

TEST_F(ProfileText, IsOfTheCutImage) {
  expect_round_trip("crop columns=[10, 49] rows=[100, 199]", "camcube2_calibrated");
  expect_round_trip("crop columns=[10, 49] rows=[100, 119]", "o3d303");
}

TEST_F(ProfileText, ACaptureOfTheCutImageIsReadWithItsOwnCamera) {
  const Outcome outcome = shell(
      "\"$TOFGRAPH\" run 'simulator noise=none frames=1 ! crop columns=[10, 49] rows=[100, 199] ! capture_writer "
      "path=a.h5' --camera camcube2",
      folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  Harness reader("capture_reader file=" + (folder.path() / "a.h5").string());
  ASSERT_TRUE(reader.run());
  EXPECT_EQ(reader.camera_out().width, 40U);
  EXPECT_EQ(reader.camera_out().height, 100U);
  EXPECT_EQ(reader.camera_out().principal_point[0], 101.5 - 10);
  EXPECT_EQ(reader.camera_out().principal_point[1], 101.5 - 100);
  EXPECT_EQ(reader.extent("rays"), std::vector<std::uint64_t>({100, 40, 3}));
}

}  // namespace
}  // namespace tofgraph::tests
