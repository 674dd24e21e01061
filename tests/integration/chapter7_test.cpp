// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: plugins
// The shipped denoising experiments of chapter 7 of the reference.
#include "tests/program.hpp"

#include <cmath>
#include <map>
#include <sstream>
#include <vector>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

class Chapter7 : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(folder.path() / "devices");
    for (const char* part : {"pipelines", "devices/calibrations"})
      fs::copy(fs::path(TOFGRAPH_SOURCE_DIR) / part, folder.path() / part, fs::copy_options::recursive);
    fs::remove_all(folder.path() / "pipelines/chapter7/out");
  }
  Outcome run(const std::string& pipeline) const {
    return shell("\"$TOFGRAPH\" run " + pipeline, folder.path() / "pipelines/chapter7");
  }
  fs::path out(const std::string& file) const { return folder.path() / "pipelines/chapter7/out" / file; }

  /// Root mean square error over all frames, m, by node.
  std::map<std::string, double> errors(const std::string& csv) const {
    const auto cells_of = [](const std::string& line) {
      std::vector<std::string> cells;
      std::istringstream row(line);
      for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
      return cells;
    };
    std::istringstream table(read_text(out(csv)));
    std::string line;
    std::getline(table, line);
    const auto header = cells_of(line);
    const auto place = static_cast<std::size_t>(std::ranges::find(header, "rms_m") - header.begin());
    std::map<std::string, double> rms;
    while (std::getline(table, line)) {
      const auto cells = cells_of(line);
      if (cells.at(2) == "all") rms[cells.at(0)] = std::stod(cells.at(place));
    }
    return rms;
  }

  TemporaryFolder folder;
};

TEST_F(Chapter7, GaussianNoiseOf10MillimetresIsReducedInTheOrderOfTheReference) {
  const Outcome outcome = run("gaussian_noise.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto rms = errors("gaussian_noise.csv");
  ASSERT_EQ(rms.size(), 5U);
  EXPECT_LT(rms.at("ideal"), 1e-6);
  // The standard error of the standard deviation of 41616 values of 10 mm is 0.035 mm.
  EXPECT_NEAR(rms.at("noisy"), 10e-3, 4 * 0.035e-3);
  EXPECT_LT(rms.at("yaroslavsky"), 0.5 * rms.at("noisy"));
  EXPECT_LT(rms.at("bilateral"), 0.5 * rms.at("noisy"));
  EXPECT_LT(rms.at("non_local_means"), std::min(rms.at("yaroslavsky"), rms.at("bilateral")));
  for (const char* figure : {"7_1_left", "7_1_right", "7_2_left", "7_2_right", "7_3"})
    EXPECT_TRUE(fs::exists(out("figure_" + std::string(figure) + "_0.png"))) << figure;
}

TEST_F(Chapter7, TheBoxBeforeTheWallIsCorrectedAndDenoised) {
  const Outcome outcome = run("box_before_wall.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto rms = errors("box_before_wall.csv");
  EXPECT_LT(rms.at("corrected"), rms.at("uncorrected"));
  for (const char* filter : {"yaroslavsky", "bilateral", "non_local_means"})
    EXPECT_LT(rms.at(filter), rms.at("corrected")) << filter;
  EXPECT_LT(rms.at("non_local_means"), std::min(rms.at("yaroslavsky"), rms.at("bilateral")));
  for (const char* figure : {"5_left", "5_right", "6_left", "6_right", "7", "8_left", "8_right", "9_left", "9_right",
                             "10", "11_left", "11_right", "12_left", "12_right", "13"})
    EXPECT_TRUE(fs::exists(out("figure_7_" + std::string(figure) + "_0.png"))) << figure;
}

}  // namespace
}  // namespace tofgraph::tests
