// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// PCD files, read with PCL.
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <tofgraph/harness.hpp>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/program.hpp"
#include "tests/unit/full_disk.hpp"

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

/// Bits of a float, for comparing NaN and for exact comparison.
std::vector<std::uint32_t> bits(const std::vector<float>& values) {
  std::vector<std::uint32_t> result;
  for (const float value : values) result.push_back(std::bit_cast<std::uint32_t>(value));
  return result;
}

/// A cloud as read by PCL.
struct Cloud {
  pcl::PCLPointCloud2 data;
  Eigen::Vector4f origin;
  Eigen::Quaternionf orientation;

  explicit Cloud(const fs::path& file) {
    int version = 0;
    EXPECT_EQ(pcl::PCDReader().read(file.string(), data, origin, orientation, version), 0) << file;
    EXPECT_EQ(version, pcl::PCDReader::PCD_V7);
  }
  std::vector<std::string> names() const {
    std::vector<std::string> result;
    for (const auto& field : data.fields) result.push_back(field.name);
    return result;
  }
  template <class T> std::vector<T> values(const std::string& name) const {
    const auto field = std::ranges::find(data.fields, name, &pcl::PCLPointField::name);
    if (field == data.fields.end()) throw std::runtime_error("no field " + name);
    std::vector<T> result(std::size_t{data.width} * data.height);
    for (std::size_t i = 0; i < result.size(); ++i)
      std::memcpy(&result[i], data.data.data() + i * data.point_step + field->offset, sizeof(T));
    return result;
  }
};

constexpr std::uint64_t height = 3, width = 4, pixels = height * width;

/// Points with difficult values: odd fractions, the smallest and largest floats, one invalid in the middle.
struct Scene {
  std::vector<float> points, amplitude, intensity, sigma;
  std::vector<std::uint16_t> flags;
  static constexpr std::size_t invalid = 5;

  Scene() {
    for (std::size_t i = 0; i < pixels; ++i) {
      const auto k = static_cast<float>(i);
      for (const float value : {0.1F * k - 0.37F, std::nextafter(1.0F, 2.0F) * k, 1.0F / (3.0F + k)})
        points.push_back(value);
      amplitude.push_back(k / 7);
      intensity.push_back(1000 * k + 0.001F);
      sigma.push_back(0.001F * k);
      flags.push_back(static_cast<std::uint16_t>(i * 5041));
    }
    points[0] = std::numeric_limits<float>::denorm_min();
    points[4] = 999999.94F;  // the largest valid coordinate in the optical frame
    points[7] = -0.0F;
    for (std::size_t k = 0; k < 3; ++k) points[3 * invalid + k] = std::numeric_limits<float>::quiet_NaN();
    sigma[invalid] = std::numeric_limits<float>::quiet_NaN();
    flags[invalid] = 1;
  }
  void put(Harness& stage) const {
    stage.put<float>("points", {height, width, 3}, points);
    stage.put<float>("amplitude", {height, width}, amplitude);
    stage.put<float>("intensity", {height, width}, intensity);
    stage.put<float>("sigma", {height, width}, sigma, {.of = "range"});
    stage.put<std::uint16_t>("flags", {height, width}, flags);
  }
  std::vector<float> axis(std::size_t k) const {
    std::vector<float> result;
    for (std::size_t i = 0; i < pixels; ++i) result.push_back(points[3 * i + k]);
    return result;
  }
  /// Without the invalid point.
  template <class T> static std::vector<T> dense(std::vector<T> values) {
    values.erase(values.begin() + invalid);
    return values;
  }
};

class PcdStage : public testing::Test {
 protected:
  TemporaryFolder folder;
  fs::path out = folder.path() / "out";
  Scene scene;

  std::string line(const std::string& more, const std::string& name = "cloud_{frame:03}.pcd") const {
    return "pcd_writer path='" + (out / name).string() + "' " + more;
  }
  Cloud written(const std::string& more) const {
    Harness stage(line(more + " overwrite=true"));
    scene.put(stage);
    stage.run();
    stage.finish();
    return Cloud(out / "cloud_000.pcd");
  }
  std::string why(const std::string& more, const std::string& name = "cloud_{frame:03}.pcd") const {
    return thrown([&] {
      Harness stage(line(more, name));
      scene.put(stage);
      stage.prepare();
    });
  }
};

void expect_words(const std::string& message, const std::string& words) {
  EXPECT_NE(message.find(words), std::string::npos) << words << " is not in: " << message;
}

TEST_F(PcdStage, EveryEncodingGivesEveryBitBack) {
  for (const std::string encoding : {"binary", "binary_compressed", "ascii"}) {
    const Cloud cloud = written("sigma=true flags=true encoding=" + encoding);
    SCOPED_TRACE(encoding);
    EXPECT_EQ(cloud.names(), std::vector<std::string>({"x", "y", "z", "intensity", "sigma", "flags"}));
    EXPECT_EQ(cloud.data.width, width);
    EXPECT_EQ(cloud.data.height, height);
    EXPECT_EQ(cloud.values<std::uint16_t>("flags"), scene.flags);
    const std::vector<std::pair<const char*, std::vector<float>>> expected = {{"x", scene.axis(0)},
                                                                              {"y", scene.axis(1)},
                                                                              {"z", scene.axis(2)},
                                                                              {"intensity", scene.amplitude},
                                                                              {"sigma", scene.sigma}};
    for (const auto& [name, values] : expected) {
      const auto found = cloud.values<float>(name);
      if (encoding != "ascii") {
        EXPECT_EQ(bits(found), bits(values)) << name;
        continue;
      }
      for (std::size_t i = 0; i < pixels; ++i) {
        const bool both_nan = std::isnan(found[i]) && std::isnan(values[i]);
        EXPECT_TRUE(both_nan || std::abs(found[i] - values[i]) <= 1e-6) << name << " " << found[i] << " " << values[i];
      }
    }
  }
}

TEST_F(PcdStage, DenseCloudsHoldTheValidPointsOnly) {
  for (const std::string encoding : {"binary", "binary_compressed", "ascii"}) {
    const Cloud cloud = written("dense=true flags=true encoding=" + encoding);
    EXPECT_EQ(cloud.data.width, pixels - 1);
    EXPECT_EQ(cloud.data.height, 1U);
    EXPECT_EQ(bits(cloud.values<float>("z")), bits(Scene::dense(scene.axis(2)))) << encoding;
    EXPECT_EQ(cloud.values<std::uint16_t>("flags"), Scene::dense(scene.flags));
  }
}

TEST_F(PcdStage, APclPointTypeLoads) {
  written("");
  pcl::PointCloud<pcl::PointXYZI> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile((out / "cloud_000.pcd").string(), cloud), 0);
  EXPECT_FALSE(cloud.is_dense);
  EXPECT_EQ(cloud.at(3, 2).intensity, scene.amplitude[11]);
  EXPECT_EQ(cloud.at(3, 2).x, scene.points[33]);
  EXPECT_TRUE(std::isnan(cloud.at(1, 1).z));
}

TEST_F(PcdStage, IntensityIsTheAmplitudeUnlessSaidOtherwise) {
  EXPECT_EQ(written("").values<float>("intensity"), scene.amplitude);
  EXPECT_EQ(written("intensity=intensity").values<float>("intensity"), scene.intensity);
  EXPECT_EQ(written("intensity=none").names(), std::vector<std::string>({"x", "y", "z"}));
  expect_words(why("intensity=brightness overwrite=true"), "parameter 'intensity': what arrives has no 'brightness'");
  expect_words(why("intensity=flags overwrite=true"), "'flags' is uint16 with 2 dimensions, expected float32 with 2");
  Harness stage(line("overwrite=true"));
  stage.put<float>("points", {height, width, 3}, scene.points);
  stage.run();
  EXPECT_EQ(Cloud(out / "cloud_000.pcd").names(), std::vector<std::string>({"x", "y", "z"}));
}

TEST_F(PcdStage, TheViewpointIsTheOpticalCentre) {
  const Cloud cloud = written("");
  EXPECT_EQ(cloud.origin, Eigen::Vector4f::Zero());
  EXPECT_TRUE(cloud.orientation.isApprox(Eigen::Quaternionf::Identity()));
}

TEST_F(PcdStage, ACloudWithoutAValidPointIsAFileToo) {
  for (const std::string encoding : {"binary", "binary_compressed", "ascii"}) {
    Harness stage(line("dense=true overwrite=true encoding=" + encoding));
    stage.put<float>("points", {1, 2, 3}, std::vector<float>(6, std::numeric_limits<float>::quiet_NaN()));
    stage.run();
    expect_words(read_text(out / "cloud_000.pcd"), "\nPOINTS 0\n");
  }
}

TEST_F(PcdStage, OneFileAFrameAndTheProvenanceBeside) {
  Harness stage(line(""));
  for (int i = 0; i < 3; ++i) {
    scene.put(stage);
    stage.run();
  }
  stage.finish();
  EXPECT_EQ(listing(out),
            std::vector<std::string>({"cloud.provenance.json", "cloud_000.pcd", "cloud_001.pcd", "cloud_002.pcd"}));
  EXPECT_EQ(read_text(out / "cloud.provenance.json"), "{}\n") << "what the host says it is";
}

TEST_F(PcdStage, ANameWithoutNumberGetsOneWhereMoreThanOneFrameMayCome) {
  Harness stage(line("", "a.pcd"));
  scene.put(stage);
  stage.run();
  EXPECT_TRUE(fs::exists(out / "a_000000.pcd"));
  ASSERT_EQ(stage.messages().size(), 1U);
  expect_words(stage.messages()[0], "they are written to " + (out / "a_{frame:06}.pcd").string());
}

TEST_F(PcdStage, ChecksItsFilesBeforeTheFirstFrame) {
  expect_words(why("", "cloud_{number}.pcd"), "{number} is unknown: only {frame} and {frame:06} are allowed");
  EXPECT_EQ(why(""), "");
  EXPECT_FALSE(fs::exists(out)) << "a check makes nothing";
  const std::string hint = " already exists: --force or overwrite: true allows it to be replaced";
  write_text(out / "cloud_012.pcd", "precious");
  expect_words(why(""), "parameter 'path': " + (out / "cloud_012.pcd").string() + hint);
  EXPECT_EQ(why("overwrite=true"), "");
  fs::rename(out / "cloud_012.pcd", out / "cloud.provenance.json");
  expect_words(why(""), (out / "cloud.provenance.json").string() + hint);
  for (const std::string field : {"sigma", "flags"}) {
    Harness stage(line(field + "=true", "b_{frame}.pcd"));
    stage.put<float>("points", {height, width, 3}, scene.points);
    expect_words(thrown([&] { stage.prepare(); }), "parameter '" + field + "': what arrives has no " + field);
  }
}

TEST_F(PcdStage, AFullDiskIsAnErrorAndLeavesNoHalfCloud) {
  const SmallDisk disk("64k");
  if (!disk.available()) GTEST_SKIP() << "no right to mount a small disk";
  for (const std::string encoding : {"binary", "binary_compressed", "ascii"}) {
    const fs::path cloud = disk.path() / (encoding + "_{frame}.pcd");
    Harness stage("pcd_writer encoding=" + encoding + " path='" + cloud.string() + "'");
    std::vector<float> noise(std::size_t{3} * 200 * 200);
    for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = std::sin(static_cast<float>(i * i % 10007));
    stage.put<float>("points", {200, 200, 3}, noise);
    expect_words(thrown([&] { stage.run(); }), encoding + "_0.pcd cannot be written: No space left on device");
    EXPECT_EQ(listing(disk.path()), std::vector<std::string>{});
  }
}

}  // namespace
}  // namespace tofgraph::tests
