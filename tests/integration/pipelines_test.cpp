// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Pipelines.EveryOne*
// Rooms: plugins
// The shipped pipelines, run unchanged; their results are compared with independent numbers.
#include "tests/program.hpp"

#include <hdf5.h>
#include <pcl/conversions.h>
#include <pcl/io/pcd_io.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <vector>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;
const fs::path pipelines = TOFGRAPH_SOURCE_DIR "/pipelines";

/// A copy of the folder, so that outputs are not written to the source tree.
class Pipelines : public testing::Test {
 protected:
  Pipelines() {
    fs::copy(pipelines, folder.path(), fs::copy_options::recursive);
    fs::create_directories(folder.path().parent_path() / "devices");
    fs::copy(TOFGRAPH_SOURCE_DIR "/devices/calibrations", folder.path().parent_path() / "devices/calibrations");
    fs::remove_all(folder.path() / "out");
  }
  Outcome run(const std::string& arguments) const { return shell("\"$TOFGRAPH\" run " + arguments, folder.path()); }
  pcl::PCLPointCloud2 cloud(const std::string& file) const {
    pcl::PCLPointCloud2 read;
    EXPECT_EQ(pcl::PCDReader().read((folder.path() / file).string(), read), 0) << file;
    return read;
  }
  struct {
    TemporaryFolder root;
    fs::path path() const { return root.path() / "pipelines"; }
  } folder;
};

/// A dataset of the recording, read directly with HDF5.
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
  // Hash of the recording, as computed by sha256sum.
  const std::string sum = shell("sha256sum data/o3d303_scene.h5", folder.path()).out.substr(0, 64);
  EXPECT_EQ(provenance["stages"][0]["files"][0]["sha256"], sum);
}

/// Running the examples leaves the source tree clean.
TEST(OutputsOfTheExamples, AreIgnoredByGit) {
  const fs::path source = TOFGRAPH_SOURCE_DIR;
  if (shell("git rev-parse --git-dir", source).exit_code != 0) GTEST_SKIP() << "no repository";
  for (const char* file : {"pipelines/out/quickstart/cloud_000000.pcd", "pipelines/out/board.h5", "boxes.h5",
                           "boxes.png", "boxes.pcd", "boxes.provenance.json", "campaign/campaign.yaml", "effects.html",
                           "gap/report.html", "found/model.yaml", "pipelines/campaigns/found/report.html"})
    EXPECT_EQ(shell(std::string("git check-ignore -q ") + file, source).exit_code, 0) << file;
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
      ASSERT_NEAR(points[i].z, z, 5e-6);  // the decoded phase is a float: resolution 1 um at 500 mm
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

TEST_F(Pipelines, CompareModelsGivesTheReferencesFigures) {
  // equations.md section 5: mean and sd in mm of a board at 505.02 mm with 2.77 mm of noise on D.
  ASSERT_EQ(run("compare_models.yaml --set table.path=models.json").exit_code, 0);
  const std::map<std::string, std::pair<double, double>> expected = {{"measured", {522.48, 10.48}},
                                                                     {"perpendicular", {513.93, 5.44}},
                                                                     {"simple_bistatic", {504.99, 2.67}},
                                                                     {"optimized", {505.01, 2.68}}};
  const auto table = nlohmann::json::parse(read_text(folder.path() / "models.json"));
  std::size_t found = 0;
  for (const auto& row : table.at("inputs")) {
    const auto wanted = expected.find(row.at("name").get<std::string>());
    ASSERT_NE(wanted, expected.end());
    EXPECT_NEAR(row.at("mean").get<double>() * 1e3, wanted->second.first, 0.05) << wanted->first;
    EXPECT_NEAR(row.at("sd").get<double>() * 1e3, wanted->second.second, 0.05) << wanted->first;
    ++found;
  }
  EXPECT_EQ(found, 4U);
}

/// Cells of a table line.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream row(line);
  for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
  return cells;
}

TEST_F(Pipelines, CompareDenoisersShowsThatEachDenoiserDenoises) {
  const Outcome outcome = run("compare_denoisers.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("\nguided "), std::string::npos) << "no table is shown: " << outcome.out;
  for (const std::string column : {"rms_m", "rms_flat_m", "rms_edge_m"}) {
    std::istringstream table(read_text(folder.path() / "out/denoisers.csv"));
    std::string line;
    std::getline(table, line);
    const std::vector<std::string> header = cells_of(line);
    const auto place = static_cast<std::size_t>(std::ranges::find(header, column) - header.begin());
    ASSERT_LT(place, header.size()) << line;
    std::map<std::string, double> rms;
    while (std::getline(table, line)) {
      const std::vector<std::string> cells = cells_of(line);
      if (cells.at(2) == "all") rms[cells.at(0)] = std::stod(cells.at(place));
    }
    ASSERT_EQ(rms.size(), 9U);
    for (const char* name : {"median", "yaroslavsky", "bilateral", "non_local_means", "adaptive", "robust", "guided"})
      EXPECT_LT(rms.at(name), rms.at("cleaned")) << name << ", " << column;
    EXPECT_LT(rms.at("non_local_means"), rms.at("yaroslavsky")) << column;
    EXPECT_LT(rms.at("robust"), rms.at("non_local_means")) << column;
  }
}

TEST_F(Pipelines, DenoiseBoxesMakesAPictureOfEach) {
  ASSERT_EQ(run("denoise_boxes.yaml").exit_code, 0);
  for (const char* name : {"ideal", "noisy", "yaroslavsky", "bilateral", "non_local_means", "robust"})
    EXPECT_TRUE(fs::exists(folder.path() / "out" / ("boxes_" + std::string(name) + "_000000.png"))) << name;
}

TEST_F(Pipelines, RawDumpToCloudDecodesADumpWrittenByteByByte) {
  // A board at 1 m: amplitude 1000 counts, offset 4000 counts, file image i is phase 3 - i, big-endian.
  std::string bytes;
  for (int image = 0; image < 4; ++image) {
    const int k = 3 - image;
    bytes.append(512, '\0');
    for (int pixel = 0; pixel < 204 * 204; ++pixel) {
      const double xs = (pixel % 204 - 101.5) * 40e-6, ys = (pixel / 204 - 101.5) * 40e-6, f = 12.8e-3, z = 1;
      const double sensor = std::sqrt(xs * xs + ys * ys + f * f), x = xs / f * (z - f), y = ys / f * (z - f);
      const double left = std::sqrt((x + 0.05) * (x + 0.05) + y * y + z * z),
                   right = std::sqrt((x - 0.05) * (x - 0.05) + y * y + z * z);
      const double distance = ((left + right) / 2 + (z - f) * sensor / f + sensor) / 2;
      const double c = 1000 * std::cos(4 * M_PI * 20e6 / 299792458.0 * distance + k * M_PI / 2);
      for (const double tap : {4000 + c / 2, 4000 - c / 2}) {
        const auto value = static_cast<unsigned>(std::lround(tap));
        bytes.push_back(static_cast<char>(value >> 8U));
        bytes.push_back(static_cast<char>(value & 255U));
      }
    }
  }
  write_text(folder.path() / "mine.raw", bytes);
  const Outcome outcome = run("raw_dump_to_cloud.yaml --set grab.file=mine.raw --camera camcube2");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const pcl::PCLPointCloud2 read = cloud("out/raw_dump/cloud_000000.pcd");
  EXPECT_EQ(read.fields.size(), 6U);  // x y z intensity sigma flags
  pcl::PointCloud<pcl::PointXYZI> points;
  pcl::fromPCLPointCloud2(read, points);
  double sum = 0;
  for (const auto& p : points) {
    EXPECT_NEAR(p.z, 1 - 0.0128, 2e-3);  // taps are integers: 1 count of 1000 is 1.2 mm
    EXPECT_NEAR(p.intensity, 1000, 2);
    sum += p.z / static_cast<double>(points.size());
  }
  EXPECT_NEAR(sum, 1 - 0.0128, 2e-5);
}

TEST_F(Pipelines, RawDumpToCloudRunsAsShipped) {
  const Outcome outcome = run("raw_dump_to_cloud.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err.find("warning"), std::string::npos) << outcome.err;
  for (const char* name : {"out/raw_dump/cloud_000000.pcd", "out/raw_dump/cloud_000001.pcd"}) {
    pcl::PointCloud<pcl::PointXYZI> points;
    pcl::fromPCLPointCloud2(cloud(name), points);
    ASSERT_EQ(points.size(), 102U * 102U);
    double wall = 0, box = 0;
    for (std::size_t row = 0; row < 102; ++row) {
      for (std::size_t column = 0; column < 40; ++column) {
        wall += points[row * 102 + column].z / (102 * 40);
        box += points[row * 102 + 62 + column].z / (102 * 40);
      }
    }
    EXPECT_NEAR(wall, 1.2 - 0.0128, 2e-4);
    EXPECT_NEAR(box, 0.8 - 0.0128, 2e-4);
  }
}

TEST_F(Pipelines, TheShippedDumpIsWhatItsSceneGives) {
  const Outcome outcome = run("\"simulator scene=data/raw_dump_scene.yaml ! raw_dump path=again.raw\"");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string shipped = read_text(pipelines / "data/raw_dump.raw"),
                    again = read_text(folder.path() / "again.raw");
  ASSERT_EQ(shipped.size(), 2U * 4 * (512 + 102 * 102 * 2 * 2));
  ASSERT_EQ(again.size(), shipped.size());
  const auto count = [](const std::string& bytes, std::size_t at) {
    return static_cast<unsigned char>(bytes[at]) * 256 + static_cast<unsigned char>(bytes[at + 1]);
  };
  for (std::size_t at = 0; at < shipped.size(); at += 2)  // another math library may round one count differently
    ASSERT_LE(std::abs(count(shipped, at) - count(again, at)), 1) << "at byte " << at;
}

TEST_F(Pipelines, AnEmbeddingProgramSeesTheClouds) {
  const Outcome outcome = shell(TOFGRAPH_BINARY_DIR "/examples/example_embed ideal_board.yaml cloud", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("frame 9: 204 x 204 points, 41616 valid, mean depth 0.4872 m\n10 frames in"),
            std::string::npos)
      << outcome.out;
  const Outcome wrong = shell(TOFGRAPH_BINARY_DIR "/examples/example_embed ideal_board.yaml clud", folder.path());
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_NE(wrong.err.find("there is no node 'clud'"), std::string::npos);
}

TEST_F(Pipelines, ExistingOutputsAreNotTouched) {
  ASSERT_EQ(run("ideal_board.yaml --frames 1").exit_code, 0);
  const Outcome again = run("ideal_board.yaml --frames 1");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("--force"), std::string::npos) << again.err;
  EXPECT_EQ(run("ideal_board.yaml --frames 1 --force").exit_code, 0);
}

TEST_F(Pipelines, OlderFilesOfASeriesStayAndAreTold) {
  const Outcome first = run("ideal_board.yaml --frames 4");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_EQ(first.err.find("older files"), std::string::npos) << first.err;
  std::set<std::string> clouds;
  for (const auto& entry : fs::recursive_directory_iterator(folder.path() / "out")) {
    if (entry.path().extension() == ".pcd") clouds.insert(entry.path().filename());
  }
  ASSERT_EQ(clouds.size(), 4U);
  const Outcome shorter = run("ideal_board.yaml --frames 1 --force");
  ASSERT_EQ(shorter.exit_code, 0) << shorter.err;
  EXPECT_NE(shorter.err.find("older files of this series remain: " + *std::next(clouds.begin()) + " to " +
                             *clouds.rbegin() + " (3 files)\n"),
            std::string::npos)
      << shorter.err;
  const Outcome replaced = run("ideal_board.yaml --frames 4 --force");
  EXPECT_EQ(replaced.exit_code, 0) << replaced.err;
  EXPECT_EQ(replaced.err.find("older files"), std::string::npos) << replaced.err;
}

TEST_F(Pipelines, EveryOneIsRight) {
  for (const fs::path& file : fs::directory_iterator(pipelines)) {  // two need a capture first
    if (file.extension() != ".yaml" || file.stem() == "capture_to_cloud" || file.stem() == "full_chain") continue;
    const Outcome outcome = shell("\"$TOFGRAPH\" check " + file.filename().string(), folder.path());
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
