// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Fisheyes, compared with OpenCV's fisheye module; ray tables, compared with their source lens; fields of view.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <tofgraph/harness.hpp>
#include <tofgraph/physics/lens.hpp>

#include "io/profile.hpp"
#include "tests/program.hpp"
#include "tests/unit/message_of.hpp"

#include <opencv2/calib3d.hpp>

#include <cmath>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

namespace tofgraph {
namespace {

using testing::HasSubstr;

constexpr std::size_t width = 96, height = 80, pixels = width * height;
constexpr double fx = 40, fy = 40.5, cx = 47.2, cy = 39.1;
const std::string head = "profile: 1\nname: wide\nwidth: 96\nheight: 80\n";
const std::string fisheye_profile = head +
                                    "focal_length: [40 px, 40.5 px]\nprincipal_point: [47.2, 39.1]\nlens: fisheye\n"
                                    "distortion: [-0.03, 0.011, -0.004, 0.0006]\n";
const cv::Matx33d matrix(fx, 0, cx, 0, fy, cy, 0, 0, 1);
const cv::Vec4d powers(-0.03, 0.011, -0.004, 0.0006);

class LensModels : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    tests::write_text(folder_.path() / name, text);
    return (folder_.path() / name).string();
  }
  io::CameraPtr load(const std::string& text) const { return io::load_profile(write("p.yaml", text)); }
  std::string refused(const std::string& text) const {
    return message_of([&] { load(text); });
  }

  /// An array of float64 in NumPy's format.
  void write_npy(const std::string& name, const std::vector<double>& values, const std::string& shape) const {
    std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': " + shape + ", }";
    header.resize(117, ' ');
    std::ofstream out(folder_.path() / name, std::ios::binary);
    out << "\x93NUMPY" << '\1' << '\0' << static_cast<char>(118) << '\0' << header << '\n';
    out.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * 8));
  }

  tests::TemporaryFolder folder_;
};

/// Image point of each pixel of the fisheye by OpenCV.
std::vector<cv::Point2d> ideal_points() {
  std::vector<cv::Point2d> seen, ideal;
  for (std::size_t i = 0; i < pixels; ++i) seen.emplace_back(i % width, i / width);
  cv::fisheye::undistortPoints(seen, ideal, matrix, powers, cv::noArray(), cv::noArray(),
                               cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-14));
  return ideal;
}

TEST_F(LensModels, AFisheyeHasTheRaysOfOpenCv) {
  const io::CameraPtr camera = load(fisheye_profile);
  const float* rays = camera->view().rays;
  const std::vector<cv::Point2d> ideal = ideal_points();
  std::size_t compared = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!(rays[3 * i + 2] > 0.05F)) continue;  // tangents beyond 87 deg are imprecise in float32
    ++compared;
    const cv::Point2d found(rays[3 * i] / rays[3 * i + 2], rays[3 * i + 1] / rays[3 * i + 2]);
    const double radius = cv::norm(ideal[i]);
    ASSERT_NEAR(cv::norm(found - ideal[i]), 0, 2e-6 * (1 + radius * radius)) << i;
  }
  EXPECT_GT(compared, pixels * 9 / 10);
  EXPECT_EQ(io::load_profile(write("again.yaml", io::profile_text(camera->view())))->view().lens_model,
            std::uint32_t{TOFGRAPH_LENS_FISHEYE});
}

TEST_F(LensModels, ProjectingIsTheInverseOfTheRays) {
  const io::CameraPtr camera = load(fisheye_profile);
  const physics::Lens lens(camera->view());
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto p =
        physics::image_point(camera->view(), lens, static_cast<double>(i % width), static_cast<double>(i / width));
    if (!p) continue;
    const auto back = physics::pixel_of(camera->view(), lens, *p);
    ASSERT_TRUE(back) << i;
    ASSERT_NEAR(back->x, static_cast<double>(i % width), 1e-8);
    ASSERT_NEAR(back->y, static_cast<double>(i / width), 1e-8);
  }
}

TEST_F(LensModels, ARectifiedFisheyeIsThatOfOpenCv) {
  Harness stage("intrinsics rectify=true");
  stage.camera(write("p.yaml", fisheye_profile));
  std::vector<float> columns, rows;
  for (std::size_t i = 0; i < pixels; ++i) {
    columns.push_back(static_cast<float>(i % width));
    rows.push_back(static_cast<float>(i / width));
  }
  stage.put<float>("amplitude", {height, width}, columns, {.unit = "counts"});
  stage.put<float>("intensity", {height, width}, rows, {.unit = "counts"});
  stage.run();
  EXPECT_EQ(stage.camera_out().lens_model, std::uint32_t{TOFGRAPH_LENS_OPENCV});
  cv::Mat x, y;
  cv::fisheye::initUndistortRectifyMap(matrix, powers, cv::Matx33d::eye(), matrix, {width, height}, CV_32FC1, x, y);
  const auto u = stage.get<float>("amplitude"), v = stage.get<float>("intensity");
  std::size_t inside = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const int r = static_cast<int>(i / width), c = static_cast<int>(i % width);
    if (std::isnan(u[i])) continue;
    ++inside;
    ASSERT_NEAR(u[i], x.at<float>(r, c), 1e-3) << i;
    ASSERT_NEAR(v[i], y.at<float>(r, c), 1e-3) << i;
  }
  EXPECT_EQ(inside, pixels) << "a pinhole of the same focal length sees less than the fisheye";
}

TEST_F(LensModels, IntrinsicsMakesAFisheyeOfAnyCamera) {
  Harness stage(
      "intrinsics lens=fisheye fx='40 px' fy='40.5 px' cx='47.2 px' cy='39.1 px' k1=-0.03 k2=0.011 k3=-0.004 "
      "k4=0.0006");
  stage.camera(write("q.yaml", head + "focal_length: [100 px, 100 px]\nprincipal_point: [0, 0]\ndistortion: [1]\n"));
  stage.run();
  const io::CameraPtr expected = load(fisheye_profile);
  const auto rays = stage.get<float>("rays");
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const float other = expected->view().rays[i];
    ASSERT_TRUE(rays[i] == other || (std::isnan(rays[i]) && std::isnan(other))) << i;
  }
  EXPECT_THAT(message_of([&] {
                Harness wrong("intrinsics lens=fisheye p1=0.1");
                wrong.camera((folder_.path() / "q.yaml").string());
                wrong.prepare();
              }),
              HasSubstr("is not part of a fisheye"));
}

/// The same rays in every form that a table may have.
TEST_F(LensModels, TablesHoldTheRaysInAnyForm) {
  const io::CameraPtr lens = load(fisheye_profile);
  std::vector<double> directions, tangents, degrees;
  std::string csv = "x, y, z\n";
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* ray = lens->view().rays + 3 * i;
    for (int k = 0; k < 3; ++k) directions.push_back(2.5 * double{ray[k]});  // any length
    for (int k = 0; k < 2; ++k) {
      tangents.push_back(double{ray[k]} / double{ray[2]});
      degrees.push_back(std::atan(tangents.back()) * 180 / M_PI);
    }
    csv += std::to_string(directions[3 * i]) + "," + std::to_string(directions[3 * i + 1]) + "," +
           std::to_string(directions[3 * i + 2]) + "\n";
  }
  write_npy("directions.npy", directions, "(80, 96, 3)");
  write_npy("tangents.npy", tangents, "(80, 96, 2)");
  write_npy("degrees.npy", degrees, "(7680, 2)");
  write("rays.csv", csv);
  const hid_t h5 = H5Fcreate((folder_.path() / "rays.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hsize_t extent[] = {height, width, 3};
  const hid_t space = H5Screate_simple(3, extent, nullptr);
  const hid_t data = H5Dcreate2(h5, "vectors", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, directions.data());
  H5Dclose(data);
  H5Sclose(space);
  H5Fclose(h5);
  for (const auto& [line, tolerance] : {std::pair{"directions.npy", 1e-7},
                                        {"{file: tangents.npy, as: tangents}", 1e-7},
                                        {"{file: degrees.npy, as: degrees}", 1e-7},
                                        {"{file: rays.h5, dataset: vectors}", 1e-7},
                                        {"rays.csv", 2e-6}}) {
    const io::CameraPtr table = load(head + "rays: " + line + "\n");
    EXPECT_EQ(table->view().lens_model, std::uint32_t{TOFGRAPH_LENS_RAYS});
    for (std::size_t i = 0; i < 3 * pixels; ++i) {
      const float expected = lens->view().rays[i], found = table->view().rays[i];
      ASSERT_TRUE(std::abs(expected - found) < tolerance || (std::isnan(expected) && std::isnan(found))) << line << i;
    }
  }
}

/// A lens with little distortion as a table: image points between pixels, projection and rectification agree with it.
TEST_F(LensModels, ATableIsUsedLikeTheLensItWasMadeFrom) {
  const std::string profile = head +
                              "focal_length: [90 px, 91 px]\nprincipal_point: [46, 41]\n"
                              "distortion: [-0.2, 0.05, 0.001, -0.001, 0]\n";
  const io::CameraPtr lens = load(profile);
  std::vector<double> directions(lens->view().rays, lens->view().rays + 3 * pixels);
  std::fill_n(directions.begin(), 3 * 5, 0.0);  // five pixels have no ray
  write_npy("rays.npy", directions, "(80, 96, 3)");
  const io::CameraPtr table = load(head + "rays: rays.npy\n");
  const physics::Lens model(lens->view()), none(table->view());
  for (double v = 1.3; v < 78; v += 3.1) {
    for (double u = 7.2; u < 94; u += 2.9) {
      const auto expected = physics::image_point(lens->view(), model, u, v),
                 found = physics::image_point(table->view(), none, u, v);
      ASSERT_TRUE(expected && found);
      ASSERT_NEAR(found->x, expected->x, 2e-5);
      ASSERT_NEAR(found->y, expected->y, 2e-5);
      const auto back = physics::pixel_of(table->view(), none, *found);
      ASSERT_TRUE(back);
      ASSERT_NEAR(back->x, u, 1e-6);
      ASSERT_NEAR(back->y, v, 1e-6);
    }
  }
  Harness cloud("point_cloud");
  cloud.camera((folder_.path() / "p.yaml").string());
  cloud.put<float>("range", {height, width}, std::vector<float>(pixels, 2));
  cloud.run();
  ASSERT_FALSE(cloud.messages().empty());
  EXPECT_THAT(cloud.messages()[0], HasSubstr("5 of 7680 pixels have no ray"));
  EXPECT_EQ(cloud.get<std::uint16_t>("flags")[4], 1 | 64);
  EXPECT_EQ(cloud.get<std::uint16_t>("flags")[5], 0);
  Harness rectified("intrinsics rectify=true");
  rectified.camera((folder_.path() / "p.yaml").string());
  std::vector<float> columns;
  for (std::size_t i = 0; i < pixels; ++i) columns.push_back(static_cast<float>(i % width));
  rectified.put<float>("amplitude", {height, width}, columns, {.unit = "counts"});
  rectified.run();
  const auto u = rectified.get<float>("amplitude");
  const tofgraph_camera& pinhole = rectified.camera_out();
  std::size_t compared = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto p = physics::image_point(pinhole, physics::Lens(pinhole), static_cast<double>(i % width),
                                        static_cast<double>(i / width));
    const auto expected = physics::pixel_of(lens->view(), model, *p);
    if (std::isnan(u[i]) || !expected) continue;
    ++compared;
    ASSERT_NEAR(u[i], expected->x, 5e-3) << i;
  }
  EXPECT_GT(compared, pixels * 8 / 10);
}

TEST_F(LensModels, TablesThatCannotBeRaysAreRefused) {
  write_npy("two.npy", std::vector<double>(2 * pixels, 0.1), "(80, 96, 2)");
  write_npy("small.npy", std::vector<double>(3 * 60, 1), "(10, 6, 3)");
  write_npy("same.npy", std::vector<double>(3 * pixels, -1), "(80, 96, 3)");
  std::vector<double> mirrored;
  for (std::size_t i = 0; i < pixels; ++i)
    mirrored.insert(mirrored.end(), {-0.01 * static_cast<double>(i % width), 0.01 * static_cast<double>(i / width), 1});
  write_npy("mirrored.npy", mirrored, "(80, 96, 3)");
  EXPECT_THAT(refused(head + "rays: two.npy\n"), HasSubstr("as: tangents"));
  EXPECT_THAT(refused(head + "rays: small.npy\n"), HasSubstr("has 10 x 6 x 3 numbers, expected 80 x 96 x 3"));
  EXPECT_THAT(refused(head + "rays: same.npy\n"), HasSubstr("has no ray"));
  EXPECT_THAT(refused(head + "rays: mirrored.npy\n"), HasSubstr("x does not grow with the columns"));
  EXPECT_THAT(refused(head + "rays: absent.npy\n"), HasSubstr("there is no table of rays"));
  EXPECT_THAT(refused(head + "rays: same.npy\nfocal_length: [9 px, 9 px]\n"), HasSubstr("'focal_length' is contained"));
  EXPECT_THAT(refused(fisheye_profile + "skew: 0.1\nlense: x\n"), HasSubstr("'lense'"));
  EXPECT_THAT(refused(head + "focal_length: [9 px, 9 px]\nprincipal_point: [1, 1]\nlens: fisheye\n"
                             "distortion: [1, 2, 3, 4, 5]\n"),
              HasSubstr("at most four numbers"));
}

TEST_F(LensModels, AFieldOfViewIsALastResortWithAWarning) {
  config::Diagnostics diagnostics;
  const io::CameraPtr camera =
      io::load_profile(write("p.yaml", head + "field_of_view: [100 deg, 80 deg]\n"), diagnostics);
  ASSERT_TRUE(camera);
  EXPECT_NEAR(camera->view().focal_px[0], 48 / std::tan(50 * M_PI / 180), 1e-9);
  EXPECT_NEAR(camera->view().focal_px[1], 40 / std::tan(40 * M_PI / 180), 1e-9);
  EXPECT_EQ(camera->view().principal_point[0], 47.5);
  ASSERT_EQ(diagnostics.all().size(), 1U);
  EXPECT_THAT(diagnostics.all()[0].message, HasSubstr("is all that is known of the lens"));
  const io::CameraPtr fisheye =
      io::load_profile(write("f.yaml", head + "lens: fisheye\nfield_of_view: [130 deg, 100 deg]\n"), diagnostics);
  ASSERT_TRUE(fisheye);
  EXPECT_NEAR(fisheye->view().focal_px[0], 48 / (65 * M_PI / 180), 1e-9) << "radius = focal length x angle";
  EXPECT_NEAR(fisheye->view().focal_px[1], 40 / (50 * M_PI / 180), 1e-9);
}

/// The table is stored with a recording: the profile inside names it by its absolute path.
TEST_F(LensModels, ARecordingFindsItsTable) {
  const io::CameraPtr lens = load(fisheye_profile);
  write_npy("rays.npy", {lens->view().rays, lens->view().rays + 3 * pixels}, "(80, 96, 3)");
  write("wide.yaml", head + "rays: rays.npy\n");
  write_npy("depth.npy", std::vector<double>(pixels, 1.5), "(80, 96)");
  const auto outcome = tests::shell(
      "$TOFGRAPH convert depth.npy -o depth.h5 --camera ./wide.yaml --as range --unit m && mkdir other && cd other && "
      "$TOFGRAPH run \"capture_reader file=../depth.h5 ! point_cloud ! pcd_writer path=cloud.pcd\"",
      folder_.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

}  // namespace
}  // namespace tofgraph
