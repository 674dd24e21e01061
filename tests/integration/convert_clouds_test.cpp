// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: foreign plugins
// Clouds written by PCL, or byte by byte by the test, converted to captures.
#include <gmock/gmock.h>
#include <hdf5.h>
#include <pcl/io/pcd_io.h>
#include <tofgraph/channels.hpp>

#include "tests/small_capture.hpp"
#include "tests/small_conversion.hpp"

#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

using namespace tofgraph::tests;
using testing::HasSubstr;

namespace {

using Points = std::vector<float>;  // x y z of each pixel

/// A slanted plane sampled at the pixels of the small camera; pixel 11 has no point.
Points plane_points() {
  Points points;
  for (std::size_t i = 0; i < small_pixels; ++i) {
    const double x = (static_cast<double>(i % small_width) - 3.5) * 0.045 / 2,
                 y = (static_cast<double>(i / small_width) - 2.5) * 0.045 / 2, z = 1.3 / (1 - 0.3 * x + 0.1 * y);
    for (const double value : {x * z, y * z, z}) points.push_back(i == 11 ? std::nanf("") : static_cast<float>(value));
  }
  return points;
}

class ConvertClouds : public SmallConversion {
 protected:
  /// Expects exactly these points in the capture, bit for bit, with the flag set where there is none.
  void expect_points(const Points& expected, const std::string& what) const {
    const Points points = frames<float>("points");
    const std::vector<std::uint16_t> flags = frames<std::uint16_t>("flags");
    ASSERT_EQ(points.size(), expected.size()) << what;
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_TRUE(points[i] == expected[i] || (std::isnan(points[i]) && std::isnan(expected[i]))) << what << i;
      EXPECT_EQ(flags[i / 3], std::isnan(expected[i]) ? 1 : 0) << what << i;
    }
  }
};

std::string ascii_of(const Points& points, const std::vector<std::size_t>& order) {
  std::string text;
  char line[128];
  for (const std::size_t i : order) {
    std::snprintf(line, sizeof line, "%.9g %.9g %.9g %zu\n", static_cast<double>(points[3 * i]),
                  static_cast<double>(points[3 * i + 1]), static_cast<double>(points[3 * i + 2]), i);
    text += line;
  }
  return text;
}

std::vector<std::size_t> all_pixels() {
  std::vector<std::size_t> order(small_pixels);
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  return order;
}

/// x y z and intensity = pixel, all valid points in a shuffled order.
std::vector<std::size_t> shuffled_valid() {
  std::vector<std::size_t> order = all_pixels();
  order.erase(order.begin() + 11);
  for (std::size_t i = 0; i < order.size(); ++i) std::swap(order[i], order[(7 * i + 3) % order.size()]);
  return order;
}

std::string pcd_header(std::size_t width, std::size_t height, const std::string& data) {
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F "
         "F\nCOUNT 1 1 1 1\nWIDTH " +
         std::to_string(width) + "\nHEIGHT " + std::to_string(height) + "\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
         std::to_string(width * height) + "\nDATA " + data + "\n";
}

TEST_F(ConvertClouds, OrganisedPcdFilesAreReadAsTheyAreInEveryEncoding) {
  const Points expected = plane_points();
  write_text(path("ascii.pcd"), pcd_header(8, 6, "ascii") + ascii_of(expected, all_pixels()));
  std::string raw;
  for (std::size_t i = 0; i < small_pixels; ++i) {
    const float row[4] = {expected[3 * i], expected[3 * i + 1], expected[3 * i + 2], static_cast<float>(i)};
    raw.append(reinterpret_cast<const char*>(row), sizeof row);
  }
  write_text(path("binary.pcd"), pcd_header(8, 6, "binary") + raw);
  pcl::PointCloud<pcl::PointXYZI> cloud(8, 6);
  for (std::size_t i = 0; i < small_pixels; ++i) {
    cloud[i].x = expected[3 * i];
    cloud[i].y = expected[3 * i + 1];
    cloud[i].z = expected[3 * i + 2];
    cloud[i].intensity = static_cast<float>(i);
  }
  pcl::PCDWriter().writeBinaryCompressed(path("compressed.pcd").string(), cloud);
  for (const std::string name : {"ascii", "binary", "compressed"}) {
    const Outcome outcome = convert(name + ".pcd --unit m --as points,amplitude=intensity");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    expect_points(expected, name);
    const std::vector<float> amplitude = frames<float>("amplitude");
    for (std::size_t i = 0; i < small_pixels; ++i) EXPECT_EQ(amplitude[i], static_cast<float>(i)) << name;
  }
  EXPECT_THAT(convert("ascii.pcd --as points").err, HasSubstr("the unit of 'points' ('points') is not stated"));
}

TEST_F(ConvertClouds, PointsInNoOrderGetThePixelsInWhichTheyAreSeen) {
  const Points expected = plane_points();
  const std::vector<std::size_t> order = shuffled_valid();
  write_text(path("scattered.pcd"), pcd_header(order.size(), 1, "ascii") + ascii_of(expected, order));
  const Outcome outcome = convert("scattered.pcd --unit m --as points,amplitude=intensity");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  expect_points(expected, "scattered");
  const std::vector<float> amplitude = frames<float>("amplitude");
  for (std::size_t i = 0; i < small_pixels; ++i)
    EXPECT_TRUE(i == 11 ? std::isnan(amplitude[i]) : amplitude[i] == static_cast<float>(i)) << i;
  EXPECT_THAT(convert("scattered.pcd --as amplitude=intensity").err,
              HasSubstr("belongs to unordered points: read these as well"));
  // A second, farther point in the same pixel is hidden; points behind the camera or outside the image are invisible.
  Points more = expected;
  std::vector<std::size_t> longer = order;
  for (const float scale : {1.5F, -1.0F}) {
    for (std::size_t k = 0; k < 3; ++k) more.push_back(scale * expected[3 * 20 + k]);
    longer.push_back(more.size() / 3 - 1);
  }
  more.insert(more.end(), {5, 0, 1});
  longer.push_back(more.size() / 3 - 1);
  write_text(path("more.pcd"), pcd_header(longer.size(), 1, "ascii") + ascii_of(more, longer));
  ASSERT_EQ(convert("more.pcd --unit m --as points").exit_code, 0);
  expect_points(expected, "more");
}

/// Points in millimetres in no order, and words of 13 bits below three status bits; point 5 holds the largest number.
TEST_F(ConvertClouds, StatusBitsAndCodesOfPointsInNoOrderAreThoseOfTheirPixels) {
  const Points plane = plane_points();
  const std::vector<std::size_t> order = shuffled_valid();
  const unsigned status[] = {0, 0x8000, 0x4000, 0x2000, 0xa000};
  std::string points, words;
  const auto add = [](std::string& bytes, int word) {
    bytes += static_cast<char>(word & 0xff);
    bytes += static_cast<char>(word >> 8 & 0xff);
  };
  for (const std::size_t i : order) {
    for (std::size_t k = 0; k < 3; ++k)
      add(points, i == 5 ? 32767 : static_cast<int>(std::lround(1000 * plane[3 * i + k])));
    add(words, static_cast<int>((100 + i) | status[i % 5]));
  }
  write_text(path("cloud.bin"), points + words);
  const std::string n = std::to_string(order.size());
  write_text(path("layout.yaml"),
             "layout: 1\ncamera: ./tiny.yaml\narrays:\n  xyz: {type: int16, shape: [" + n +
                 ", 3]}\n  words: {type: uint16, shape: [" + n + "]}\nchannels:\n" +
                 "  points: {array: xyz, axes: point coordinate, unit: mm}\n  amplitude: {array: words, axes: point, "
                 "saturated: 0x8000, invalid_bits: 0x4000, bad_pixel: 0x2000}\n");
  const Outcome outcome = tofgraph("convert cloud.bin -o out.h5 --layout layout.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("3 of 141 values of points in 1 frame are 32767"));
  const std::vector<float> amplitude = frames<float>("amplitude");
  const std::vector<std::uint16_t> flags = frames<std::uint16_t>("flags");
  constexpr std::uint16_t bad = tofgraph::flag::bad_pixel | tofgraph::flag::invalid,
                          saturated = tofgraph::flag::saturated;
  const std::uint16_t expected[] = {0, saturated, tofgraph::flag::invalid, bad, bad | saturated};
  for (std::size_t i = 0; i < small_pixels; ++i) {
    const bool none = i == 5 || i == 11;
    EXPECT_EQ(flags[i], none ? tofgraph::flag::invalid : expected[i % 5]) << i;
    if (none || i % 5 >= 2)
      EXPECT_TRUE(std::isnan(amplitude[i])) << i;
    else
      EXPECT_EQ(amplitude[i], static_cast<float>(100 + i)) << i;
  }
}

/// Three values per point instead of one would not fit into the image; raw images have several per point.
TEST_F(ConvertClouds, PointsInNoOrderHaveOneValueEach) {
  write_text(path("three.yaml"),
             std::string(small_profile) + "exposures: [{phase: 0 deg}, {phase: 120 deg}, {phase: 240 deg}]\n");
  write_text(path("cloud.bin"), std::string(60 * 3 * 4 + 180 * 2, 'x'));
  const std::vector<std::array<std::string, 3>> cases = {
      {"[180]", "amplitude: {array: words, axes: point}", "'words' has 180 values, but there are 60 points"},
      {"[3, 60]", "phases: {array: words, axes: exposure point}", "'phases' are images: unordered points have none"},
      {"[3, 20]", "phases: {array: words, axes: exposure point}", "'phases' are images: unordered points have none"}};
  for (const auto& [shape, channel, expected] : cases) {
    write_text(path("layout.yaml"),
               "layout: 1\ncamera: ./three.yaml\narrays:\n  xyz: {type: float32, shape: [60, 3]}\n  words: {type: "
               "int16, shape: " +
                   shape + "}\nchannels:\n  points: {array: xyz, axes: point coordinate, unit: m}\n  " + channel +
                   "\n");
    const Outcome outcome = tofgraph("convert cloud.bin -o out.h5 --layout layout.yaml --force");
    EXPECT_EQ(outcome.exit_code, 2) << shape << channel;
    EXPECT_THAT(outcome.err, HasSubstr(expected)) << shape << channel;
  }
}

/// A PLY file with x y z as float32, followed by a list of faces.
std::string ply_of(const Points& points, const std::vector<std::size_t>& order, const std::string& format) {
  std::string text = "ply\nformat " + format + " 1.0\ncomment by a test\nelement vertex " +
                     std::to_string(order.size()) + "\nproperty float x\nproperty float y\nproperty float z\n" +
                     "end_header\n";
  for (const std::size_t i : order) {
    if (format == "ascii") {
      char line[96];
      std::snprintf(line, sizeof line, "%.9g %.9g %.9g\n", static_cast<double>(points[3 * i]),
                    static_cast<double>(points[3 * i + 1]), static_cast<double>(points[3 * i + 2]));
      text += line;
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      char bytes[4];
      std::memcpy(bytes, &points[3 * i + k], 4);
      if (format == "binary_big_endian") std::reverse(bytes, bytes + 4);
      text.append(bytes, 4);
    }
  }
  return text;
}

TEST_F(ConvertClouds, PlyFilesInEitherByteOrderGetThePixelsOfTheCamera) {
  const Points expected = plane_points();
  for (const std::string format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    write_text(path("cloud.ply"), ply_of(expected, shuffled_valid(), format));
    const Outcome outcome = convert("cloud.ply --unit m --as points");
    ASSERT_EQ(outcome.exit_code, 0) << format << outcome.err;
    expect_points(expected, format);
  }
}

TEST_F(ConvertClouds, CaptureToPcdToCaptureKeepsEveryNumber) {
  SmallCapture capture;
  capture.channels = {{"points", {plane_points()}}, {"amplitude", {plane_ranges(3)}}};
  std::vector<std::uint16_t> flags(small_pixels, 0);
  flags[11] = 1;
  flags[5] = 32;
  capture.flags = {flags};
  capture.write(path("in.h5"));
  for (const std::string encoding : {"ascii", "binary", "binary_compressed"}) {
    ASSERT_EQ(tofgraph("run \"capture_reader file=in.h5 ! pcd_writer path=c.pcd flags=true encoding=" + encoding +
                       "\" --camera ./tiny.yaml --force")
                  .exit_code,
              0);
    const Outcome outcome = convert("c.pcd --unit m --as points,flags,amplitude=intensity");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const Points points = frames<float>("points");
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float expected = plane_points()[i];
      if (encoding == "ascii" && !std::isnan(expected))
        EXPECT_FLOAT_EQ(points[i], expected);
      else
        EXPECT_TRUE(points[i] == expected || (std::isnan(points[i]) && std::isnan(expected))) << encoding << i;
    }
    EXPECT_EQ(frames<std::uint16_t>("flags"), flags) << encoding;
  }
}

TEST_F(ConvertClouds, DamagedCloudsAreOneError) {
  const std::string pcd = pcd_header(8, 6, "binary");
  const std::map<std::string, std::string> files = {
      {"cut.pcd", pcd + std::string(100, 'x')},
      {"huge.pcd", pcd_header(2000000000, 1, "binary") + std::string(100, 'x')},
      {"headless.pcd", "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\n"},
      {"compressed.pcd", pcd_header(8, 6, "binary_compressed") + std::string(40, '\x7f')},
      {"cut.ply", ply_of(plane_points(), shuffled_valid(), "binary_little_endian").substr(0, 300)},
      {"huge.ply", "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n1\n"},
      {"other.ply", "ply\nformat morse 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"}};
  for (const auto& [name, content] : files) {
    write_text(path(name), content);
    const Outcome outcome = convert(name + " --unit m --as points");
    EXPECT_EQ(outcome.exit_code, 2) << name << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(name)) << name;
  }
}

}  // namespace
