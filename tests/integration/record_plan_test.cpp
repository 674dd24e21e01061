// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// `tofgraph record --plan`: a person, in the form of a script, sets up the board before a simulated camera.
#include <gtest/gtest.h>
#include <hdf5.h>

#include <nlohmann/json.hpp>
#include <set>

#include "io/campaign.hpp"
#include "tests/program.hpp"
#include "tests/unit/capture_fixture.hpp"
#include "tests/unit/raw_capture.hpp"

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

class RecordPlan : public testing::Test {
 protected:
  void SetUp() override {
    write_text(folder.path() / "plan.yaml",
               "scene: 1\nname: the plan\ncamera: camcube2\nframes: 5\noutput: taps\n"
               "objects:\n  - {name: board, type: board, distance: 1 m, reflectivity: 0.5}\n"
               "sequence:\n"
               "  - {key: board.distance, values: [600 mm, 800 mm, 1200 mm, 1600 mm, 2 m, 3 m]}\n"
               "  - {key: integration_time, values: [0.5 ms, 1 ms, 2 ms, 4 ms]}\n");
  }
  /// What the script reports. @param options of the operator
  nlohmann::json operate(const std::string& options) {
    const Outcome outcome =
        shell("/usr/bin/env python3 " TOFGRAPH_SOURCE_DIR "/tests/fixtures/operator.py \"$TOFGRAPH\" plan.yaml out " +
                  options,
              folder.path());
    screen = outcome.err;
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  }

  /// Every condition once, with all its frames, recorded one after the other, and the board where it belongs: by the
  /// light of its middle pixel, which in closed form is that of the profile's gain.
  void expect_complete() const {
    config::Diagnostics diagnostics;
    const io::Campaign campaign = io::read_campaign(folder.path() / "out/campaign.yaml", diagnostics);
    ASSERT_TRUE(diagnostics.ok()) << diagnostics.text();
    ASSERT_EQ(campaign.conditions.size(), 24U);
    std::set<std::uint64_t> orders;
    std::set<std::string> starts;
    for (const io::Condition& condition : campaign.conditions) {
      orders.insert(condition.order.value());
      EXPECT_EQ(condition.recorded_at.size(), std::string("2026-11-22T15:11:58Z").size());
      const auto times = raw_values<double>(condition.capture, "/frames/integration_time_s");
      EXPECT_EQ(times, std::vector<double>(5, condition.integration_time));
      const auto taps = raw_values<std::uint16_t>(condition.capture, "/frames/taps");
      double light = 0;
      for (std::size_t k = 0; k < 8; ++k) light += taps[k * 204 * 204 + 102 * 204 + 102] / 8.0;
      // I = gain rho t / D_t^2 of the mean path; at a contrast of 0.5 a tap's mean.
      const double path = std::hypot(condition.board_distance, 0.05) + condition.board_distance;
      EXPECT_NEAR(light, 7e6 * 0.5 * condition.integration_time / (path * path), 0.1 * light + 3) << condition.id;
    }
    EXPECT_EQ(orders.size(), 24U);
    EXPECT_EQ(*orders.rbegin(), 23U);
    for (const auto& entry : fs::directory_iterator(folder.path() / "out/captures"))
      EXPECT_TRUE(entry.path().string().find(".recording") == std::string::npos) << entry.path();
  }

  TemporaryFolder folder;
  std::string screen;
};

TEST_F(RecordPlan, IsRecordedAsPlannedAndWrongBoardsAreToldBefore) {
  const nlohmann::json result = operate("--wrong 2");
  EXPECT_EQ(result["exit_code"], 0) << screen;
  EXPECT_EQ(result["wrong"], 3);
  EXPECT_EQ(result["told"], 3) << screen;
  expect_words(screen, {"planned are 800 mm", "500 mm too far", "24 of 24 conditions recorded"});
  expect_complete();
}

TEST_F(RecordPlan, GoesOnAfterKills) {
  const nlohmann::json result = operate("--kills 10 --seed 3");
  EXPECT_EQ(result["exit_code"], 0) << screen;
  EXPECT_GE(result["kills"], 4);
  expect_complete();
}

TEST_F(RecordPlan, SeesWhenTheBoardStands) {
  const nlohmann::json result = operate("--still --wrong 3");
  EXPECT_EQ(result["exit_code"], 0) << screen;
  EXPECT_EQ(result["told"], 2);
  expect_complete();
}

TEST_F(RecordPlan, ASimulatedCameraBeforeThePlanItselfNeedsNobody) {
  const Outcome outcome =
      shell("\"$TOFGRAPH\" record --plan plan.yaml --camera simulated:plan.yaml -o out", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  expect_complete();
}

TEST_F(RecordPlan, RefusesCapturesOfAnotherPlan) {
  const std::string command = "\"$TOFGRAPH\" record --plan plan.yaml --camera simulated:plan.yaml -o out";
  ASSERT_EQ(shell(command + " --frames 1", folder.path()).exit_code, 0);
  std::string other = read_text(folder.path() / "plan.yaml");
  other.replace(other.find("reflectivity: 0.5"), 17, "reflectivity: 0.6");
  write_text(folder.path() / "plan.yaml", other);
  const Outcome outcome = shell(command, folder.path());
  EXPECT_EQ(outcome.exit_code, 1);
  expect_words(outcome.err, {"was not recorded by this plan", "choose another folder"});
}

}  // namespace
}  // namespace tofgraph::tests
