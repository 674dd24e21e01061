// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: RecordCampaign.ABoard*:RecordCampaign.IsGone*:RecordCampaign.IsNot*:RecordCampaign.NoConditions*
// Slow: RecordCampaign.WhatIs*:RecordPlan.ASimulated*:RecordPlan.GoesOn*:RecordPlan.IsRecorded*
// Slow: RecordPlan.RefusesCaptures*:RecordPlan.SeesWhen*
// Rooms: recording io devices
// `tofgraph record --plan`: a script acts as the operator who sets up the board in front of a simulated camera.
#include <gtest/gtest.h>
#include <hdf5.h>

#include <nlohmann/json.hpp>
#include <set>

#include "io/campaign.hpp"
#include "tests/camera_in_software.hpp"
#include "tests/program.hpp"
#include "tests/unit/capture_fixture.hpp"
#include "tests/unit/full_disk.hpp"
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
  /// Report of the script. @param options of the operator
  nlohmann::json operate(const std::string& options) {
    const Outcome outcome =
        shell("/usr/bin/env python3 " TOFGRAPH_SOURCE_DIR "/tests/fixtures/operator.py \"$TOFGRAPH\" plan.yaml out " +
                  options,
              folder.path());
    screen = outcome.err;
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  }

  /// Expects every condition once, with all its frames, recorded one after the other, with the board at its true
  /// position: by the light of its centre pixel, computed in closed form from the profile's gain.
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
      // I = gain rho t / D_t^2 with the mean path; at a contrast of 0.5 this is the mean of a tap.
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

/// A campaign in front of a fixed board.
class RecordCampaign : public testing::Test {
 protected:
  void SetUp() override { world(1000); }
  void world(double millimetres, const std::string& camera = "camcube2") const {
    write_text(folder.path() / "world.yaml", "scene: 1\ncamera: " + camera +
                                                 "\nframes: 1\noutput: taps\nobjects:\n  - {type: board, distance: " +
                                                 std::to_string(millimetres) + " mm, reflectivity: 0.5}\n");
  }
  void plan(const std::vector<std::pair<std::string, double>>& conditions,
            const std::string& camera = "camcube2") const {
    std::string text = "campaign: 1\nname: boards\ncamera: " + camera + "\nconditions:\n";
    for (const auto& [id, millimetres] : conditions)
      text += "  - {id: " + id + ", capture: " + id +
              ".h5, target: white, integration_time: 1 ms, board: {distance: " + std::to_string(millimetres) +
              " mm}}\n";
    write_text(folder.path() / "plan.yaml", text);
  }
  /// @param answers one per line, as printf takes them
  Outcome record(const std::string& answers, const std::string& options = "", int frames = 2) const {
    return shell("printf '" + answers +
                     "' | \"$TOFGRAPH\" record --plan plan.yaml --camera simulated:world.yaml -o out " + options +
                     " --frames " + std::to_string(frames),
                 folder.path());
  }
  std::vector<std::string> captures() const {
    std::vector<std::string> names = listing(folder.path() / "out/captures");
    std::erase(names, ".unfinished");
    return names;
  }
  TemporaryFolder folder;
};

TEST_F(RecordCampaign, ABoardThatNobodyMovedIsNotRecordedAsMoved) {
  plan({{"a", 1000}, {"b", 1020}, {"c", 1200}});
  // The first is confirmed; a further 20 mm cannot be detected, so the program asks again and gets no answer.
  const Outcome first = record("\\n", "--still");
  EXPECT_EQ(first.exit_code, 1) << first.err;
  expect_words(first.err,
               {"nobody can see here whether it was moved", "1 of 3 conditions recorded", "standard input has ended"});
  EXPECT_EQ(captures(), std::vector<std::string>{"a.h5"});
  // After a restart the position of the board is unknown.
  EXPECT_EQ(record("", "--still").exit_code, 1);
  EXPECT_EQ(record("skip\\n", "--still").exit_code, 1);
  EXPECT_EQ(captures(), std::vector<std::string>{"a.h5"});
  // A detectable change is awaited: it does not happen.
  plan({{"a", 1000}, {"b", 1045}});
  std::filesystem::remove_all(folder.path() / "out");
  // Interrupted only after this message, however long it takes.
  shell(
      "mkfifo answers; \"$TOFGRAPH\" record --plan plan.yaml --camera simulated:world.yaml -o out --frames 2 --still "
      "<answers 2>err.txt & exec 3>answers; echo >&3; " +
          once_it_says("has moved by") + "sleep 0.5; kill -INT $!; wait $!",
      folder.path());
  const std::string screen = read_text(folder.path() / "err.txt");
  expect_words(screen, {"the board has moved by", "planned were 45 mm", "1 of 2 conditions recorded"});
  EXPECT_EQ(captures(), std::vector<std::string>{"a.h5"});
}

TEST_F(RecordCampaign, NoConditionsNameIsThatOfAnUnfinishedRecording) {
  plan({{"a.recording", 1000}, {"a", 1000}, {"a.h5", 1000}});
  for (int i = 0; i < 2; ++i) {
    const Outcome outcome = record("\\n\\n\\n");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(captures(), (std::vector<std::string>{"a.h5", "a.h5.h5", "a.recording.h5"}));
  }
  EXPECT_FALSE(fs::exists(folder.path() / "out/captures/.unfinished"));
}

TEST_F(RecordCampaign, WhatIsUnfinishedIsRemovedOnlyWhereAllIsOfThePlan) {
  plan({{"a", 1000}, {"b", 1000}});
  ASSERT_EQ(record("\\n").exit_code, 0);
  const fs::path left = folder.path() / "out/captures/.unfinished/b.h5.part";
  fs::remove(folder.path() / "out/captures/b.h5");
  write_text(left, "precious");
  plan({{"a", 1100}, {"b", 1000}});
  EXPECT_EQ(record("\\n\\n").exit_code, 1);
  EXPECT_EQ(read_text(left), "precious");
  plan({{"a", 1000}, {"b", 1000}});
  const Outcome outcome = record("\\n\\n");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  expect_words(outcome.err, {"b.h5.part: the recording of 'b' was not finished: it is removed"});
  EXPECT_EQ(captures(), (std::vector<std::string>{"a.h5", "b.h5"}));
}

TEST_F(RecordCampaign, IsGoneOnWithByTheSameCameraAlone) {
  plan({{"a", 1000}, {"b", 1200}});
  EXPECT_EQ(record("\\n").exit_code, 1) << "b is not where it should be";
  EXPECT_EQ(captures(), std::vector<std::string>{"a.h5"});
  world(1200);
  const Outcome frames = record("\\n", "", 5);
  EXPECT_EQ(frames.exit_code, 1);
  expect_words(frames.err, {"out/captures/a.h5: has 2 frames, 5 are asked for", "choose another folder"});
  std::string profile = read_text(TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml"), renamed = profile;
  renamed.replace(renamed.find("name: camcube2"), 14, "name: othercam");
  write_text(folder.path() / "other.yaml", renamed);
  world(1200, "other.yaml");
  const Outcome other = record("\\n");
  EXPECT_EQ(other.exit_code, 2);
  expect_words(other.err, {"--camera: error: this is the camera 'othercam'", "plan.yaml is for 'camcube2'"});
  plan({{"a", 1000}, {"b", 1200}}, "other.yaml");
  const Outcome both = record("\\n");
  EXPECT_EQ(both.exit_code, 1);
  expect_words(both.err, {"was recorded with the camera 'camcube2', this is 'othercam'"});
  plan({{"a", 1000}, {"b", 1200}});
  write_text(folder.path() / "mine.yaml", profile + "# changed\n");
  world(1200, "mine.yaml");
  const Outcome changed = record("\\n");
  EXPECT_EQ(changed.exit_code, 1);
  expect_words(changed.err, {"was recorded with another profile of the camera 'camcube2'"});
  EXPECT_EQ(captures(), std::vector<std::string>{"a.h5"});
  world(1200);
  EXPECT_EQ(record("\\n").exit_code, 0);
}

TEST_F(RecordCampaign, IsNotGoneOnWithByAnotherCameraOfItsKind) {
  if (!has_software_camera()) GTEST_SKIP() << "umockdev is not installed";
  plan({{"a", 1000}, {"b", 1000}});
  const auto with = [&](const std::string& serial, const std::string& answers) {
    return shell(with_software_camera("--cameras 2", "sh -c \"printf '" + answers +
                                                         "' | $TOFGRAPH record --plan plan.yaml --camera camcube:usb "
                                                         "--set device=" +
                                                         serial + " -o out --frames 2\""),
                 folder.path());
  };
  const Outcome first = with("SOFT1", "record\\nquit\\n");
  EXPECT_EQ(captures(), std::vector<std::string>{"a.h5"}) << first.err;
  const Outcome other = with("SOFT2", "record\\n");
  EXPECT_EQ(other.exit_code, 1);
  expect_words(other.err, {"was recorded with the camera of serial number SOFT1, this one has SOFT2"});
  EXPECT_EQ(with("SOFT1", "record\\n").exit_code, 0);
}

TEST_F(RecordCampaign, WrongUsageIsToldBeforeAnythingIsMade) {
  plan({{"a", 1000}});
  const auto refuses = [&](const std::string& options, const std::vector<std::string>& words) {
    const Outcome outcome = shell("\"$TOFGRAPH\" record --plan plan.yaml -o out " + options, folder.path());
    EXPECT_EQ(outcome.exit_code, 2) << options << outcome.err;
    expect_words(outcome.err, words);
    EXPECT_FALSE(fs::exists(folder.path() / "out")) << options;
  };
  const std::string world = "--camera simulated:world.yaml ";
  refuses(world + "--comment mine", {"--comment: error: a plan's captures say"});
  refuses(world + "--force", {"--force: error: a plan goes on"});
  refuses(world + "--for '3 s'", {"--duration: error: a plan is recorded by frames"});
  refuses(world + "--set integration_time='1 ms'", {"the plan says the integration times"});
  refuses(world + "--set camera.auto_integration_time=true", {"the plan says the integration times"});
  refuses(world + "--set capture.comment=mine", {"the plan says that"});
  refuses("--camera camcube:usb", {"--camera:1:", "no camera 1c28:c003 is plugged in"});
  refuses("--camera camcube", {"--camera:1:1", "no camera was found"});
  refuses("--camera simulated:nowhere.yaml", {"nowhere.yaml"});
}

}  // namespace
}  // namespace tofgraph::tests
