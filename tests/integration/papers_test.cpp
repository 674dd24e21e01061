// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The correction pipelines: three paper targets, before and after.
#include "tests/program.hpp"

#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

class Papers : public testing::Test {
 protected:
  Papers() {
    for (const char* part : {"pipelines", "devices"})
      fs::copy(fs::path(TOFGRAPH_SOURCE_DIR) / part, root.path() / part, fs::copy_options::recursive);
    fs::remove_all(folder / "out");
  }
  Outcome run(const std::string& pipeline) const { return shell("\"$TOFGRAPH\" run " + pipeline, folder); }
  nlohmann::json table(const std::string& file) const {
    return nlohmann::json::parse(read_text(folder / "out" / file))["inputs"];
  }

  TemporaryFolder root;
  fs::path folder = root.path() / "pipelines";
};

// Depths of three paper targets measured by the published camera, and their true distances.
TEST_F(Papers, OffsetCorrectionBringsThreePapersToTheirPlaces) {
  const Outcome outcome = run("offset_correction.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const struct {
    const char* name;
    double measured, real;
  } papers[] = {{"half_black", 1.97379, 2}, {"light_grey", 2.51852, 2.5}, {"white", 3.97449, 4}};
  for (const auto& paper : papers) {
    for (const auto& input : table("offset_correction/" + std::string(paper.name) + ".json")) {
      const double expected = input["name"] == "correct" ? paper.real : paper.measured;
      EXPECT_NEAR(input["mean"].get<double>(), expected, 1e-3) << paper.name << " " << input["name"];
    }
  }
}

/// The same targets, seen by a camera with warm-up, a non-sinusoidal waveform, and crosstalk.
TEST_F(Papers, FullCorrectionBringsThemThereToo) {
  const Outcome outcome = run("full_correction.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::pair<const char*, double> papers[] = {{"half_black", 2}, {"light_grey", 2.5}, {"white", 4}};
  for (const auto& [name, real] : papers) {
    const nlohmann::json inputs = table("full_correction/" + std::string(name) + ".json");
    const double before = inputs[0]["mean"], after = inputs[1]["mean"];
    EXPECT_GT(std::abs(before - real), 5e-3) << name;
    EXPECT_NEAR(after, real, 2e-3) << name << ": the offset looks at the amplitude, in which the leaked light stays";
  }
  EXPECT_TRUE(fs::exists(folder / "out/full_correction/cloud_000001.pcd"));
}

/// From a file, with a calibrated lens replacing the model's.
TEST_F(Papers, FullChainBringsThemThereToo) {
  const Outcome made = shell("\"$TOFGRAPH\" simulate scenes/papers_while_warming.yaml -o out/full_chain.h5", folder);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Outcome outcome = run("full_chain.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  pcl::PointCloud<pcl::PointXYZI> points;
  ASSERT_EQ(pcl::io::loadPCDFile((folder / "out/full_chain/cloud_000001.pcd").string(), points), 0);
  const struct {
    std::uint32_t first, last;  // columns
    double depth;
  } papers[] = {{20, 30, 2}, {96, 108, 2.5}, {165, 185, 4}};
  for (const auto& paper : papers) {
    double sum = 0, count = 0;
    for (std::uint32_t row = 90; row <= 113; ++row)
      for (std::uint32_t column = paper.first; column <= paper.last; ++column, ++count)
        sum += double{points.at(column, row).z};
    EXPECT_NEAR(sum / count, paper.depth - 0.0128, 2e-3);  // points are relative to the lens centre
  }
}

}  // namespace
}  // namespace tofgraph::tests
