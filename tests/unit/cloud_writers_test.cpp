// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Files are read back with PCL's readers and compared with the input.
#include "tests/program.hpp"

#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>
#include <pcl/conversions.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <nlohmann/json.hpp>

#include <bit>
#include <cmath>
#include <random>

namespace tofgraph {
namespace {

constexpr std::size_t rows = 12, columns = 17, pixels = rows * columns;

struct Cloud {
  std::vector<float> points, amplitude, sigma;
  std::vector<std::uint16_t> flags;
};

Cloud cloud() {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-8, 8);
  Cloud c;
  for (std::size_t i = 0; i < pixels; ++i) {
    const bool invalid = i % 13 == 4;
    for (int k = 0; k < 3; ++k) c.points.push_back(invalid ? NAN : value(random));
    c.amplitude.push_back(1000 * value(random));
    c.sigma.push_back(invalid ? NAN : std::abs(value(random)) * 1e-3F);
    c.flags.push_back(static_cast<std::uint16_t>(invalid ? 1 : i * 321));
  }
  return c;
}

void put(Harness& stage, const Cloud& c) {
  stage.put<float>("points", {rows, columns, 3}, c.points);
  stage.put<float>("amplitude", {rows, columns}, c.amplitude);
  stage.put<float>("sigma", {rows, columns}, c.sigma, {.unit = "m", .of = "points", .applied = "", .from = ""});
  stage.put<std::uint16_t>("flags", {rows, columns}, c.flags);
}

template <class T> T field(const pcl::PCLPointCloud2& cloud, const std::string& name, std::size_t point) {
  for (const auto& f : cloud.fields) {
    if (f.name != name) continue;
    T value;
    std::memcpy(&value, &cloud.data[point * cloud.point_step + f.offset], sizeof value);
    return value;
  }
  ADD_FAILURE() << "no field " << name;
  return {};
}

bool same_bits(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }

/// Compares with the input; tolerance 0: bit for bit.
void expect_cloud(const pcl::PCLPointCloud2& read, const Cloud& c, bool dense, float tolerance) {
  std::size_t at = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const bool valid = !std::isnan(c.points[3 * i]);
    if (dense && !valid) continue;
    const float values[] = {field<float>(read, "x", at), field<float>(read, "y", at), field<float>(read, "z", at),
                            field<float>(read, "intensity", at), field<float>(read, "sigma", at)};
    const float expected[] = {c.points[3 * i], c.points[3 * i + 1], c.points[3 * i + 2], c.amplitude[i], c.sigma[i]};
    for (int k = 0; k < 5; ++k) {
      if (tolerance == 0 || std::isnan(expected[k])) {
        EXPECT_TRUE(same_bits(values[k], expected[k]) || (std::isnan(values[k]) && std::isnan(expected[k])))
            << i << " " << k;
      } else {
        EXPECT_NEAR(values[k], expected[k], k == 3 ? 1e-3F : tolerance) << i << " " << k;
      }
    }
    EXPECT_EQ(field<std::uint16_t>(read, "flags", at), c.flags[i]);
    ++at;
  }
  EXPECT_EQ(std::size_t{read.width} * read.height, at);
}

struct Case {
  const char* encoding;
  bool dense;
};

class PcdWriter : public testing::TestWithParam<Case> {};

TEST_P(PcdWriter, LoadsInPclAsItWas) {
  const tests::TemporaryFolder folder;
  const std::string encoding = GetParam().encoding;
  const Cloud c = cloud();
  Harness stage("pcd_writer sigma=true flags=true encoding=" + encoding +
                " dense=" + (GetParam().dense ? "true" : "false") + " path='" +
                (folder.path() / "sub" / "c_{frame:03}.pcd").string() + "'");
  put(stage, c);
  stage.run();
  stage.finish();
  pcl::PCLPointCloud2 read;
  Eigen::Vector4f origin;
  Eigen::Quaternionf orientation;
  int version = 0;
  ASSERT_EQ(pcl::PCDReader().read((folder.path() / "sub" / "c_000.pcd").string(), read, origin, orientation, version),
            0);
  EXPECT_EQ(version, pcl::PCDReader::PCD_V7);
  EXPECT_EQ(read.height, GetParam().dense ? 1U : rows);
  EXPECT_TRUE(origin.isZero());
  EXPECT_TRUE(orientation.isApprox(Eigen::Quaternionf::Identity()));
  expect_cloud(read, c, GetParam().dense, encoding == "ascii" ? 1e-6F : 0);
  pcl::PointCloud<pcl::PointXYZI> typed;
  pcl::fromPCLPointCloud2(read, typed);
  EXPECT_EQ(typed.is_dense, GetParam().dense);
  EXPECT_EQ(typed.width, read.width);
  EXPECT_EQ(nlohmann::json::parse(tests::read_text(folder.path() / "sub" / "c.provenance.json")),
            nlohmann::json::object());
}

INSTANTIATE_TEST_SUITE_P(Encodings, PcdWriter,
                         testing::Values(Case{"ascii", false}, Case{"ascii", true}, Case{"binary", false},
                                         Case{"binary", true}, Case{"binary_compressed", false},
                                         Case{"binary_compressed", true}),
                         [](const auto& info) {
                           return std::string(info.param.encoding) + (info.param.dense ? "_dense" : "_organised");
                         });

TEST(PcdWriter, AsksForThePoseOfTheCameraAfterTransform) {
  const tests::TemporaryFolder folder;
  const auto prepare = [&](const std::string& line) {
    const std::string ending = line.substr(0, 3);
    Harness stage(line + " path='" + (folder.path() / ("moved." + ending)).string() + "'");
    stage.put<float>("points", {1, 1, 3}, {1, 2, 3}, {.applied = "transform T_world_camera"});
    try {
      stage.prepare();
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(prepare("pcd_writer").find("give its pose"), std::string::npos) << prepare("pcd_writer");
  EXPECT_EQ(prepare("pcd_writer viewpoint=[1, 2, 3, 1, 0, 0, 0]"), "");
  EXPECT_EQ(prepare("ply_writer"), "") << "PLY has no place for a pose";
}

TEST(PcdWriter, WritesTheViewpoint) {
  const tests::TemporaryFolder folder;
  Harness stage("pcd_writer viewpoint=[1, 2, 3, 0, 1, 0, 0] path='" + (folder.path() / "c.pcd").string() + "'");
  put(stage, cloud());
  stage.run();
  EXPECT_NE(tests::read_text(folder.path() / "c_000000.pcd").find("VIEWPOINT 1 2 3 0 1 0 0\n"), std::string::npos);
}

TEST(PcdWriter, TakesAnotherChannelAsIntensity) {
  const tests::TemporaryFolder folder;
  const Cloud c = cloud();
  Harness stage("pcd_writer intensity=sigma path='" + (folder.path() / "c.pcd").string() + "'");
  put(stage, c);
  stage.run();
  pcl::PCLPointCloud2 read;
  ASSERT_EQ(pcl::PCDReader().read((folder.path() / "c_000000.pcd").string(), read), 0);
  EXPECT_EQ(field<float>(read, "intensity", 5), c.sigma[5]);
  Harness bare("pcd_writer intensity=none path='" + (folder.path() / "d.pcd").string() + "'");
  put(bare, c);
  bare.run();
  EXPECT_NE(tests::read_text(folder.path() / "d_000000.pcd").find("FIELDS x y z\n"), std::string::npos);
}

std::string said(const std::string& line) {
  try {
    Harness stage(line);
    put(stage, cloud());
    stage.run();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(PcdWriter, ReplacesNothingUnasked) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "c_000007.pcd";
  tests::write_text(file, "precious");
  const std::string line = "pcd_writer path='" + (folder.path() / "c_{frame:06}.pcd").string() + "'";
  EXPECT_NE(said(line).find("c_000007.pcd"), std::string::npos) << said(line);
  EXPECT_EQ(tests::read_text(file), "precious");
  EXPECT_EQ(said(line + " overwrite=true"), "");
}

TEST(PcdWriter, SaysWhatIsWrong) {
  const tests::TemporaryFolder folder;
  const std::string path = " path='" + (folder.path() / "c.pcd").string() + "'";
  EXPECT_NE(said("pcd_writer intensity=colour" + path).find("what arrives has no 'colour'"), std::string::npos);
  EXPECT_NE(said("pcd_writer intensity=flags" + path).find("expected float32"), std::string::npos);
  EXPECT_NE(said("pcd_writer viewpoint=[0, 0, 0]" + path).find("needs seven numbers"), std::string::npos);
  EXPECT_NE(said("pcd_writer viewpoint=[0, 0, 0, 1, 1, 0, 0]" + path).find("must have length 1"), std::string::npos);
  EXPECT_NE(said("pcd_writer path='/proc/nowhere/c.pcd'").find("/proc"), std::string::npos);
}

TEST(PlyWriter, LoadsInPclAsItWas) {
  for (const std::string encoding : {"ascii", "binary"}) {
    const tests::TemporaryFolder folder;
    const Cloud c = cloud();
    Harness stage("ply_writer dense=true sigma=true flags=true encoding=" + encoding + " path='" +
                  (folder.path() / "c.ply").string() + "'");
    put(stage, c);
    stage.run();
    stage.finish();
    pcl::PCLPointCloud2 read;
    ASSERT_EQ(pcl::PLYReader().read((folder.path() / "c_000000.ply").string(), read), 0);
    expect_cloud(read, c, true, encoding == "ascii" ? 1e-6F : 0);
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "c.provenance.json"));
  }
}

}  // namespace
}  // namespace tofgraph
