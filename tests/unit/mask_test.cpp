// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <tofgraph/channels.hpp>
#include <tofgraph/harness.hpp>

#include "tests/program.hpp"
#include "tests/unit/message_of.hpp"

#include <cmath>
#include <memory>

namespace tofgraph {
namespace {

const float nan = std::nanf("");
using Flags = std::vector<std::uint16_t>;

/// Six pixels with these channels.
std::unique_ptr<Harness> masked(const std::string& options, const Flags& flags = Flags(6, 0)) {
  auto stage = std::make_unique<Harness>("mask " + options);
  stage->put<float>("depth", {2, 3}, {1, 1, 1, 1, 1, 1});
  stage->put<float>("amplitude", {2, 3}, {10, 100, 1000, 30000, nan, 100});
  stage->put<float>("sigma", {2, 3}, {0.03F, 0.01F, 0.001F, 0.001F, nan, 0.02F}, {.of = "depth"});
  stage->put<std::uint16_t>("flags", {2, 3}, flags);
  // c0 - c1 + c2 - c3 is 0, 4, 40, 4000, 0, 60
  stage->put<std::int16_t>("phases", {4, 2, 3},
                           {5, 4, 40, 4000, 0, 60, 0, 0, 0, 0, 0, 0, -5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  stage->run();
  return stage;
}

TEST(Mask, AmplitudesOutsideTheRangeBecomeInvalidWithTheirReason) {
  const auto stage = masked("min_amplitude='50 counts' max_amplitude='20000 counts'");
  EXPECT_EQ(stage->get<std::uint16_t>("flags"),
            (Flags{flag::low_signal | flag::invalid, 0, 0, flag::saturated | flag::invalid,
                   flag::low_signal | flag::invalid, 0}));
  const auto depth = stage->get<float>("depth");
  EXPECT_TRUE(std::isnan(depth[0]) && std::isnan(depth[3]) && std::isnan(depth[4]));
  EXPECT_EQ(depth[1], 1);
  EXPECT_EQ(stage->get<float>("amplitude")[0], 10) << "amplitudes stay as they were measured";
}

TEST(Mask, OnlyFlagsWhereNothingIsToBecomeInvalid) {
  const auto stage = masked("max_sigma='15 mm' invalidate=false");
  EXPECT_EQ(stage->get<std::uint16_t>("flags"), (Flags{flag::low_signal, 0, 0, 0, flag::low_signal, flag::low_signal}));
  EXPECT_EQ(stage->get<float>("depth")[0], 1);
}

TEST(Mask, NullChannelIsComparedWithTheAmplitude) {
  // N2 is a quarter of the sums above: 0, 1 %, 1 %, 3.3 %, NaN, 15 % of the amplitude.
  const auto stage = masked("max_null2='2 %'");
  const std::uint16_t both = flag::inconsistent | flag::invalid;
  EXPECT_EQ(stage->get<std::uint16_t>("flags"), (Flags{0, 0, 0, both, both, both}));
}

TEST(Mask, PixelsWithCertainFlagsBecomeInvalid) {
  const auto stage = masked("flagged=[wrapped, extrapolated]",
                            {flag::wrapped, flag::mixed, flag::extrapolated | flag::mixed, 0, 0, 0});
  EXPECT_EQ(stage->get<std::uint16_t>("flags"), (Flags{flag::wrapped | flag::invalid, flag::mixed,
                                                       flag::extrapolated | flag::mixed | flag::invalid, 0, 0, 0}));
}

TEST(Mask, PixelsThatAMapListsBecomeBadAndInvalid) {
  const tests::TemporaryFolder folder;
  constexpr std::size_t side = 204, first = 5, second = 3 * side + 7;
  std::string map = "\x93NUMPY\x01";
  map.push_back('\0');
  std::string head = "{'descr': '|u1', 'fortran_order': False, 'shape': (204, 204), }";
  head.resize(117, ' ');
  map += std::string{static_cast<char>(118), '\0'} + head + "\n" + std::string(side * side, '\0');
  map[128 + first] = map[128 + second] = 1;
  tests::write_text(folder.path() / "map.npy", map);
  Harness stage("mask bad_pixels='" + (folder.path() / "map.npy").string() + "'");
  stage.camera("camcube2");
  stage.put<float>("depth", {side, side}, std::vector<float>(side * side, 1));
  stage.put<std::uint16_t>("flags", {side, side}, Flags(side * side, 0));
  stage.run();
  const auto flags = stage.get<std::uint16_t>("flags");
  const auto depth = stage.get<float>("depth");
  for (std::size_t i = 0; i < side * side; ++i) {
    const bool bad = i == first || i == second;
    ASSERT_EQ(flags[i], bad ? flag::bad_pixel | flag::invalid : 0) << "pixel " << i;
    ASSERT_EQ(std::isnan(depth[i]), bad) << "pixel " << i;
  }
}

/// An 8-bit image, the usual format of masks.
TEST(Mask, APictureKeepsWhatIsNotBlack) {
  const tests::TemporaryFolder folder;
  cv::Mat picture(204, 204, CV_8U, cv::Scalar(0));
  cv::circle(picture, {100, 90}, 40, cv::Scalar(255), cv::FILLED);
  cv::imwrite((folder.path() / "mask.png").string(), picture);
  for (const std::string keep : {"inside", "outside"}) {
    Harness stage("mask image='" + (folder.path() / "mask.png").string() + "' keep=" + keep);
    stage.camera("camcube2");
    stage.put<float>("depth", {204, 204}, std::vector<float>(204 * 204, 1));
    stage.run();
    const auto flags = stage.get<std::uint16_t>("flags");
    const auto depth = stage.get<float>("depth");
    for (int i = 0; i < 204 * 204; ++i) {
      const bool masked = (picture.at<std::uint8_t>(i / 204, i % 204) == 0) == (keep == "inside");
      ASSERT_EQ(flags[static_cast<std::size_t>(i)], masked ? flag::user | flag::invalid : 0) << i;
      ASSERT_EQ(std::isnan(depth[static_cast<std::size_t>(i)]), masked) << i;
    }
  }
}

/// OpenCV decides which pixels are inside: a polygon with a notch and corners between pixels, edges on pixels included.
TEST(Mask, APolygonHasThePixelsThatOpenCvFindsInIt) {
  const std::vector<cv::Point2f> corners = {{3, 2}, {40.5F, 4.25F}, {30, 20}, {50, 33}, {10.75F, 44.5F}, {3, 30}};
  std::string list;
  for (const cv::Point2f& p : corners)
    list += (list.empty() ? "" : ", ") + std::to_string(p.x) + ", " + std::to_string(p.y);
  Harness stage("mask polygon=[" + list + "]");
  stage.put<float>("range", {48, 64}, std::vector<float>(48 * 64, 1));
  stage.run();
  const auto flags = stage.get<std::uint16_t>("flags");
  std::size_t kept = 0;
  for (int i = 0; i < 48 * 64; ++i) {
    const cv::Point2f pixel(static_cast<float>(i % 64), static_cast<float>(i / 64));
    const bool inside = cv::pointPolygonTest(corners, pixel, false) >= 0;
    ASSERT_EQ(flags[static_cast<std::size_t>(i)] == 0, inside) << pixel;
    kept += inside ? 1 : 0;
  }
  EXPECT_GT(kept, 1000U);
}

TEST(Mask, CodesOfTheLengthOrOfAnotherChannelAreMasked) {
  const auto stage = masked("codes=[30000, 1000] codes_of=amplitude");
  const std::uint16_t both = flag::user | flag::invalid;
  EXPECT_EQ(stage->get<std::uint16_t>("flags"), (Flags{0, 0, both, both, 0, 0}));

  Harness millimetres("mask codes=[0, 65.535] invalidate=false");
  std::vector<float> depth;
  for (const int value : {0, 65535, 65534, 65, 1200, 65535}) depth.push_back(static_cast<float>(value) * 0.001F);
  millimetres.put<float>("depth", {2, 3}, depth);
  millimetres.run();
  EXPECT_EQ(millimetres.get<std::uint16_t>("flags"), (Flags{flag::user, flag::user, 0, 0, 0, flag::user}));

  const auto phases = masked("codes=[60] codes_of=phases");
  EXPECT_EQ(phases->get<std::uint16_t>("flags"), (Flags{0, 0, 0, 0, 0, both}));
}

TEST(Mask, SaysWhatIsMissing) {
  const auto refusal = [](const std::string& options) {
    return message_of([&] {
      Harness stage("mask " + options);
      stage.put<float>("depth", {2, 3}, std::vector<float>(6, 1));
      stage.prepare();
    });
  };
  EXPECT_NE(refusal("").find("there is nothing to do"), std::string::npos) << refusal("");
  EXPECT_NE(refusal("min_amplitude='5 counts'").find("needs the amplitude"), std::string::npos);
  EXPECT_NE(refusal("max_sigma='5 mm'").find("needs sigma"), std::string::npos);
  EXPECT_NE(refusal("polygon=[1, 2, 3, 4, 5]").find("two for each of three or more corners"), std::string::npos);
  EXPECT_NE(refusal("keep=outside codes=[0]").find("is for polygon and image"), std::string::npos);
  EXPECT_NE(refusal("codes=[0] codes_of=amplitud").find("there is no channel 'amplitud'"), std::string::npos);
  EXPECT_NE(refusal("polygon=[0, 0, 1, 0, 1, 1] codes_of=depth").find("no codes"), std::string::npos);
  EXPECT_NE(refusal("flagged=wraped").find("there is no flag 'wraped'"), std::string::npos);
}

}  // namespace
}  // namespace tofgraph
