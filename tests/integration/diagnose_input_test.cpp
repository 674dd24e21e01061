// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: */PixelsOutsideTheLens.*:DiagnoseInput.ABoardWithASize*
// Rooms: diagnosis cli simulation
// `tofgraph diagnose` with realistic laboratory data: errors in the campaign, boards of finite size, pixels outside the
// lens model, recordings without samples.
#include "tests/program.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::tests {
namespace {

const std::string conditions = "0.7 m, 1.1 m, 1.6 m, 2 m, 2.3 m, 2.9 m, 3.3 m, 3.8 m";

class DiagnoseInput : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) { write_text(folder_.path() / name, text); }
  std::string campaign() const { return read_text(folder_.path() / "data/campaign.yaml"); }
  /// Replaces the first occurrence of a text in the campaign's condition with this number.
  void change(std::size_t condition, const std::string& from, const std::string& to) {
    std::string text = campaign();
    std::size_t at = 0;
    for (std::size_t i = 0; i <= condition; ++i) at = text.find("- id:", at + 1);
    at = text.find(from, at);
    ASSERT_NE(at, std::string::npos) << from << " in\n" << text;
    write("data/campaign.yaml", text.replace(at, from.size(), to));
  }

  /// A rail with wiggling of 6 mm. @param board additional board keys @param scene additional scene keys
  void simulate(const std::string& board = "", const std::string& scene = "", const std::string& camera = "camcube2") {
    write("model.yaml", "model: 1\ncamera: " + camera + "\neffects: []\n");
    write("truth.yaml",
          "model: 1\ncamera: " + camera + "\neffects: [{effect: wiggling, amplitude: 6 mm, phase: 0.5 rad}]\n");
    write("scene.yaml", "scene: 1\ncamera: " + camera +
                            "\nframes: 3\nseed: 3\ntime_since_power_on: 3600 s\nintegration_time: 2 ms\n" +
                            (scene.empty() ? "output: taps\n" : scene) +
                            "objects:\n  - {name: board, type: board, distance: 1 m, reflectivity: 0.6" + board +
                            "}\nsequence:\n  - {key: board.distance, values: [" + conditions + "]}\n");
    const Outcome made = shell("$TOFGRAPH simulate scene.yaml --model truth.yaml -o data", folder_.path());
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  Outcome diagnose(const std::string& options = "") {
    return shell(
        "$TOFGRAPH diagnose --quiet --force --model model.yaml --data data/campaign.yaml --out found " + options,
        folder_.path());
  }
  void expect_wiggling(double tolerance) {
    const Outcome outcome = diagnose();
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const auto said = report();
    ASSERT_EQ(said.at("effects").size(), 1U) << said.dump(1);
    EXPECT_EQ(said["effects"][0]["name"], "wiggling");
    EXPECT_NEAR(said["effects"][0]["parameters"]["amplitude"]["value"].get<double>(), 6e-3, tolerance);
  }
  nlohmann::json report() const { return nlohmann::json::parse(read_text(folder_.path() / "found/report.json")); }
  bool notes(const std::string& text) const {
    const auto said = report();
    return std::ranges::any_of(said.at("notes"), [&](const auto& note) {
      return note.template get<std::string>().find(text) != std::string::npos;
    });
  }

  TemporaryFolder folder_;
};

void expect_said(const Outcome& outcome, const std::string& text) {
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
}

TEST_F(DiagnoseInput, AMistypedDistanceStopsTheSearchUntilItsConditionIsSkipped) {
  simulate();
  change(1, "distance: 1.1 m", "distance: 11 m");
  const Outcome refused = diagnose();
  expect_said(refused, "you wrote 'distance: 11 m', the data indicate 1.1");  // plus a few mm of wiggling
  expect_said(refused, "correct it, or continue without the condition: --exclude-condition ");
  expect_said(refused, " |     board: {distance: 11 m");
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "found"));
  expect_said(diagnose("--skip nothing"), "--exclude-condition: error: there is no condition 'nothing'\n");
  const std::size_t at = refused.err.rfind("--exclude-condition ") + 20;
  const Outcome skipped = diagnose("--max-effects 0 --skip " + refused.err.substr(at, refused.err.find('\n', at) - at));
  ASSERT_EQ(skipped.exit_code, 0) << skipped.err;
  EXPECT_TRUE(notes("by --exclude-condition"));
  EXPECT_EQ(report()["data"]["conditions"], 7);
}

TEST_F(DiagnoseInput, TheReportHasTheCommandAsItWasTypedAndWhatMayBeAMistake) {
  simulate("", "output: taps\ntarget: grey\n");
  change(2, "target: grey", "target: gray");
  write("the model.yaml", read_text(folder_.path() / "model.yaml"));
  const std::string last = "0007_3.8m";
  const Outcome outcome = shell(
      "$TOFGRAPH diagnose --model 'the model.yaml' --data data/campaign.yaml --out found --max-effects 0 --skip " +
          last + " --force",
      folder_.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("warning: target 'gray' has one condition only"), std::string::npos) << outcome.err;
  EXPECT_TRUE(notes("The target 'gray' has one condition only: did you mean 'grey'?"));
  const std::string page = read_text(folder_.path() / "found/report.html");
  const std::size_t at = page.find("tofgraph diagnose --model");
  ASSERT_NE(at, std::string::npos);
  const std::string command = page.substr(at, page.find('<', at) - at);
  EXPECT_EQ(command,
            "tofgraph diagnose --model 'the model.yaml' --data data/campaign.yaml -o found --max-effects 0 "
            "--exclude-condition " +
                last);
}

/// A file size limit of 2 KiB simulates a full disk: the report is larger, the model smaller.
TEST_F(DiagnoseInput, WhatCannotBeWrittenLeavesTheResultBefore) {
  simulate();
  write("found/maps.h5", "maps of a search before");
  write("found/model.yaml", "a model that names them");
  const Outcome outcome = shell(
      "trap '' XFSZ; ulimit -f 4; $TOFGRAPH diagnose --quiet --force --max-effects 0 --model model.yaml "
      "--data data/campaign.yaml --out found",
      folder_.path());
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_NE(outcome.err.find("cannot be written"), std::string::npos) << outcome.err;
  EXPECT_EQ(read_text(folder_.path() / "found/maps.h5"), "maps of a search before");
  EXPECT_EQ(read_text(folder_.path() / "found/model.yaml"), "a model that names them");
}

TEST_F(DiagnoseInput, TheSameFramesInTwoConditionsAreRefused) {
  simulate();
  const std::string text = campaign();
  const std::size_t first = text.find("capture: ") + 9, second = text.find("capture: ", first) + 9;
  change(1, text.substr(second, text.find('\n', second) - second), text.substr(first, text.find('\n', first) - first));
  expect_said(diagnose(), "diagnose cannot use the condition: the frames of ");
  const Outcome checked = shell("$TOFGRAPH check data/campaign.yaml", folder_.path());
  EXPECT_EQ(checked.exit_code, 0) << "other commands may take them";
  EXPECT_NE(checked.err.find("warning: diagnose cannot use the condition: the frames of "), std::string::npos);
}

TEST_F(DiagnoseInput, AModelOfAnotherCameraIsAMistake) {
  simulate();
  write("model.yaml", "model: 1\ncamera: camcube3\neffects: []\n");
  const Outcome refused = diagnose();
  expect_said(refused,
              "model.yaml:2:9: error: the model is for the camera 'camcube3', the campaign data/campaign.yaml");
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "found"));
}

TEST_F(DiagnoseInput, ABoardWithASizeIsUsedWhereItIsSeen) {
  simulate(", size: [900 mm, 700 mm]");
  EXPECT_NE(campaign().find("size: "), std::string::npos) << campaign();
  expect_wiggling(2e-4);
}

/// Beyond r = 1 / sqrt(-3 k1) the lens folds over: no undistorted point is mapped outside a circle of 2/3 of that.
class PixelsOutsideTheLens : public DiagnoseInput, public testing::WithParamInterface<double> {
 protected:
  /// Fraction of a square of pixels outside a circle, which cuts off its corners or fits into it.
  static double share_outside(double k1) {
    const double half_width = 101.5 * 40e-6 / 12.8e-3, radius = 2.0 / 3 / std::sqrt(-3 * k1) / half_width;
    double area = M_PI * radius * radius;
    if (radius > 1) area -= 4 * (radius * radius * std::acos(1 / radius) - std::sqrt(radius * radius - 1));
    return 1 - area / 4;
  }
};

TEST_P(PixelsOutsideTheLens, AreLeftOut) {
  std::string profile = read_text(TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml");
  profile.replace(profile.find("[0, 0, 0, 0, 0]"), 15, "[" + std::to_string(GetParam()) + ", 0, 0, 0, 0]");
  write("bent.yaml", profile);
  simulate("", "", folder_.path().string() + "/bent.yaml");
  expect_wiggling(2e-4);
  double told = 0;
  const auto said = report();
  for (const std::string note : said.at("notes")) {
    const std::size_t end = note.find(" % of the pixels are outside the lens model and are excluded");
    if (end != std::string::npos) told = std::stod(note.substr(0, end)) / 100;
  }
  EXPECT_NEAR(told, share_outside(GetParam()), 0.01) << said["notes"];
}

INSTANTIATE_TEST_SUITE_P(FiveTwentyAndThirtyFivePercent, PixelsOutsideTheLens, testing::Values(-1.01, -1.43, -1.76));

TEST_F(DiagnoseInput, DistancesWithAmplitudeAreEnough) {
  simulate("", "output: distance\n");
  expect_wiggling(2e-4);
}

}  // namespace
}  // namespace tofgraph::tests
