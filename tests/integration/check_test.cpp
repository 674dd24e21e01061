// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Findings of `check` that depend on more than one file, and valid input that it must accept.
#include <gtest/gtest.h>

#include "io/captures/capture.hpp"
#include "tests/program.hpp"

#include <cmath>

namespace tofgraph::tests {
namespace {

const std::string profiles = TOFGRAPH_SOURCE_DIR "/devices/profiles/";

class Check : public testing::Test {
 protected:
  Outcome check(const std::string& file) const { return shell("$TOFGRAPH check " + file, folder_.path()); }
  void write(const std::string& name, const std::string& text) const { write_text(folder_.path() / name, text); }
  /// A capture of one frame of distances.
  void record(const std::string& name, const std::string& camera, double integration_time) const {
    io::CaptureHeader header;
    header.camera = camera;
    header.width = header.height = 204;
    io::CaptureWriter writer(folder_.path() / name, header,
                             {{"distance", TOFGRAPH_TYPE_F32, {204, 204}, "m", "", "", ""}}, {0, true});
    std::vector<float> values(204 * 204, 1);
    const tofgraph_view view{
        .type = TOFGRAPH_TYPE_F32, .rank = 2, .data = values.data(), .extent = {204, 204}, .stride = {816, 4}};
    tofgraph_metadata metadata{};
    metadata.integration_time = integration_time;
    metadata.time_since_power_on = metadata.temperature = NAN;
    writer.append(metadata, {&view, 1});
    writer.finish();
  }

  TemporaryFolder folder_;
};

void expect_said(const Outcome& outcome, int code, const std::string& words) {
  EXPECT_EQ(outcome.exit_code, code) << outcome.err;
  EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
}

TEST_F(Check, ACameraIsTheSameByNameAndByPath) {
  write("model.yaml", "model: 1\ncamera: " + profiles + "camcube2.yaml\neffects: []\n");
  write("other.yaml", "model: 1\ncamera: " + profiles + "camcube3.yaml\neffects: []\n");
  const auto scene = [](const std::string& camera, const std::string& model) {
    return "scene: 1\ncamera: " + camera + "\nmodel: " + model + "\nobjects: [{type: board, distance: 1 m}]\n";
  };
  write("scene.yaml", scene("camcube2", "model.yaml"));
  write("wrong.yaml", scene("camcube2", "other.yaml"));
  EXPECT_EQ(check("scene.yaml").err, "scene.yaml: the scene is valid, 1 object, 1 condition\n");
  expect_said(check("wrong.yaml"), 0, "warning: the model is for the camera '" + profiles + "camcube3.yaml'");
  const Outcome simulated = shell("$TOFGRAPH simulate scene.yaml -o a.h5", folder_.path());
  EXPECT_EQ(simulated.exit_code, 0);
  EXPECT_EQ(simulated.err.find("warning"), std::string::npos) << simulated.err;
}

/// A recording of another program states only the stage that corrected its distances.
TEST_F(Check, ARecordedCorrectionIsNotAppliedAgain) {
  io::CaptureHeader header;
  header.camera = "camcube2";
  header.width = header.height = 204;
  for (const std::string applied : {"optimized_bistatic", "median", ""}) {
    io::CaptureWriter writer(folder_.path() / "a.h5", header,
                             {{"distance", TOFGRAPH_TYPE_F32, {204, 204}, "m", "", applied, ""}}, {0, true});
    std::vector<float> values(204 * 204, 1);
    const tofgraph_view view{
        .type = TOFGRAPH_TYPE_F32, .rank = 2, .data = values.data(), .extent = {204, 204}, .stride = {816, 4}};
    writer.append({}, {&view, 1});
    writer.finish();
    for (const std::string stage : {"optimized_bistatic", "simple_bistatic", "perpendicular_illumination"}) {
      const Outcome outcome = check("'capture_reader file=a.h5 ! " + stage + " ! null' --camera camcube2");
      if (applied == "optimized_bistatic")
        expect_said(outcome, 2, "'distance' already has non_linearity applied");
      else if (applied == "median")
        expect_said(outcome, 2, "the recording has it already: take '" + stage + "' out");
      else
        EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    }
  }
}

TEST_F(Check, ReportsTheErrorsOfALayout) {
  write("layout.yaml", "layout: 1\ncamera: camcube2\nchannels:\n  depth: {unit: mm, saturated: 0x8000}\n");
  EXPECT_NE(check("layout.yaml").err.find("layout.yaml: the layout is valid, 1 channel"), std::string::npos);
  write("layout.yaml", "layout: 1\ncamera: nothing\nchannels:\n  depht: {mask: many}\n");
  const Outcome outcome = check("layout.yaml");
  expect_said(outcome, 2, "layout.yaml:4:3: error: there is no channel 'depht'");
  expect_said(outcome, 2, "layout.yaml:4:17: error: 'mask' must be the bits of a whole number");
  expect_said(outcome, 2, "layout.yaml:2:9: error: there is no camera profile 'nothing'");
}

TEST_F(Check, OpensTheCapturesOfACampaign) {
  const std::string recording = TOFGRAPH_SOURCE_DIR "/pipelines/data/o3d303_scene.h5";
  write("broken.h5", read_text(recording).substr(0, 5000));
  write("campaign.yaml",
        "campaign: 1\ncamera: camcube2\nconditions:\n"
        "  - {id: a, capture: broken.h5, board: {distance: 1 m}}\n"
        "  - {id: b, capture: " +
            recording + ", frames: [0, 19], board: {distance: 1 m}}\n");
  const Outcome outcome = check("campaign.yaml");
  expect_said(outcome, 2, "campaign.yaml:4:22: error: 'capture': ");
  expect_said(outcome, 2, "campaign.yaml:5:22: error: 'capture': the capture is 176 x 132 px, the camera 'camcube2'");
  expect_said(outcome, 2, "'capture': the capture has 3 frames, counted from 0: frame 19 does not exist");
}

std::size_t count(const std::string& text, const std::string& words) {
  std::size_t times = 0;
  for (std::size_t at = 0; (at = text.find(words, at)) != std::string::npos; ++at) ++times;
  return times;
}

/// The campaign states 2 ms for each; a recorder that writes the same value into all its files is ignored.
TEST_F(Check, SaysWhereACaptureHasAnotherIntegrationTime) {
  std::string text = "campaign: 1\ncamera: camcube2\nconditions:\n";
  for (const std::string id : {"a", "b", "c"})
    text += "  - id: " + id + "\n    capture: " + id + ".h5\n    board: {distance: 1 m}\n    integration_time: 2 ms\n";
  write("campaign.yaml", text);
  for (const std::string id : {"a", "c"}) record(id + ".h5", "camcube2", 2e-3);
  record("b.h5", "camcube2", 2e-6);
  const Outcome one = check("campaign.yaml");
  expect_said(one, 0, "campaign.yaml:11:23: warning: 'integration_time' is 2 ms, the capture states 2 us");
  EXPECT_EQ(count(one.err, "warning: "), 1U) << one.err;
  for (const std::string id : {"a", "c"}) record(id + ".h5", "camcube2", 2e-6);
  const Outcome all = check("campaign.yaml");
  expect_said(all, 0,
              "campaign.yaml:7:23: warning: the campaign's integration times are 1000 times those of the captures");
  EXPECT_EQ(count(all.err, "warning: "), 1U) << all.err;
}

TEST_F(Check, TellsOnceThatCapturesAreOfAnotherCamera) {
  const auto campaign = [&](const std::string& capture) {
    std::string text = "campaign: 1\ncamera: camcube2\nconditions:\n";
    for (int i = 0; i < 3; ++i)
      text += "  - {capture: " + capture + ", frames: [" + std::to_string(i) + ", " + std::to_string(i) +
              "], board: {distance: 1 m}, integration_time: 2 ms, roi: {columns: [0, 9], rows: [" +
              std::to_string(10 * i) + ", " + std::to_string(10 * i + 9) + "]}}\n";
    write("campaign.yaml", text);
    return check("campaign.yaml");
  };
  const Outcome sizes = campaign(TOFGRAPH_SOURCE_DIR "/pipelines/data/o3d303_scene.h5");
  expect_said(sizes, 2,
              "campaign.yaml:4:15: error: 'capture': the captures of 3 conditions, of which this is the first, are 176 "
              "x 132 px, the camera 'camcube2' has 204 x 204");
  EXPECT_EQ(count(sizes.err, "176 x 132"), 1U) << sizes.err;
  std::string text = "campaign: 1\ncamera: camcube2\nconditions:\n";
  for (const std::string id : {"a", "b", "c"}) {
    record(id + ".h5", "camcube3", 2e-3);
    text += "  - {id: " + id + ", capture: " + id + ".h5, board: {distance: 1 m}}\n";
  }
  write("campaign.yaml", text);
  const Outcome cameras = check("campaign.yaml");
  expect_said(cameras, 0,
              "campaign.yaml:4:22: warning: diagnose cannot use 3 conditions, of which this is the first: their "
              "captures are of the camera 'camcube3', the campaign's is 'camcube2'");
  expect_said(cameras, 0, "         write in the campaign: camera: camcube3\n");
  EXPECT_EQ(count(cameras.err, "warning: "), 1U) << cameras.err;
}

TEST_F(Check, PointsAtTheTimeThatRunsBackwards) {
  std::string text = "campaign: 1\ncamera: camcube2\nconditions:\n";
  for (const auto& [id, order] : {std::pair("a", 1), std::pair("b", 2)}) {
    record(std::string(id) + ".h5", "camcube2", 2e-3);
    text += "  - id: " + std::string(id) + "\n    capture: " + id + ".h5\n    board: {distance: 1 m}\n" +
            "    session: one\n    order: " + std::to_string(order) +
            "\n    time_since_power_on: " + std::to_string(100 - order) + " s\n";
  }
  write("campaign.yaml", text);
  expect_said(check("campaign.yaml"), 0,
              "campaign.yaml:15:26: warning: diagnose cannot use the condition: 'time_since_power_on' runs backwards");
}

TEST_F(Check, SaysWhichTargetIsPerhapsMisspelled) {
  std::string text = "campaign: 1\ncamera: camcube2\nconditions:\n";
  for (const std::string id : {"a", "b", "c", "d"}) {
    record(id + ".h5", "camcube2", 2e-3);
    text += "  - {id: " + id + ", capture: " + id + ".h5, board: {distance: 1 m}, target: gr" +
            (id == "c" ? "a" : "e") + "y}\n";
  }
  write("campaign.yaml", text);
  const Outcome outcome = check("campaign.yaml");
  expect_said(outcome, 0, "campaign.yaml:6:60: warning: target 'gray' has one condition only\n");
  expect_said(outcome, 0, "         did you mean 'grey'?\n");
}

TEST_F(Check, SaysWhatOtherCommandsNeedOfAProfile) {
  const Outcome outcome = check(profiles + "o3d303.yaml");
  expect_said(outcome, 0,
              "simulate cannot use the camera 'o3d303': its profile has no focal length in metres, sources");
  expect_said(outcome, 0, "the profile has no read_noise and shot_noise: a scene must write noise: none");
  const Outcome whole = check(profiles + "camcube2.yaml");
  EXPECT_EQ(whole.err.find("warning"), std::string::npos) << whole.err;
}

TEST_F(Check, NamesThatNoFileCanHaveAreMistakesLikeOthers) {
  const std::string name(300, 'a');
  const std::string at = " --camera camcube2";
  expect_said(check("'simulator scene=" + name + " ! null'" + at), 2, "File name too long");
  expect_said(check("'capture_reader file=" + name + " ! null'" + at), 2, "there is no such file");
  expect_said(check("'simulator distance=1m ! pcd_writer path=" + name + ".pcd'" + at), 2, "error: ");
  expect_said(shell("$TOFGRAPH list --plugin-path " + name, folder_.path()), 2,
              "this cannot be entered: File name too long");
  expect_said(check(name), 2, "error: ");
  write("scene.yaml", "scene: 1\ncamera: " + name + "\nmodel: " + name + "\nobjects:\n  - {type: mesh, file: " + name +
                          ".ply, position: [0 m, 0 m, 1 m]}\n");
  expect_said(check("scene.yaml"), 2, "scene.yaml:2:9: error: there is no camera profile");
  write("campaign.yaml",
        "campaign: 1\ncamera: camcube2\nconditions:\n  - {id: a, capture: " + name + ".h5, board: {distance: 1 m}}\n");
  expect_said(check("campaign.yaml"), 2, "campaign.yaml:4:22: error: 'capture': there is no file");
}

}  // namespace
}  // namespace tofgraph::tests
