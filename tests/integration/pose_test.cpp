// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: PoseCommand.*
// Rooms: calibration cli
// Poses from simulated chessboards, compared with the scene; and application of a pose to a cloud.
#include "tests/program.hpp"

#include <pcl/conversions.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <regex>
#include <sstream>
#include <vector>

namespace tofgraph::tests {
namespace {

constexpr double degree = 0.017453292519943295;
using Vector = std::array<double, 3>;
using Matrix = std::array<double, 9>;

struct Pose {
  Matrix rotation{};
  Vector translation{};  ///< mm
};

struct View {
  const char* camera = "camcube2";
  double distance = 900, milliseconds = 2;
};

class PoseCommand : public testing::Test {
 protected:
  Outcome run(const std::string& arguments) const { return shell("\"$TOFGRAPH\" " + arguments, folder.path()); }

  /// A chessboard of 8 x 6 inner corners, 30 mm; tilts in degrees, roll of the camera in degrees.
  void simulate(double tilt_x, double tilt_y, double roll, const View& view = {}) const {
    std::ostringstream scene;
    scene << "scene: 1\ncamera: " << view.camera << "\nframes: 4\nintegration_time: " << view.milliseconds
          << " ms\nsubpixels: 5\nroll: " << roll
          << " deg\nobjects:\n  - {name: board, type: chessboard, distance: " << view.distance
          << " mm, columns: 8, rows: 6, square: 30 mm, "
             "tilt_x: "
          << tilt_x << " deg, tilt_y: " << tilt_y << " deg}\n";
    write_text(folder.path() / "scene.yaml", scene.str());
    const Outcome outcome =
        run("run \"simulator scene=scene.yaml ! four_phase_decoder ! capture_writer path=board.h5\" "
            "--force");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  /// The profile camcube2 with a fisheye of 75 deg to each side.
  void write_wide_camera() const {
    std::string text = read_text(std::filesystem::path(TOFGRAPH_SOURCE_DIR) / "devices/profiles/camcube2.yaml");
    for (const auto& [line, by] : {std::pair{"name: camcube2.*", "name: wide"},
                                   {"principal_point: .*", "principal_point: [101.5, 101.5]"},
                                   {"distortion: .*", "distortion: [0.03, -0.01, 0.004, -0.001]"},
                                   {"field_of_view: .*", ""},
                                   {"focal_length: .*", "lens: fisheye\nfocal_length: 3.2 mm"}})
      text = std::regex_replace(text, std::regex(line), by);
    write_text(folder.path() / "wide.yaml", text);
  }
  Pose find(const std::string& more = "") const {
    const Outcome outcome =
        run("pose board.h5 --pattern '{type: chessboard, columns: 8, rows: 6, square: 30 mm}' " + more);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    Pose pose;
    Matrix& r = pose.rotation;
    Vector& t = pose.translation;
    EXPECT_EQ(
        std::sscanf(outcome.out.c_str(),
                    "rotation: [%lf, %lf, %lf, %lf, %lf, %lf, %lf, %lf, %lf]\ntranslation: [%lf mm, %lf mm, %lf mm]",
                    &r[0], &r[1], &r[2], &r[3], &r[4], &r[5], &r[6], &r[7], &r[8], &t[0], &t[1], &t[2]),
        12)
        << outcome.out;
    return pose;
  }

  TemporaryFolder folder;
};

/// R_y(b) R_x(a): the board's orientation in the camera; its transpose is R of T_world_camera.
Matrix board_rotation(double a, double b) {
  const double ca = std::cos(a), sa = std::sin(a), cb = std::cos(b), sb = std::sin(b);
  return {cb, sb * sa, sb * ca, 0, ca, -sa, -sb, cb * sa, cb * ca};
}

/// Angle between a rotation and the transpose of another one, degrees.
double difference(const Matrix& world_camera, const Matrix& camera_world) {
  double trace = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) trace += world_camera[3 * i + k] * camera_world[3 * k + i];
  }
  return std::acos(std::min((trace - 1) / 2, 1.0)) / degree;
}

TEST_F(PoseCommand, IsThatOfTheSceneForEveryTiltAndNeverTurned) {
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {20.0, 0.0}, {-20.0, 15.0}, {0.0, -30.0}, {25.0, 25.0}}) {
    simulate(x, y, 0);
    const Pose pose = find();
    const Matrix truth = board_rotation(x * degree, y * degree);
    // A corner error of 0.1 px in a pattern of 47 px changes the foreshortening like a tilt of 0.4 deg.
    EXPECT_LT(difference(pose.rotation, truth), 0.5) << x << " deg, " << y << " deg";
    // The pattern's centre is on the axis, 900 mm from the sensor plane; the optical centre is 12.8 mm before it.
    Vector expected{};
    for (std::size_t i = 0; i < 3; ++i) expected[i] = -truth[6 + i] * (900 - 12.8);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(pose.translation[i], expected[i], 8) << "axis " << i;
  }
}

TEST_F(PoseCommand, IsThatOfTheSceneThroughAFisheye) {
  write_wide_camera();
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {-25.0, 10.0}, {10.0, 30.0}}) {
    simulate(x, y, 0, {"wide.yaml", 200, 0.5});
    const Pose pose = find("--camera ./wide.yaml"), of_capture = find();
    const Matrix truth = board_rotation(x * degree, y * degree);
    EXPECT_LT(difference(pose.rotation, truth), 0.5) << x << " deg, " << y << " deg";
    // The optical centre is 3.2 mm before the sensor plane.
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(pose.translation[i], -truth[6 + i] * (200 - 3.2), 2) << x << " deg, " << y << " deg, axis " << i;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(of_capture.translation[i], pose.translation[i], 1e-3) << "the profile in the capture, axis " << i;
  }
}

TEST_F(PoseCommand, MovesACloudIntoTheFrameOfThePattern) {
  simulate(20, 10, 0);
  find("-o pose.yaml");
  const Outcome outcome = run(
      "run \"capture_reader file=board.h5 ! optimized_bistatic ! point_cloud ! transform pose=pose.yaml ! pcd_writer "
      "path=c_{frame}.pcd viewpoint='[0, 0, 0, 1, 0, 0, 0]'\"");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  pcl::PCLPointCloud2 read;
  ASSERT_EQ(pcl::PCDReader().read((folder.path() / "c_0.pcd").string(), read), 0);
  pcl::PointCloud<pcl::PointXYZ> cloud;
  pcl::fromPCLPointCloud2(read, cloud);
  std::vector<float> heights;
  for (const pcl::PointXYZ& p : cloud) {
    if (std::isfinite(p.x) && std::abs(p.x) < 0.1F && std::abs(p.y) < 0.08F) heights.push_back(p.z);
  }
  ASSERT_GT(heights.size(), 500U);
  std::ranges::nth_element(heights, heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2));
  EXPECT_NEAR(heights[heights.size() / 2], 0, 6e-3) << "the board is the plane z = 0";
}

TEST_F(PoseCommand, SaysWhatIsWrong) {
  simulate(0, 0, 0);
  const Outcome other = run("pose board.h5 --pattern '{type: chessboard, columns: 5, rows: 4, square: 30 mm}'");
  EXPECT_EQ(other.exit_code, 1) << other.err;
  EXPECT_NE(other.err.find("the pattern is not seen"), std::string::npos) << other.err;
  const Outcome bad = run("pose board.h5 --pattern '{type: chess, columns: 5}'");
  EXPECT_EQ(bad.exit_code, 2) << bad.err;
  EXPECT_NE(bad.err.find("--pattern:1:8: error: 'type' is 'chess'"), std::string::npos) << bad.err;
  const Outcome unknown = run("pose board.h5 --camera nobody --pattern '{type: chessboard}'");
  EXPECT_EQ(unknown.exit_code, 2) << unknown.err;
  EXPECT_NE(unknown.err.find("--camera:1:1: error: there is no camera profile 'nobody'"), std::string::npos)
      << unknown.err;
  const Outcome absent =
      run("pose none.h5 --camera camcube2 --pattern '{type: chessboard, columns: 8, rows: 6, square: 30 mm}'");
  EXPECT_EQ(absent.exit_code, 1) << absent.err;
  EXPECT_NE(absent.err.find("error: none.h5: there is no such file"), std::string::npos) << absent.err;
  write_text(
      folder.path() / "twice.yaml",
      "pipeline: 1\ncamera: camcube2\nnodes:\n  - {stage: simulator}\n  - {stage: four_phase_decoder}\n  - {stage: "
      "optimized_bistatic}\n  - {stage: point_cloud}\n  - {stage: transform, pose: none.yaml}\n  - {stage: 'null'}\n");
  const Outcome missing = run("run twice.yaml");
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("none.yaml"), std::string::npos) << missing.err;
}

}  // namespace
}  // namespace tofgraph::tests
