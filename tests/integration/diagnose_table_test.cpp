// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: DiagnoseTable.AnEffect*:DiagnoseTable.PixelsOutside*:DiagnoseTable.AllThatWasPublished*
// Rooms: diagnosis
// `tofgraph diagnose` on tables of means: one number per condition, in which everything unexplained looks like
// scatter.
#include "tests/program.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

class DiagnoseTable : public testing::Test {
 protected:
  /// Fourteen boards from 0.7 to 6.3 m, 0.3 mm of noise on their means. @param column of the campaign: a depth, or a
  /// half path @param amplitude of a wave with four periods in the unambiguous range, mm
  void make(const std::string& camera, const std::string& column, double amplitude) {
    std::mt19937_64 random(5);
    std::normal_distribution<double> noise(0, 0.3);
    std::string rows = "z,d,t\n";
    for (int i = 0; i < 14; ++i) {
      const double z = 700 + i * 6000 / 14.0;
      const double d = z + amplitude * std::sin(8 * M_PI * z / 7494.8 + 0.4) + noise(random);
      rows += fmt::format("{:.3f},{:.3f},2\n", z, d);
    }
    write_text(folder_.path() / "means.csv", rows);
    write_text(folder_.path() / "model.yaml", "model: 1\ncamera: " + camera + "\nlight: reference\neffects: []\n");
    write_text(folder_.path() / "campaign.yaml", "campaign: 1\ncamera: " + camera +
                                                     "\ntable:\n  file: means.csv\n  distance: {column: z, unit: mm}\n"
                                                     "  integration_time: {column: t, unit: ms}\n  " +
                                                     column + ": {column: d, unit: mm}\n");
  }
  nlohmann::json diagnose(const std::string& options = "") {
    const Outcome outcome =
        shell("$TOFGRAPH diagnose --quiet --force --model model.yaml --data campaign.yaml --out found " + options,
              folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(read_text(folder_.path() / "found/report.json"));
  }
  void expect_wiggling(double amplitude) {
    const nlohmann::json said = diagnose();
    ASSERT_EQ(said["effects"].size(), 1U) << said.dump(1);
    EXPECT_EQ(said["effects"][0]["name"], "wiggling");
    EXPECT_NEAR(said["effects"][0]["parameters"]["amplitude"]["value"].get<double>(), amplitude, 4e-4);
    EXPECT_LT(said["gap"]["held_out_after"].get<double>(), 0.2 * said["gap"]["held_out_before"].get<double>());
  }

  TemporaryFolder folder_;
};

TEST_F(DiagnoseTable, AnEffectIsNotHiddenByTheScatterThatItMakes) {
  make("camcube2", "corrected_with: optimized_bistatic\n  measured_depth", 5);
  expect_wiggling(5e-3);
}

TEST_F(DiagnoseTable, TheSpreadIsFittedToSearchedConditionsOnly) {
  make("camcube2", "corrected_with: optimized_bistatic\n  measured_depth_sd: {column: t, unit: mm}\n  measured_depth",
       5);
  EXPECT_EQ(diagnose()["pixel_spread"]["rows"], 14);
  EXPECT_EQ(diagnose("--max-conditions 12")["pixel_spread"]["rows"], 12);
}

TEST_F(DiagnoseTable, NothingIsNamedWhereThereIsNoiseAlone) {
  make("camcube2", "corrected_with: optimized_bistatic\n  measured_depth", 0);
  const nlohmann::json said = diagnose();
  EXPECT_EQ(said["verdict"], "nothing_found");
  // Without repetitions the noise is unknown, which is no evidence of agreement.
  EXPECT_NE(said["summary"].get<std::string>().find("nothing was measured twice"), std::string::npos)
      << said["summary"];
}

/// A stated jitter is a prior: the estimate lies between its scale and the scatter of the data.
TEST_F(DiagnoseTable, AStatedJitterIsUsed) {
  make("camcube2", "corrected_with: optimized_bistatic\n  measured_depth", 0);
  const double unstated = diagnose()["nuisances"]["board_jitter"]["value"];
  write_text(folder_.path() / "campaign.yaml", read_text(folder_.path() / "campaign.yaml") + "jitter: 0.02 mm\n");
  fs::remove_all(folder_.path() / "found");
  const nlohmann::json stated = diagnose();
  EXPECT_LT(stated["nuisances"]["board_jitter"]["value"].get<double>(), 0.8 * unstated);
  EXPECT_THAT(stated["notes"].get<std::vector<std::string>>(),
              testing::Contains(testing::HasSubstr("more than the jitter of 20 um that the campaign states")));
}

/// Corners outside the lens model: a mean over the image is that of the other pixels. Half paths are longer than the
/// board distances by an amount that depends on all pixels, so only the presence of a number is tested.
TEST_F(DiagnoseTable, PixelsOutsideTheLensAreLeftOutOfTheMeans) {
  std::string profile = read_text(TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml");
  profile.replace(profile.find("[0, 0, 0, 0, 0]"), 15, "[-1.01, 0, 0, 0, 0]");
  write_text(folder_.path() / "bent.yaml", profile);
  make(folder_.path().string() + "/bent.yaml", "measured_distance", 40);
  const nlohmann::json said = diagnose();
  ASSERT_TRUE(said["gap"]["before"].is_number()) << said["gap"];
  EXPECT_GT(said["gap"]["before"].get<double>(), 20e-3);
  EXPECT_NE(said["verdict"], "nothing_found");
}

/// Tables 3.1, 5.1 to 5.3, 6.2 to 6.13 and 6.14 of the reference in one search. The reference values of the pixel
/// spread are fitted by tests/published_spread.py, an independent program that fits its own reflectivities.
TEST_F(DiagnoseTable, AllThatWasPublishedOfACamera) {
  const std::string campaigns = TOFGRAPH_SOURCE_DIR "/pipelines/campaigns/";
  const Outcome outcome = shell("$TOFGRAPH diagnose --quiet --model " + campaigns + "thesis_model.yaml --data " +
                                    campaigns + "published_evidence.yaml --out found",
                                folder_.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json said = nlohmann::json::parse(read_text(folder_.path() / "found/report.json"));
  std::vector<std::string> names, inputs, sessions;
  for (const auto& effect : said["effects"]) names.push_back(effect["name"]);
  for (const auto& input : said["inputs"]) inputs.push_back(fs::path(input["file"].get<std::string>()).filename());
  for (const auto& fold : said["folds"])
    if (fold["setting"] == "session") sessions.push_back(fold["levels"]);
  EXPECT_THAT(names,
              testing::UnorderedElementsAre("crosstalk", "integration_time_offset", "wiggling", "phase_step_error"))
      << "15 mm between single lamps are within what boards scatter by: neither source_phase nor source_position";
  for (const char* file : {"published_rmse.yaml", "published_single_sources.yaml", "published_single_sources.csv",
                           "published_warm_up.yaml", "thesis_offset_tables.csv"})
    EXPECT_THAT(inputs, testing::Contains(file));
  EXPECT_THAT(sessions, testing::UnorderedElementsAre("published_single_sources", "published_warm_up"))
      << "84 of 90 boards are not put aside";
  EXPECT_LT(said["gap"]["held_out_after"].get<double>(), 0.5 * said["gap"]["held_out_before"].get<double>());

  const auto& spread = said["pixel_spread"];
  EXPECT_EQ(spread["rows"], 84 + 30 + 3);
  std::map<std::string, double> laws;
  for (const auto& law : spread["laws"]) laws[law["name"]] = law["value"];
  ASSERT_EQ(laws.size(), 2U) << spread;
  EXPECT_NEAR(laws["pattern"], 4.04e-3, 0.6e-3);
  EXPECT_NEAR(laws["inside"] * 0.85 / 0.5, 110, 20) << "white is taken as 0.5 here, as 0.85 there";
  EXPECT_GT(spread["within_25_percent"].get<double>(), 0.85);
  EXPECT_GT(spread["held_out_within_25_percent"].get<double>(), 0.7);
  EXPECT_EQ(spread["residual"]["level"], "5.5 m");
}

}  // namespace
}  // namespace tofgraph::tests
