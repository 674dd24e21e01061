// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Compared with the same pixels picked one by one.
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace tofgraph {
namespace {

constexpr std::size_t size = 204;

template <class T> std::vector<T> counted(std::size_t n) {
  std::vector<T> values(n);
  for (std::size_t i = 0; i < n; ++i) values[i] = static_cast<T>(i % 60000);
  return values;
}

std::string said(const std::string& line) {
  try {
    Harness stage(line);
    stage.camera("camcube2");
    stage.put<float>("depth", {size, size}, counted<float>(size * size));
    stage.run();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(Crop, CutsEveryImageAndTheCamera) {
  Harness stage("crop columns=[10, 49] rows=[100, 199]");
  stage.camera("camcube2");
  const auto depth = counted<float>(size * size), points = counted<float>(size * size * 3);
  const auto taps = counted<std::uint16_t>(8 * size * size);
  stage.put<float>("depth", {size, size}, depth);
  stage.put<float>("points", {size, size, 3}, points);
  stage.put<std::uint16_t>("taps", {4, 2, size, size}, taps);
  stage.put<std::uint8_t>("raw_headers", {4, 512}, counted<std::uint8_t>(2048));
  stage.run();
  ASSERT_EQ(stage.extent("depth"), (std::vector<std::uint64_t>{100, 40}));
  ASSERT_EQ(stage.extent("points"), (std::vector<std::uint64_t>{100, 40, 3}));
  ASSERT_EQ(stage.extent("taps"), (std::vector<std::uint64_t>{4, 2, 100, 40}));
  EXPECT_EQ(stage.extent("raw_headers"), (std::vector<std::uint64_t>{4, 512}));
  const auto cut_depth = stage.get<float>("depth"), cut_points = stage.get<float>("points"),
             rays = stage.get<float>("rays");
  const auto cut_taps = stage.get<std::uint16_t>("taps");
  for (std::size_t row = 0; row < 100; ++row) {
    for (std::size_t column = 0; column < 40; ++column) {
      const std::size_t to = row * 40 + column, from = (row + 100) * size + column + 10;
      ASSERT_EQ(cut_depth[to], depth[from]);
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_EQ(cut_points[3 * to + k], points[3 * from + k]);
        ASSERT_EQ(rays[3 * to + k], stage.camera().rays[3 * from + k]);
      }
      for (std::size_t image = 0; image < 8; ++image)
        ASSERT_EQ(cut_taps[image * 4000 + to], taps[image * size * size + from]);
    }
  }
  EXPECT_EQ(stage.camera_out().width, 40U);
  EXPECT_EQ(stage.camera_out().principal_point[0], 91.5);
  EXPECT_EQ(stage.camera_out().principal_point[1], 1.5);
}

TEST(Crop, MarksWhatIsOutsideTheRange) {
  Harness stage("crop minimum='500 mm' maximum='2 m' minimum_amplitude='100 counts'");
  stage.put<float>("depth", {1, 6}, {0.4F, 0.5F, 2.0F, 2.1F, 1.0F, NAN});
  stage.put<float>("sigma", {1, 6}, std::vector<float>(6, 0.01F),
                   {.unit = "m", .of = "depth", .applied = "", .from = ""});
  stage.put<float>("amplitude", {1, 6}, {200, 200, 200, 200, 99, 200});
  stage.run();
  const auto depth = stage.get<float>("depth"), sigma = stage.get<float>("sigma");
  const auto flags = stage.get<std::uint16_t>("flags");
  EXPECT_EQ(flags, (std::vector<std::uint16_t>{1, 0, 0, 1, 9, 0}));
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(std::isnan(depth[i]), flags[i] != 0 || i == 5);
    EXPECT_EQ(std::isnan(sigma[i]), flags[i] != 0);
  }
  EXPECT_EQ(stage.get<float>("amplitude")[4], 99.0F) << "amplitudes keep what was measured";
}

TEST(Crop, CutsTheFlagsThatItMakes) {
  Harness stage("crop columns=[1, 2] maximum='1 m'");
  stage.put<float>("depth", {2, 3}, {0.1F, 2.0F, 0.3F, 4.0F, 0.5F, 6.0F});
  stage.run();
  EXPECT_EQ(stage.get<std::uint16_t>("flags"), (std::vector<std::uint16_t>{1, 0, 0, 1}));
  EXPECT_EQ(stage.extent("flags"), stage.extent("depth"));
}

TEST(Crop, MarksCloudsWhoseSizeChanges) {
  for (const bool with_flags : {false, true}) {
    Harness stage("crop maximum='1 m'");
    stage.camera("camcube2");  // of 204 x 204 px
    const auto put = [&](const std::vector<float>& depth) {
      stage.put<float>("depth", {1, depth.size()}, depth);
      std::vector<float> points;
      for (const float z : depth) points.insert(points.end(), {0, 0, z});
      stage.put<float>("points", {1, depth.size(), 3}, points);
      if (with_flags) stage.put<std::uint16_t>("flags", {1, depth.size()}, std::vector<std::uint16_t>(depth.size(), 2));
    };
    put({});  // 0: known only with the frame
    stage.prepare();
    const std::uint16_t good = with_flags ? 2 : 0, bad = with_flags ? 3 : 1;
    for (const std::vector<float>& depth : {std::vector<float>{0.5F, 2.0F, 0.7F}, {}, {3.0F}, {1, 2, 3, 4, 0.5F}}) {
      put(depth);
      stage.run();
      ASSERT_EQ(stage.extent("flags"), (std::vector<std::uint64_t>{1, depth.size()}));
      const auto flags = stage.get<std::uint16_t>("flags");
      const auto marked = stage.get<float>("depth"), points = stage.get<float>("points");
      for (std::size_t i = 0; i < depth.size(); ++i) {
        EXPECT_EQ(flags[i], depth[i] > 1 ? bad : good);
        EXPECT_EQ(std::isnan(marked[i]), depth[i] > 1);
        EXPECT_EQ(std::isnan(points[3 * i]), depth[i] > 1);
      }
    }
  }
}

TEST(Crop, CutsCloudsOfKnownSizeButNotTheSensor) {
  Harness stage("crop columns=[1, 2]");
  stage.camera("camcube2");
  stage.put<float>("points", {1, 4, 3}, {0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4});
  stage.run();
  EXPECT_EQ(stage.get<float>("points"), (std::vector<float>{0, 0, 2, 0, 0, 3}));
  EXPECT_EQ(stage.camera_out().width, 204U);
  Harness changing("crop columns=[1, 2]");
  changing.put<float>("points", {1, 0, 3}, {});
  try {
    changing.prepare();
    ADD_FAILURE() << "there is nothing to cut";
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("what arrives changes in size"), std::string::npos) << error.what();
  }
}

TEST(Crop, SaysWhatIsWrong) {
  EXPECT_NE(said("crop columns=[0, 204]").find("reach outside the image, which has 0 to 203"), std::string::npos);
  EXPECT_NE(said("crop rows=[9, 3]").find("the first is greater than the last"), std::string::npos);
  EXPECT_NE(said("crop rows=[9]").find("needs two numbers"), std::string::npos);
  EXPECT_NE(said("crop rows=[1.5, 3]").find("must be whole numbers"), std::string::npos);
  EXPECT_NE(said("crop minimum='2 m' maximum='1 m'").find("must be greater than minimum"), std::string::npos);
  EXPECT_NE(said("crop minimum_amplitude='5 counts'").find("has no amplitude"), std::string::npos);
  EXPECT_NE(said("crop minimum='1 m' channel=range").find("has no range"), std::string::npos);
  EXPECT_EQ(said("crop columns=[0, 203] rows=[0, 0]"), "");
}

}  // namespace
}  // namespace tofgraph
