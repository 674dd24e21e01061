// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: io cli
// Camera files of other programs converted to profiles. OpenCV writes its own; the others use the vendors' layouts.
#include <gmock/gmock.h>

#include "io/profile.hpp"
#include "tests/program.hpp"

#include <opencv2/core.hpp>

using namespace tofgraph::tests;
using testing::HasSubstr;

namespace {

class ConvertCamera : public testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  Outcome convert(const std::string& arguments) const {
    return shell("$TOFGRAPH convert " + arguments + " -o out.yaml --force", folder_.path());
  }
  tofgraph::io::CameraPtr converted(const std::string& arguments) const {
    const Outcome outcome = convert(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.exit_code == 0 ? tofgraph::io::load_profile(path("out.yaml")) : nullptr;
  }
  std::string refused(const std::string& name, const std::string& content, const std::string& more = "") const {
    write_text(path(name), content);
    const Outcome outcome = convert(name + more);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    return outcome.err;
  }

 private:
  TemporaryFolder folder_;
};

void expect_lens(const tofgraph_camera& c, std::array<double, 6> size_and_matrix,
                 const std::vector<double>& distortion) {
  EXPECT_EQ(c.width, size_and_matrix[0]);
  EXPECT_EQ(c.height, size_and_matrix[1]);
  EXPECT_DOUBLE_EQ(c.focal_px[0], size_and_matrix[2]);
  EXPECT_DOUBLE_EQ(c.focal_px[1], size_and_matrix[3]);
  EXPECT_DOUBLE_EQ(c.principal_point[0], size_and_matrix[4]);
  EXPECT_DOUBLE_EQ(c.principal_point[1], size_and_matrix[5]);
  std::vector<double> found = tofgraph::io::distortion_of(c);
  found.resize(12);
  for (std::size_t i = 0; i < distortion.size(); ++i) EXPECT_DOUBLE_EQ(found[i], distortion[i]) << i;
}

TEST_F(ConvertCamera, FilesThatOpenCvWrote) {
  const cv::Matx33d k(208.5, 0, 112.25, 0, 208.4, 84.125, 0, 0, 1);
  const std::vector<double> d = {-0.28, 0.09, 0.001, -0.0008, 0.01, 0.1, 0.2, 0.3};
  for (const std::string name : {"opencv.yaml", "opencv.json"}) {
    {
      cv::FileStorage file(path(name).string(), cv::FileStorage::WRITE);
      file << "image_width" << 224 << "image_height" << 172 << "camera_matrix" << cv::Mat(k)
           << "distortion_coefficients" << cv::Mat(d).reshape(1, 1);
    }
    const auto camera = converted(name);
    ASSERT_TRUE(camera) << name;
    expect_lens(camera->view(), {224, 172, 208.5, 208.4, 112.25, 84.125}, d);
  }
}

TEST_F(ConvertCamera, RosRealSenseAndMrcal) {
  write_text(
      path("ros.yaml"),
      "image_width: 640\nimage_height: 480\ncamera_name: tof_front\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: "
      "[430.15, 0.0, 306.69, 0.0, 430.53, 227.22, 0.0, 0.0, 1.0]\ndistortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.3375, 0.1117, -0.000574, 0.000117, 0.0]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n");
  const auto ros = converted("ros.yaml");
  ASSERT_TRUE(ros);
  EXPECT_STREQ(ros->view().name, "tof_front");
  expect_lens(ros->view(), {640, 480, 430.15, 430.53, 306.69, 227.22}, {-0.3375, 0.1117, -0.000574, 0.000117, 0});
  write_text(path("rs.json"),
             "{\"depth\": {\"width\":1024,\"height\":768,\"ppx\":514.5,\"ppy\":389.25,\"fx\":732.1,\"fy\":731.9,"
             "\"model\":\"Brown Conrady\",\"coeffs\":[0.1,-0.2,0.001,0.002,0.05]}}");
  const auto realsense = converted("rs.json");
  ASSERT_TRUE(realsense);
  expect_lens(realsense->view(), {1024, 768, 732.1, 731.9, 514.5, 389.25}, {0.1, -0.2, 0.001, 0.002, 0.05});
  write_text(
      path("camera-0.cameramodel"),
      "# generated on 2026-05-05\n{\n    'lensmodel': 'LENSMODEL_OPENCV8',\n\n    # intrinsics are fx,fy,cx,cy,k0,..\n"
      "    'intrinsics': [ 1761.2, 1761.3, 1965.7, 1087.5, -0.012, 0.035, -0.001, 0.002, 0.019, 0.014, -0.056, "
      "0.050,],\n    'extrinsics': [ 0., 0., 0., 0., 0., 0.,],\n    'imagersize': [ 4000, 2200,]\n}\n");
  const auto mrcal = converted("camera-0.cameramodel");
  ASSERT_TRUE(mrcal);
  expect_lens(mrcal->view(), {4000, 2200, 1761.2, 1761.3, 1965.7, 1087.5},
              {-0.012, 0.035, -0.001, 0.002, 0.019, 0.014, -0.056, 0.050});
}

/// A published calibration, and the result of the vendor's library for the mode of 640 x 576 px.
constexpr const char* azure = R"({"CalibrationInformation":{"Cameras":[
 {"Purpose":"CALIBRATION_CameraPurposePhotoVideo","Intrinsics":{"ModelParameters":[0.5,0.5,0.5,0.5]}},
 {"Intrinsics":{"ModelParameterCount":14,"ModelParameters":[0.5122697949409485,0.49451231956481934,0.4921168386936188,
  0.4921667277812958,3.1305770874023438,2.324939012527466,0.1304156482219696,3.458651542663574,3.350114583969116,
  0.6629416346549988,0,0,-0.0000511557373101823,0.00008132171933539212],
  "ModelType":"CALIBRATION_LensDistortionModelBrownConrady"},"Purpose":"CALIBRATION_CameraPurposeDepth",
  "SensorHeight":1024,"SensorWidth":1024}]}})";

TEST_F(ConvertCamera, AzureKinectNeedsItsDepthMode) {
  const std::string all = refused("azure.json", azure);
  EXPECT_THAT(all, HasSubstr("nothing states its depth mode"));
  EXPECT_THAT(all, HasSubstr("--depth-mode nfov         640 x 576 px"));
  const auto camera = converted("azure.json --depth-mode nfov");
  ASSERT_TRUE(camera);
  const tofgraph_camera& c = camera->view();
  EXPECT_EQ(c.width, 640U);
  EXPECT_EQ(c.height, 576U);
  EXPECT_NEAR(c.principal_point[0], 332.064270, 1e-4);
  EXPECT_NEAR(c.principal_point[1], 325.880615, 1e-4);
  EXPECT_NEAR(c.focal_px[0], 503.927643, 1e-4);
  EXPECT_NEAR(c.focal_px[1], 503.978729, 1e-4);
  const std::vector<double> d = tofgraph::io::distortion_of(c);
  const double expected[] = {3.130577, 2.324939, 0.000081, -0.000051, 0.130416, 3.458652, 3.350115, 0.662942};
  for (std::size_t i = 0; i < 8; ++i) EXPECT_NEAR(d[i], expected[i], 1e-6) << i;
}

TEST_F(ConvertCamera, OpenCvsTiltIsLeftOutWhereItIsZeroAndRefusedElsewhere) {
  const std::string head =
      "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: {data: [80, 0, 31, 0, 80, 24, 0, 0, 1]}\n";
  const std::string twelve = "0.1, 0.2, 0.001, 0.002, 0.3, 0.4, 0.5, 0.6, 0.01, 0.02, 0.03, 0.04";
  write_text(path("flat.yml"), head + "distortion_coefficients: {data: [" + twelve + ", 0, 0]}\n");
  const auto camera = converted("flat.yml");
  ASSERT_TRUE(camera);
  EXPECT_EQ(tofgraph::io::distortion_of(camera->view()),
            (std::vector<double>{0.1, 0.2, 0.001, 0.002, 0.3, 0.4, 0.5, 0.6, 0.01, 0.02, 0.03, 0.04}));
  EXPECT_THAT(refused("tilted.yml", head + "distortion_coefficients: {data: [" + twelve + ", 0.01, 0]}\n"),
              HasSubstr("14 coefficients of the lens: expected"));
}

TEST_F(ConvertCamera, FisheyesOfRosAndLibrealsense) {
  const std::string ros =
      "image_width: 848\nimage_height: 800\ncamera_name: wide\ndistortion_model: equidistant\n"
      "camera_matrix: {rows: 3, cols: 3, data: [286.1, 0, 421.2, 0, 286.3, 398.5, 0, 0, 1]}\n"
      "distortion_coefficients: {rows: 1, cols: 4, data: [-0.0087, 0.046, -0.0435, 0.0081]}\n";
  const std::string realsense =
      "{\"width\":848,\"height\":800,\"ppx\":421.2,\"ppy\":398.5,\"fx\":286.1,\"fy\":286.3,"
      "\"model\":\"Kannala Brandt4\",\"coeffs\":[-0.0087,0.046,-0.0435,0.0081,0]}";
  const std::string opencv =  // as written by its calibration program
      "%YAML:1.0\n---\nimage_width: 848\nimage_height: 800\nfisheye_model: 1\n"
      "camera_matrix: {rows: 3, cols: 3, dt: d, data: [286.1, 0, 421.2, 0, 286.3, 398.5, 0, 0, 1]}\n"
      "distortion_coefficients: {rows: 4, cols: 1, dt: d, data: [-0.0087, 0.046, -0.0435, 0.0081]}\n";
  for (const auto& [name, text] : {std::pair{"ros.yaml", ros}, {"realsense.json", realsense}, {"opencv.yml", opencv}}) {
    write_text(path(name), text);
    const auto camera = converted(name);
    ASSERT_TRUE(camera) << name;
    EXPECT_EQ(camera->view().lens_model, std::uint32_t{TOFGRAPH_LENS_FISHEYE}) << name;
    EXPECT_EQ(tofgraph::io::distortion_of(camera->view()), (std::vector<double>{-0.0087, 0.046, -0.0435, 0.0081}));
  }
}

TEST_F(ConvertCamera, WhatAProfileCannotHoldIsRefused) {
  EXPECT_THAT(refused("x.yaml", "a: 1\n"), HasSubstr("is not a camera file of a known kind"));
  EXPECT_THAT(refused("fish.yaml",
                      "image_width: 8\nimage_height: 6\ndistortion_model: fov\ncamera_matrix: {data: [4, 0, 4, 0, "
                      "4, 3, 0, 0, 1]}\n"),
              HasSubstr("fish.yaml:3:19: error: the file has the lens model 'fov'"));
  EXPECT_THAT(
      refused("inverse.json",
              "{\"width\":8,\"height\":6,\"ppx\":4,\"ppy\":3,\"fx\":4,\"fy\":4,\"model\":\"Inverse Brown Conrady\","
              "\"coeffs\":[0.1,0,0,0,0]}"),
      HasSubstr("maps the other way round"));
  EXPECT_THAT(
      refused("short.cameramodel", "{'lensmodel': 'LENSMODEL_OPENCV5', 'intrinsics': [1, 1, 2], 'imagersize': [8, 6]}"),
      HasSubstr("has 3 intrinsics, expected 9"));
  EXPECT_THAT(refused("nan.json", "{\"width\":8.5,\"height\":6,\"ppx\":4,\"ppy\":3,\"fx\":4,\"fy\":4}"),
              HasSubstr("8.5 x 6 px"));
  EXPECT_THAT(refused("text.json", "{\"width\":\"wide\",\"height\":6,\"ppx\":4,\"ppy\":3,\"fx\":4,\"fy\":4}"),
              HasSubstr("where a number is expected"));
}

}  // namespace
