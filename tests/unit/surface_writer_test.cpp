// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Images of surfaces: visible, hidden and excluded parts, checked by the colours in the file.
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <tofgraph/harness.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/program.hpp"
#include "tests/unit/full_disk.hpp"

namespace tofgraph::tests {
namespace {

const float none = std::numeric_limits<float>::quiet_NaN();

class SurfaceStage : public testing::Test {
 protected:
  static constexpr std::uint64_t rows = 40, columns = 60;
  TemporaryFolder folder;
  std::vector<float> depth = std::vector<float>(rows * columns, 1.0F);

  void set(std::uint64_t first_row, std::uint64_t last_row, std::uint64_t first_column, std::uint64_t last_column,
           float value) {
    for (std::uint64_t r = first_row; r <= last_row; ++r)
      for (std::uint64_t c = first_column; c <= last_column; ++c) depth[r * columns + c] = value;
  }
  cv::Mat picture(const std::string& more) const {
    const std::string file = (folder.path() / "surface_{frame}.png").string();
    Harness stage("surface_writer path='" + file + "' overwrite=true " + more);
    stage.put<float>("depth", {rows, columns}, depth);
    stage.run();
    const cv::Mat result = cv::imread((folder.path() / "surface_0.png").string());
    if (result.empty()) throw std::runtime_error("there is no picture");
    return result;
  }
  std::string why(const std::string& name, const std::string& more) const {
    return thrown([&] {
      Harness stage("surface_writer path='" + (folder.path() / name).string() + "' " + more);
      stage.put<float>("depth", {rows, columns}, depth);
      stage.prepare();
    });
  }
};

constexpr int scale_width = 100;  // width of the colour scale, on the right of the image

/// Pixels of the surface: axes and walls are grey, the colour scale is on the right.
cv::Mat coloured(const cv::Mat& picture) {
  cv::Mat result(picture.size(), CV_8U);
  std::transform(picture.begin<cv::Vec3b>(), picture.end<cv::Vec3b>(), result.begin<std::uint8_t>(),
                 [](const cv::Vec3b& dot) {
                   const auto [least, most] = std::minmax({dot[0], dot[1], dot[2]});
                   return most - least > 30 ? std::uint8_t{255} : std::uint8_t{0};
                 });
  result.colRange(result.cols - scale_width, result.cols).setTo(0);
  return result;
}

const std::string limits = "minimum='500 mm' maximum='1500 mm' ";

TEST_F(SurfaceStage, AFlatImageSeenFromAboveIsAPlateOfOneColour) {
  const cv::Mat plate = picture(limits + "azimuth='0 deg' elevation='85 deg'"), mask = coloured(plate);
  EXPECT_EQ(plate.size(), cv::Size(720, 540));
  const cv::Rect seen = cv::boundingRect(mask);
  EXPECT_GE(cv::countNonZero(mask(seen)), seen.area() - 4);  // a corner pixel may be half covered
  const cv::Mat inside = plate(cv::Rect(seen.x + 2, seen.y + 2, seen.width - 4, seen.height - 4));
  EXPECT_EQ(
      cv::norm(inside, cv::Mat(inside.size(), inside.type(), cv::Scalar(inside.at<cv::Vec3b>(0, 0))), cv::NORM_INF), 0);
  EXPECT_NEAR(static_cast<double>(seen.width) / seen.height, 60.0 / 40 / std::sin(85 * M_PI / 180), 0.01);
}

TEST_F(SurfaceStage, HasTheColoursOfTheOtherPicturesAndTheirScale) {
  const std::string above = limits + "azimuth='0 deg' elevation='85 deg'";
  // Near is dark, as in image_writer: 600 mm is one tenth of the range, 1400 mm nine tenths.
  const auto brightness = [&](float value) {
    set(0, rows - 1, 0, columns - 1, value);
    const cv::Mat plate = picture(above);
    const cv::Scalar mean = cv::mean(plate, coloured(plate));
    return mean[0] + mean[1] + mean[2];
  };
  EXPECT_LT(brightness(0.6F), brightness(1.0F));
  EXPECT_LT(brightness(1.0F), brightness(1.4F));
  const cv::Mat side = picture(above).colRange(720 - scale_width, 720);
  const auto dots = [&side](const cv::Vec3b& colour) {
    cv::Mat same;
    cv::inRange(side, cv::Scalar(colour) - cv::Scalar::all(6), cv::Scalar(colour) + cv::Scalar::all(6), same);
    return same;
  };
  const cv::Mat low = dots({84, 1, 68}), high = dots({37, 231, 253});  // the ends of viridis
  ASSERT_GT(cv::countNonZero(low), 10);
  ASSERT_GT(cv::countNonZero(high), 10);
  EXPECT_LT(cv::boundingRect(high).br().y, cv::boundingRect(low).y) << "the greatest value on top";
}

TEST_F(SurfaceStage, ANarrowPictureHasRoomForItsWords) {
  for (const char* size : {"300", "479", "480", "720"}) {
    const cv::Mat narrow = picture(limits + "size=" + size);
    cv::Mat grey;
    cv::cvtColor(narrow, grey, cv::COLOR_BGR2GRAY);
    EXPECT_EQ(cv::countNonZero(grey.colRange(0, 2) < 250), 0) << size;
    EXPECT_EQ(cv::countNonZero(grey.colRange(grey.cols - 2, grey.cols) < 250), 0) << size;
  }
}

TEST_F(SurfaceStage, InvalidPixelsAreHoles) {
  const std::string above = limits + "azimuth='0 deg' elevation='85 deg'";
  const cv::Mat whole = coloured(picture(above));
  set(10, 19, 30, 39, none);
  const cv::Mat part = coloured(picture(above)), hole = whole & ~part;
  const cv::Rect plate = cv::boundingRect(whole), missing = cv::boundingRect(hole);
  // The facets between rows 9 and 20, columns 29 and 40 of 39 x 59.
  EXPECT_NEAR((missing.x - plate.x) / static_cast<double>(plate.width), 29.0 / 59, 0.01);
  EXPECT_NEAR((missing.y - plate.y) / static_cast<double>(plate.height), 9.0 / 39, 0.01);
  EXPECT_NEAR(missing.width / static_cast<double>(plate.width), 11.0 / 59, 0.01);
  EXPECT_NEAR(missing.height / static_cast<double>(plate.height), 11.0 / 39, 0.01);
  EXPECT_EQ(cv::countNonZero(part(missing)), 0);

  set(0, rows - 1, 0, columns - 1, none);
  EXPECT_EQ(cv::countNonZero(coloured(picture(above))), 0);
  EXPECT_EQ(cv::countNonZero(coloured(picture("azimuth='20 deg'"))), 0);
}

TEST_F(SurfaceStage, WhatIsNearStandsUpAndHidesWhatIsBehind) {
  const std::string turned = "' elevation='20 deg'";
  set(0, rows - 1, 0, columns - 1, 1.5F);
  set(20, 22, 0, columns - 1, 0.5F);  // a wall across all columns
  const cv::Mat before = picture(limits + "azimuth='0 deg" + turned),
                behind = picture(limits + "azimuth='180 deg" + turned);
  set(4, 6, 10, 49, 1.2F);  // too low to be seen over the wall
  EXPECT_EQ(cv::norm(picture(limits + "azimuth='0 deg" + turned), before, cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(picture(limits + "azimuth='180 deg" + turned), behind, cv::NORM_INF), 50);
  set(4, 6, 10, 49, 0.5F);  // as high as the wall, but farther back
  EXPECT_GT(cv::norm(picture(limits + "azimuth='0 deg" + turned), before, cv::NORM_INF), 50);
}

TEST_F(SurfaceStage, LimitsCutTheColoursNotTheHeights) {
  const std::string turned = "azimuth='0 deg' elevation='20 deg'";
  set(0, 19, 0, columns - 1, 0.5F);
  set(20, rows - 1, 0, columns - 1, 1.5F);
  const cv::Mat own = picture(turned + " minimum='500 mm' maximum='1500 mm'"),
                narrow = picture(turned + " minimum='700 mm' maximum='1300 mm'");
  cv::Mat differ;
  cv::bitwise_xor(coloured(own), coloured(narrow), differ);
  EXPECT_EQ(cv::countNonZero(differ), 0) << "the same surface";
  // Beyond the limits the end colours are used: height differences there are not visible.
  set(0, 19, 0, columns - 1, 0.5F);
  set(20, rows - 1, 0, columns - 1, 0.9F);
  set(10, 12, 20, 30, 0.4F);
  const cv::Mat step = picture(turned + " minimum='600 mm' maximum='800 mm'");
  set(10, 12, 20, 30, 0.5F);
  EXPECT_GT(cv::norm(step, picture(turned + " minimum='600 mm' maximum='800 mm'"), cv::NORM_INF), 50)
      << "a step beyond the limits is seen by its height";
}

TEST_F(SurfaceStage, APictureHasOneUnit) {
  set(0, 19, 0, columns - 1, 0.5F);
  set(20, rows - 1, 0, columns - 1, 1.5F);
  const auto title = [&](const std::string& ends) { return picture(ends).rowRange(8, 30).clone(); };
  EXPECT_EQ(cv::norm(title("minimum='600 mm' maximum='800 mm'"), title(limits), cv::NORM_INF), 0)
      << "colours up to 0.8 m, heights up to 1.5 m: both in m";
}

TEST_F(SurfaceStage, WhatIsNotFiniteIsAHole) {
  const auto amplitudes = [&](float odd) {
    std::vector<float> values(rows * columns, 100.0F);
    std::fill_n(values.begin(), columns, 200.0F);
    values[20 * columns + 30] = odd;
    Harness stage("surface_writer channel=amplitude overwrite=true path='" +
                  (folder.path() / "a_{frame}.png").string() + "'");
    stage.put<float>("amplitude", {rows, columns}, values, {.unit = "counts"});
    stage.run();
    return cv::imread((folder.path() / "a_0.png").string());
  };
  const cv::Mat hole = amplitudes(none);
  EXPECT_GT(cv::norm(hole, amplitudes(100), cv::NORM_INF), 50);
  for (const float infinity : {HUGE_VALF, -HUGE_VALF})
    EXPECT_EQ(cv::norm(hole, amplitudes(infinity), cv::NORM_INF), 0) << infinity;
}

TEST_F(SurfaceStage, SaysWhatIsWrong) {
  const auto expect = [&](const std::string& name, const std::string& more, const std::string& words) {
    EXPECT_NE(why(name, more).find(words), std::string::npos) << words << " is not in: " << why(name, more);
  };
  expect("a.jpg", "", "ends in '.jpg', expected .png");
  expect("a.png", "channel=range", "there is no 'range'");
  expect("a.png", "minimum='2 m' maximum='1 m'", "must be less than maximum");
  expect("a.png", "minimum='20 counts'", "is in m: write e.g. minimum: 500 mm");
  expect("a.png", "elevation='90 deg'", "elevation");
}

TEST_F(SurfaceStage, NeedsTwoPixelsEachWay) {
  EXPECT_NE(thrown([&] {
              Harness stage("surface_writer path='" + (folder.path() / "a.png").string() + "'");
              stage.put<float>("depth", {1, 9}, std::vector<float>(9, 1));
              stage.run();
            }).find("has 9 x 1 pixels, a surface needs at least 2 x 2"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace tofgraph::tests
