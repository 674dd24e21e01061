// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The preview of a scene and the colours common to all images, compared with OpenCV's and checked in the PNG's pixels.
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "io/palettes.hpp"
#include "report/scene_preview.hpp"

#include <algorithm>
#include <set>
#include <vector>

namespace tofgraph::tests {
namespace {

constexpr std::size_t rows = 40, columns = 40, pixels = rows * columns;

TEST(Palettes, RisingColoursAreViridis) {
  cv::Mat ramp(1, 256, CV_8U), viridis;
  for (int i = 0; i < 256; ++i) ramp.at<std::uint8_t>(i) = static_cast<std::uint8_t>(i);
  cv::applyColorMap(ramp, viridis, cv::COLORMAP_VIRIDIS);
  for (int i = 0; i < 256; ++i) {
    const io::Colour colour = io::colour_at(io::rising_colours, i / 255.0);
    const cv::Vec3i own(static_cast<int>(colour & 255U), static_cast<int>(colour >> 8U & 255U),
                        static_cast<int>(colour >> 16U));
    EXPECT_LE(cv::norm(own, cv::Vec3i(viridis.at<cv::Vec3b>(i)), cv::NORM_INF), 2) << i;
  }
}

TEST(Palettes, EveryFlagHasAColourAndAName) {
  std::set<io::Colour> colours = {io::no_flag_colour, io::other_flag_colour};
  std::uint32_t bits = 0;
  for (const io::FlagColour& known : io::flag_colours) {
    bits |= known.bit;
    colours.insert(known.colour);
  }
  EXPECT_EQ(bits, 2047U);
  EXPECT_EQ(colours.size(), io::flag_colours.size() + 2);
}

/// Four uniform images, and points on a wall with a step in front of it.
cv::Mat preview(const std::vector<float>& levels) {
  std::vector<float> phases, ramp(pixels), points;
  for (const float level : levels) phases.insert(phases.end(), pixels, level);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float z = i % columns < columns / 2 ? 1.0F : 1.4F, x = static_cast<float>(i % columns) / columns - 0.5F,
                y = static_cast<float>(i / columns) / rows - 0.5F;
    ramp[i] = static_cast<float>(i);
    for (const float v : {x, y, z}) points.push_back(v);
  }
  const std::string png = report::scene_preview({"even",
                                                 rows,
                                                 columns,
                                                 {physics::four_exposures.begin(), physics::four_exposures.end()},
                                                 phases,
                                                 ramp,
                                                 ramp,
                                                 points});
  return cv::imdecode(std::vector<std::uint8_t>(png.begin(), png.end()), cv::IMREAD_COLOR);
}

/// Colour at the centre of an image in the upper row.
cv::Vec3b phase_colour(const cv::Mat& picture, int image) { return picture.at<cv::Vec3b>(225, 30 + 330 * image + 145); }

TEST(ScenePreview, ImagesOfPhasesHaveOneScale) {
  const cv::Mat picture = preview({1000, 500, -1000, 1000});
  EXPECT_EQ(phase_colour(picture, 0), phase_colour(picture, 3)) << "the same counts, the same colour";
  EXPECT_GT(cv::norm(phase_colour(picture, 0), phase_colour(picture, 1), cv::NORM_INF), 60) << "half of them, another";
  EXPECT_GT(cv::norm(phase_colour(picture, 0), phase_colour(picture, 2), cv::NORM_INF), 60);
}

TEST(ScenePreview, NothingLiesOverAnythingElse) {
  const cv::Mat picture = preview({1000, 500, -1000, -500});
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  const cv::Mat ink = grey < 250;
  // Empty areas: between the rows, below the title, and between distance and cloud.
  EXPECT_EQ(cv::countNonZero(ink.rowRange(385, 420)), 0);
  EXPECT_EQ(cv::countNonZero(ink.rowRange(28, 40)), 0);
  EXPECT_EQ(cv::countNonZero(ink.colRange(830, 850).rowRange(385, picture.rows)), 0);
  // Empty areas: between the cloud's title and its box, and at the image borders.
  EXPECT_EQ(cv::countNonZero(ink(cv::Rect(870, 444, 500, 14))), 0);
  EXPECT_EQ(cv::countNonZero(ink.rowRange(picture.rows - 4, picture.rows)), 0);
  EXPECT_EQ(cv::countNonZero(ink.colRange(picture.cols - 4, picture.cols)), 0);
  // The cloud is drawn, with numbers on its axes.
  EXPECT_GT(cv::countNonZero(ink(cv::Rect(870, 460, 500, 420))), 5000);
  EXPECT_GT(cv::countNonZero(grey(cv::Rect(870, 460, 500, 420)) < 90), 300);
}

}  // namespace
}  // namespace tofgraph::tests
