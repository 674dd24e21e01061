// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Images written by the stage, read with OpenCV.
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <tofgraph/harness.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/program.hpp"
#include "tests/unit/full_disk.hpp"

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;
const float none = std::numeric_limits<float>::quiet_NaN();

class ImageStage : public testing::Test {
 protected:
  TemporaryFolder folder;
  const std::vector<float> range = {0.5F, 1.0F, none, 1.5F, 2.0004F, 70.0F};

  std::string line(const std::string& name, const std::string& more) const {
    return "image_writer path='" + (folder.path() / name).string() + "' overwrite=true " + more;
  }
  void put(Harness& stage) const {
    stage.put<float>("range", {2, 3}, range);
    stage.put<float>("amplitude", {2, 3}, {0, 1, 2, 3, 4.4F, 4.6F});
    stage.put<std::uint16_t>("flags", {2, 3}, {0, 0, 1, 2, 1024, 65535});
    stage.put<float>("points", {2, 3, 3}, std::vector<float>(18));
  }
  cv::Mat written(const std::string& name, const std::string& more) const {
    Harness stage(line(name, more));
    put(stage);
    stage.run();
    std::string file = name;
    if (const auto at = file.find("{frame}"); at != std::string::npos) file.replace(at, 7, "0");
    return cv::imread((folder.path() / file).string(), cv::IMREAD_UNCHANGED);
  }
  std::string why(const std::string& name, const std::string& more) const {
    return thrown([&] {
      Harness stage(line(name, more));
      put(stage);
      stage.prepare();
    });
  }
};

void expect_words(const std::string& message, const std::string& words) {
  EXPECT_NE(message.find(words), std::string::npos) << words << " is not in: " << message;
}

cv::Mat viridis() {
  cv::Mat levels(1, 256, CV_8U), map;
  for (int i = 0; i < 256; ++i) levels.at<std::uint8_t>(i) = static_cast<std::uint8_t>(i);
  cv::applyColorMap(levels, map, cv::COLORMAP_VIRIDIS);
  return map;
}

std::vector<std::uint16_t> counts(const cv::Mat& image) {
  EXPECT_EQ(image.type(), CV_16UC1);
  return {image.begin<std::uint16_t>(), image.end<std::uint16_t>()};
}

TEST_F(ImageStage, FloatsAreKeptBitForBit) {
  const cv::Mat image = written("a_{frame}.tif", "");
  ASSERT_EQ(image.type(), CV_32FC1);
  ASSERT_EQ(image.size(), cv::Size(3, 2));
  EXPECT_EQ(std::memcmp(image.ptr<float>(0), range.data(), 12), 0);
  EXPECT_EQ(std::memcmp(image.ptr<float>(1), range.data() + 3, 12), 0);
}

TEST_F(ImageStage, CountsAreMillimetresUnlessSaidOtherwise) {
  EXPECT_EQ(counts(written("a_{frame}.png", "format=uint16")),
            std::vector<std::uint16_t>({500, 1000, 0, 1500, 2000, 65535}));
  EXPECT_EQ(counts(written("a_{frame}.png", "format=uint16 scale='0.1 mm'")),
            std::vector<std::uint16_t>({5000, 10000, 0, 15000, 20004, 65535}));
  EXPECT_EQ(counts(written("a_{frame}.png", "format=uint16 scale='2 mm'"))[5], 35000);
  EXPECT_EQ(counts(written("a_{frame}.png", "format=uint16 channel=amplitude")),
            std::vector<std::uint16_t>({0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(counts(written("a_{frame}.png", "format=uint16 channel=amplitude scale='0.1 counts'"))[4], 44);
  EXPECT_EQ(counts(written("a_{frame}.png", "format=uint16 channel=flags")),
            std::vector<std::uint16_t>({0, 0, 1, 2, 1024, 65535}));
}

TEST_F(ImageStage, ThePictureSaysWhatACountIs) {
  written("a_{frame}.png", "format=uint16 scale='0.1 mm'");
  expect_words(read_text(folder.path() / "a_0.png"),
               std::string("tEXtDescription") + '\0' + "range, 0.0001 m per count, 0 is invalid");
  const auto description = [&](const std::string& more) {
    written("a_{frame}.png", "format=uint16 " + more);
    const std::string png = read_text(folder.path() / "a_0.png");
    const std::size_t begin = png.find("tEXtDescription") + 16;
    std::uint32_t length = 0;  // position of the chunk, before its name
    for (std::size_t i = begin - 20; i < begin - 16; ++i) length = length << 8U | static_cast<std::uint8_t>(png[i]);
    return png.substr(begin, length - 12);
  };
  EXPECT_EQ(description("channel=amplitude scale='0.5 counts'"), "amplitude, 0.5 counts per count, 0 is invalid");
  EXPECT_EQ(description("channel=flags"), "flags, 1 per count") << "0 is good";
}

TEST_F(ImageStage, WhatCannotBeEncodedIsAnError) {
  Harness stage(line("a_{frame}.png", "format=uint16 channel=amplitude"));
  constexpr std::size_t columns = 1'000'001;  // libpng's limit is one million
  stage.put<float>("amplitude", {1, columns}, std::vector<float>(columns, 1.0F));
  expect_words(thrown([&] { stage.run(); }), "'amplitude' as a picture of 1000001 x 1 px cannot be encoded as .png");
  EXPECT_FALSE(fs::exists(folder.path() / "a_0.png"));
}

TEST_F(ImageStage, WhatDoesNotFitIsTold) {
  Harness stage(line("a_{frame}.png", "format=uint16"));
  put(stage);
  stage.run();
  put(stage);
  stage.run();
  ASSERT_EQ(stage.messages().size(), 1U) << "once";
  expect_words(stage.messages()[0], "1 pixel of range clipped to 0 to 65.535 m: use a larger scale");
}

TEST_F(ImageStage, ColoursStandForValues) {
  // A ramp over the full scale: enlarged 4 times, below a title of 24 and a margin of 12 dots.
  std::vector<float> values(64 * 64);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = 1 + static_cast<float>(i % 64) / 63;
  values[0] = none;
  Harness stage(line("a_{frame}.png", "minimum='1 m' maximum='2 m' zoom=4"));
  stage.put<float>("depth", {64, 64}, values);
  stage.run();
  const cv::Mat picture = cv::imread((folder.path() / "a_0.png").string());
  const auto pixel = [&](int column, int row) { return picture.at<cv::Vec3b>(36 + 4 * row + 1, 12 + 4 * column + 1); };
  const cv::Mat map = viridis();
  for (int column = 0; column < 64; ++column) {
    const int level = static_cast<int>(std::lround(255.0 * column / 63));
    const cv::Vec3b expected = map.at<cv::Vec3b>(level), found = pixel(column, 5);
    EXPECT_LE(cv::norm(expected, found, cv::NORM_INF), 3) << column;  // one level of 256
  }
  EXPECT_EQ(pixel(0, 0), cv::Vec3b(170, 170, 170)) << "invalid is grey";
}

TEST_F(ImageStage, TheScaleIsBesideThePicture) {
  written("a_{frame}.png", "minimum='1 m' maximum='2 m' zoom=64");
  const cv::Mat picture = cv::imread((folder.path() / "a_0.png").string());
  const int bar = 12 + 192 + 12 + 11;              // its centre: margin, image, margin, half of the bar
  const int top = 36, bottom = 36 + 160 - 40 - 1;  // at least 160 dots high
  const cv::Mat map = viridis();
  for (int row = top + 1; row < bottom; ++row) {  // the largest value on top
    const int level = static_cast<int>(std::lround(255.0 * (bottom - row) / (bottom - top)));
    double least = 255;
    for (int near = std::max(0, level - 2); near <= std::min(255, level + 2); ++near)
      least = std::min(least, cv::norm(picture.at<cv::Vec3b>(row, bar), map.at<cv::Vec3b>(near), cv::NORM_INF));
    EXPECT_LE(least, 2) << row;
  }
  cv::Mat grey;
  cv::cvtColor(picture(cv::Rect(bar + 16, top, 70, bottom - top)), grey, cv::COLOR_BGR2GRAY);
  EXPECT_GT(cv::countNonZero(grey < 128), 100) << "numbers stand beside the bar";
}

TEST_F(ImageStage, FlagsHaveColoursOfTheirOwnAndNames) {
  Harness stage(line("a_{frame}.png", "channel=flags zoom=4"));
  stage.put<std::uint16_t>("flags", {2, 4}, {0, 1, 2, 1 | 2, 8, 2 | 8, 1024, 1 | 32768});
  stage.run();
  const cv::Mat picture = cv::imread((folder.path() / "a_0.png").string());
  const auto dot = [&](int column, int row, int x = 0) {
    return picture.at<cv::Vec3b>(36 + 4 * row, 12 + 4 * column + x);
  };
  const cv::Vec3b none_at_all = dot(0, 0), invalid = dot(1, 0), saturated = dot(2, 0), low = dot(0, 1), bad = dot(2, 1),
                  other = dot(3, 1);
  EXPECT_EQ(invalid, cv::Vec3b(170, 170, 170));
  EXPECT_EQ(dot(3, 0), saturated) << "why it is invalid";
  EXPECT_EQ(dot(3, 0, 1), saturated);
  EXPECT_EQ(dot(1, 1), saturated) << "both flags, dot by dot";
  EXPECT_EQ(dot(1, 1, 1), low);
  const std::vector<cv::Vec3b> all = {none_at_all, invalid, saturated, low, bad, other};
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) EXPECT_GT(cv::norm(all[i], all[k], cv::NORM_INF), 40) << i << " " << k;
    cv::Mat sample;  // in the legend, to the right of the image
    cv::inRange(picture.colRange(12 + 16 + 12, picture.cols), cv::Scalar(all[i]), cv::Scalar(all[i]), sample);
    EXPECT_GT(cv::countNonZero(sample), 200) << i;
  }
  expect_words(read_text(folder.path() / "a_0.png"),
               "flags, pixels: none: 1, invalid: 3, saturated: 3, inconsistent: 0, low signal: 2");
  expect_words(read_text(folder.path() / "a_0.png"), "bad pixel: 1, other: 1");
}

TEST_F(ImageStage, FlagsBetweenGivenLimitsAreNumbers) {
  written("a_{frame}.png", "channel=flags minimum=0 maximum=4");
  expect_words(read_text(folder.path() / "a_0.png"), "flags, colours from 0 to 4");
}

TEST_F(ImageStage, WideNumbersAndTitlesAreNotClipped) {
  // The margin of 12 dots to the right of all text stays white, whatever the text's width.
  for (const char* limits :
       {"minimum='1 counts' maximum='12345678901 counts'", "minimum='1 counts' maximum='1.0000001 counts'"}) {
    written("a_{frame}.png", std::string("channel=amplitude zoom=1 ") + limits);
    const cv::Mat picture = cv::imread((folder.path() / "a_0.png").string());
    cv::Mat grey;
    cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
    EXPECT_EQ(cv::countNonZero(grey.colRange(grey.cols - 6, grey.cols) < 250), 0) << limits;
    const cv::Rect ink = cv::boundingRect(cv::Mat(grey < 128));
    EXPECT_GT(ink.br().x, 100) << limits;
  }
}

TEST_F(ImageStage, AutomaticLimitsLeaveOutliersOut) {
  std::vector<float> values(1000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i) / 1000;
  values[999] = 1000;
  Harness stage(line("a_{frame}.png", ""));
  stage.put<float>("depth", {10, 100}, values);
  stage.run();
  expect_words(read_text(folder.path() / "a_0.png"), "depth, colours from 0.01");
  expect_words(read_text(folder.path() / "a_0.png"), " to 0.989");
}

TEST_F(ImageStage, AnImageWithoutValidPixelsIsGrey) {
  Harness stage(line("a_{frame}.png", "zoom=1"));
  stage.put<float>("depth", {2, 2}, std::vector<float>(4, none));
  stage.run();
  EXPECT_EQ(cv::imread((folder.path() / "a_0.png").string()).at<cv::Vec3b>(37, 13), cv::Vec3b(170, 170, 170));
}

TEST_F(ImageStage, ChecksBeforeTheFirstFrame) {
  expect_words(why("a.jpg", ""), "parameter 'path': ends in '.jpg', expected .png or .tif");
  expect_words(why("a.tif", "format=color"), "parameter 'format': color is written as .png, but path ends in .tif");
  expect_words(why("a.png", "format=float32"), "float32 is written as .tif, but path ends in .png");
  expect_words(why("a.png", "channel=brightness"),
               "there is no 'brightness'; what arrives has range, amplitude, flags, points");
  expect_words(why("a.png", "channel=points"), "'points' has 3 dimensions, an image has two");
  expect_words(why("a.png", "minimum=3"), "parameter 'minimum': 'range' is in m: write e.g. minimum: 500 mm");
  expect_words(why("a.png", "channel=amplitude maximum='3 mm'"),
               "'amplitude' is in counts: write e.g. maximum: 100 counts");
  expect_words(why("a.png", "scale='3 s'"), "'scale' is '3 s': it does not have one of the units m|counts|1");
  expect_words(why("a.png", "minimum='3 m' maximum='2 m'"), "parameter 'minimum': must be less than maximum");
  expect_words(why("a_{x}.png", ""), "{x} is unknown");
  write_text(folder.path() / "b_4.png", "precious");
  const std::string existing = thrown([&] {
    Harness stage("image_writer path='" + (folder.path() / "b_{frame}.png").string() + "'");
    put(stage);
    stage.prepare();
  });
  expect_words(existing, "b_4.png already exists: --force or overwrite: true allows it to be replaced");
}

TEST_F(ImageStage, AFullDiskIsAnErrorAndLeavesNothing) {
  const SmallDisk disk("16k");
  if (!disk.available()) GTEST_SKIP() << "no right to mount a small disk";
  Harness stage("image_writer path='" + (disk.path() / "a_{frame}.tif").string() + "'");
  stage.put<float>("depth", {200, 200}, std::vector<float>(40000, 1));
  expect_words(thrown([&] { stage.run(); }), "a_0.tif cannot be written: No space left on device");
  EXPECT_TRUE(listing(disk.path()).empty());
}

}  // namespace
}  // namespace tofgraph::tests
