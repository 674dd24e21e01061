// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The pipelines that come with the project, run as they are; what they make is compared with numbers from elsewhere.
#include "tests/program.hpp"

#include <hdf5.h>
#include <pcl/conversions.h>
#include <pcl/io/pcd_io.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;
const fs::path pipelines = TOFGRAPH_SOURCE_DIR "/pipelines";

/// A copy of the folder, so that outputs do not land in the source tree.
class Pipelines : public testing::Test {
 protected:
  Pipelines() {
    fs::copy(pipelines, folder.path(), fs::copy_options::recursive);
    fs::remove_all(folder.path() / "out");
  }
  Outcome run(const std::string& arguments) const { return shell("\"$TOFGRAPH\" run " + arguments, folder.path()); }
  pcl::PCLPointCloud2 cloud(const std::string& file) const {
    pcl::PCLPointCloud2 read;
    EXPECT_EQ(pcl::PCDReader().read((folder.path() / file).string(), read), 0) << file;
    return read;
  }
  TemporaryFolder folder;
};

/// A dataset of the recording, read with nothing but HDF5.
std::vector<float> recorded(const char* name) {
  const hid_t file = H5Fopen((pipelines / "data/o3d303_scene.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
  const hid_t space = H5Dget_space(set);
  std::vector<float> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  EXPECT_GE(H5Dread(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Sclose(space);
  H5Dclose(set);
  H5Fclose(file);
  return values;
}

TEST_F(Pipelines, QuickstartGivesTheCamerasOwnCloudTo4Millimetres) {
  const Outcome outcome = run("quickstart.yaml --stats stats.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<float> own = recorded("frames/points"), range = recorded("frames/range"),
                           amplitude = recorded("frames/amplitude");
  const std::vector<float> flags = recorded("frames/flags");
  const std::size_t pixels = 176 * 132;
  ASSERT_EQ(own.size(), 3 * pixels * 3);
  for (std::size_t frame = 0; frame < 3; ++frame) {
    const std::string name = "out/quickstart/cloud_00000" + std::to_string(frame) + ".pcd";
    pcl::PointCloud<pcl::PointXYZI> points;
    pcl::fromPCLPointCloud2(cloud(name), points);
    ASSERT_EQ(points.width, 176U);
    ASSERT_EQ(points.height, 132U);
    std::vector<float> off;
    std::size_t valid = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::size_t at = frame * pixels + i;
      const bool measured = (static_cast<int>(flags[at]) & 1) == 0 && std::isfinite(range[at]);
      valid += measured ? 1 : 0;
      const auto& p = points[i];
      EXPECT_EQ(std::isfinite(p.x), measured) << "frame " << frame << " pixel " << i;
      EXPECT_EQ(p.intensity, amplitude[at]);
      if (measured && std::isfinite(own[3 * at]))
        off.push_back(std::hypot(p.x - own[3 * at], p.y - own[3 * at + 1], p.z - own[3 * at + 2]));
    }
    EXPECT_GT(valid, pixels / 2);
    EXPECT_GT(off.size(), pixels / 2);
    std::ranges::nth_element(off, off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2));
    const float median = off[off.size() / 2];
    EXPECT_LT(median, 4e-3F);
    std::printf("frame %zu: %zu valid pixels, median distance to the camera's own points %.2f mm\n", frame, valid,
                static_cast<double>(median) * 1e3);
    EXPECT_TRUE(fs::exists(folder.path() / ("out/quickstart/range_00000" + std::to_string(frame) + ".png")));
  }
  const auto provenance = nlohmann::json::parse(read_text(folder.path() / "out/quickstart/cloud.provenance.json"));
  EXPECT_EQ(provenance["camera"]["name"], "o3d303");
  EXPECT_EQ(provenance["stages"][0]["stage"], "capture_reader");
  // The hash of the recording, as sha256sum gives it.
  const std::string sum = shell("sha256sum data/o3d303_scene.h5", folder.path()).out.substr(0, 64);
  EXPECT_EQ(provenance["stages"][0]["files"][0]["sha256"], sum);
}

TEST_F(Pipelines, IdealBoardIsAPlaneAt500Millimetres) {
  const Outcome outcome = run("ideal_board.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (int frame = 0; frame < 10; ++frame) {
    pcl::PointCloud<pcl::PointXYZI> points;
    pcl::fromPCLPointCloud2(cloud("out/ideal_board/cloud_00000" + std::to_string(frame) + ".pcd"), points);
    ASSERT_EQ(points.size(), 204U * 204U);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double z = 0.5 - 0.0128, column = static_cast<double>(i % 204) - 101.5,
                   row = static_cast<double>(i / 204) - 101.5;
      ASSERT_NEAR(points[i].z, z, 5e-6);  // the decoded phase is a float: 1 um at 500 mm
      ASSERT_NEAR(points[i].x, column / 320 * z, 5e-6);
      ASSERT_NEAR(points[i].y, row / 320 * z, 5e-6);
    }
  }
}

TEST_F(Pipelines, CaptureToCloudReadsWhatRecordBoardWrote) {
  ASSERT_EQ(run("record_board.yaml").exit_code, 0);
  const Outcome outcome = run("capture_to_cloud.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  pcl::PointCloud<pcl::PointXYZI> points;
  pcl::fromPCLPointCloud2(cloud("out/capture/cloud_000019.pcd"), points);
  double sum = 0, squares = 0;
  for (const auto& p : points) {
    sum += p.z;
    squares += p.z * p.z;
  }
  const double n = static_cast<double>(points.size()), mean = sum / n;
  EXPECT_NEAR(mean, 1 - 0.0128, 5e-5);
  // c/(4 pi f) s/(sqrt(2) a): amplitude 7e6 x 0.85 x 1 ms / 2^2 m^2 and the profile's noise of two taps.
  const double amplitude = 7e6 * 0.85 * 1e-3 / 4, tap = amplitude / (2 * 0.5), s = std::sqrt(2 * (9 + 0.012 * tap));
  const double expected = 299792458.0 / (4 * M_PI * 20e6) * s / (std::sqrt(2) * amplitude);
  EXPECT_NEAR(std::sqrt(squares / n - mean * mean) / expected, 1, 0.1);
}

TEST_F(Pipelines, ExistingOutputsAreNotTouched) {
  ASSERT_EQ(run("ideal_board.yaml --frames 1").exit_code, 0);
  const Outcome again = run("ideal_board.yaml --frames 1");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("--force"), std::string::npos) << again.err;
  EXPECT_EQ(run("ideal_board.yaml --frames 1 --force").exit_code, 0);
}

TEST_F(Pipelines, EveryOneIsRight) {
  for (const auto& entry : fs::directory_iterator(pipelines)) {
    if (entry.path().extension() != ".yaml" || entry.path().filename() == "capture_to_cloud.yaml") continue;
    const Outcome outcome = shell("\"$TOFGRAPH\" check " + entry.path().filename().string(), folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  }
}

TEST(FullDisk, LeavesNothingHalfWrittenUnderTheFinalName) {
  const TemporaryFolder folder;
  const std::string disk = (folder.path() / "disk").string();
  fs::create_directory(disk);
  if (shell("mount -t tmpfs -o size=2m tmpfs " + disk, "/tmp").exit_code != 0)
    GTEST_SKIP() << "mounting a small disk needs root";
  const Outcome outcome = shell(
      "\"$TOFGRAPH\" run \"simulator frames=20 noise=none ! four_phase_decoder ! optimized_bistatic ! point_cloud ! "
      "pcd_writer path='" +
          disk + "/c_{frame:06}.pcd'\" --camera camcube2",
      "/tmp");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("No space left on device"), std::string::npos) << outcome.err;
  std::size_t whole = 0;
  for (const auto& entry : fs::directory_iterator(disk)) {
    EXPECT_TRUE(entry.path().extension() == ".pcd" || entry.path().extension() == ".json") << entry.path();
    if (entry.path().extension() != ".pcd") continue;
    pcl::PCLPointCloud2 read;
    EXPECT_EQ(pcl::PCDReader().read(entry.path().string(), read), 0);
    EXPECT_EQ(read.width * read.height, 41616U);
    ++whole;
  }
  EXPECT_GE(whole, 1U);
  shell("umount " + disk, "/tmp");
}

}  // namespace
}  // namespace tofgraph::tests
