// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Compared with Eigen's geometry.
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>

namespace tofgraph {
namespace {

std::string said(const std::string& line) {
  try {
    Harness stage(line);
    stage.put<float>("points", {1, 1, 3}, {1, 2, 3});
    stage.run();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(Transform, ByAnglesAgreesWithEigen) {
  Harness stage("transform angles=['10 deg', '-20 deg', '130 deg'] translation=['1 m', '-500 mm', '2 m']");
  const std::vector<float> points = {0.1F, 0.2F, 1.5F, -0.7F, 0.3F, 4.0F, NAN, NAN, NAN};
  stage.put<float>("points", {1, 3, 3}, points);
  stage.run();
  const auto moved = stage.get<float>("points");
  const double degree = M_PI / 180;
  const Eigen::Matrix3d r = (Eigen::AngleAxisd(130 * degree, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(-20 * degree, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(10 * degree, Eigen::Vector3d::UnitX()))
                                .toRotationMatrix();
  for (std::size_t i = 0; i < 2; ++i) {
    const Eigen::Vector3d expected =
        r * Eigen::Vector3d(points[3 * i], points[3 * i + 1], points[3 * i + 2]) + Eigen::Vector3d(1, -0.5, 2);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(moved[3 * i + k], expected[static_cast<Eigen::Index>(k)], 3e-7);
  }
  EXPECT_TRUE(std::isnan(moved[6]) && std::isnan(moved[7]) && std::isnan(moved[8]));
}

TEST(Transform, RefusesWhatIsNoRotation) {
  EXPECT_NE(said("transform rotation=[1, 0, 0, 0, 1, 0, 0, 0, 2]").find("is not a rotation"), std::string::npos);
  EXPECT_NE(said("transform rotation=[1, 0, 0, 0, 1, 0, 0, 0, -1]").find("is a reflection"), std::string::npos);
  EXPECT_NE(said("transform rotation=[1, 0, 0]").find("expected nine"), std::string::npos);
  EXPECT_NE(said("transform translation=['1 m']").find("expected "), std::string::npos);
  EXPECT_NE(said("transform translation=[1, 2, 3]").find("has no unit"), std::string::npos);
  EXPECT_EQ(said("transform rotation=[0, -1, 0, 1, 0, 0, 0, 0, 1]"), "");
}

}  // namespace
}  // namespace tofgraph
