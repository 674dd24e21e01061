// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Points in frames whose coordinates exceed float32 precision: the loss is reported, a shift avoids it.
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tests/program.hpp"

namespace tofgraph {
namespace {

const std::vector<float> two_points = {0.1F, 0.2F, 1.5F, 0.1234F, 0.2F, 1.5F};

std::vector<std::string> messages(const std::string& line) {
  Harness stage(line);
  stage.put<float>("points", {1, 2, 3}, two_points);
  stage.run();
  return stage.messages();
}

TEST(LargeCoordinates, AreReportedWithTheirStepsAndAShift) {
  const auto utm = messages("transform translation=['500000 m', '5400000.4 m', '120 m']");
  ASSERT_EQ(utm.size(), 1U);
  EXPECT_NE(utm[0].find("x in steps of 31.2 mm, y in steps of 500 mm"), std::string::npos) << utm[0];
  EXPECT_NE(utm[0].find("shift: [500000 m, 5400000 m, 0 m]"), std::string::npos) << utm[0];
  EXPECT_EQ(messages("transform translation=['-20000 m', '0 m', '0 m']").size(), 1U);
  EXPECT_TRUE(messages("transform translation=['1000 m', '500 m', '120 m']").empty());
  EXPECT_TRUE(messages("transform translation=['500000 m', '5400000.4 m', '120 m'] "
                       "shift=['500000 m', '5400000 m', '0 m']")
                  .empty());
}

TEST(LargeCoordinates, KeepTheirDigitsWithAShift) {
  Harness stage("transform translation=['500000.25 m', '5400000.4 m', '120 m'] shift=['500000 m', '5400000 m', '0 m']");
  stage.put<float>("points", {1, 2, 3}, two_points);
  stage.run();
  const auto moved = stage.get<float>("points");
  EXPECT_NEAR(moved[0], 0.35, 1e-6);
  EXPECT_NEAR(moved[3], 0.3734, 1e-6);
  EXPECT_NEAR(moved[1], 0.6, 1e-6);
  EXPECT_NEAR(moved[2], 121.5, 1e-5);
}

TEST(LargeCoordinates, TheViewpointOfAPcdHasAllItsDigits) {
  const tests::TemporaryFolder folder;
  for (const std::string encoding : {"ascii", "binary", "binary_compressed"}) {
    Harness stage("pcd_writer overwrite=true encoding=" + encoding + " path='" + (folder.path() / "a.pcd").string() +
                  "' viewpoint=[500000.125, 5400000.4, 120.0625, 0.70710678, 0.70710678, 0, 0]");
    stage.put<float>("points", {1, 2, 3}, two_points);
    stage.run();
    std::istringstream file(tests::read_text(folder.path() / "a_000000.pcd"));
    std::string line;
    while (std::getline(file, line) && !line.starts_with("VIEWPOINT")) {
    }
    EXPECT_EQ(line, "VIEWPOINT 500000.125 5400000.4 120.0625 0.70710678 0.70710678 0 0") << encoding;
  }
}

TEST(LargeCoordinates, AsciiCloudsHoldNineDigits) {
  const tests::TemporaryFolder folder;
  const std::vector<float> far = {512345.66F, 5412345.5F, 123.456787F};
  for (const std::string sink : {"pcd", "ply"}) {
    const std::string pose = sink == "pcd" ? " viewpoint=[0, 0, 0, 1, 0, 0, 0]" : "";
    Harness stage(sink + "_writer encoding=ascii path='" + (folder.path() / ("a." + sink)).string() + "'" + pose);
    stage.put<float>("points", {1, 1, 3}, far, {.unit = "m", .applied = "point_cloud transform T_world_camera"});
    stage.run();
    const std::string text = tests::read_text(folder.path() / ("a_000000." + sink));
    const std::size_t data = text.find(sink == "pcd" ? "DATA ascii\n" : "end_header\n") + 11;
    std::istringstream numbers(text.substr(data));
    for (const float expected : far) {
      double value = 0;
      numbers >> value;
      EXPECT_EQ(static_cast<float>(value), expected) << sink;
    }
  }
}

}  // namespace
}  // namespace tofgraph
