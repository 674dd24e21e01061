// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: ModelCorrectionNode.GivesThe*:ModelCorrectionNode.KnowsThe*
// Rooms: plugins
// model_correction as written by users: an inline model, the model of the profile, output of explain.
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

namespace tofgraph::tests {
namespace {

const char* const in_place =
    "    model: {effects: [{effect: wiggling, amplitude: 10 mm}, {effect: lens_distortion, k1: -0.1},\n"
    "                      {effect: board_tilt, x: 5 mrad}, {effect: mixed_pixels, blur: 0.7 px}]}\n";

std::string pipeline(const std::string& camera, const std::string& model) {
  return "pipeline: 1\ncamera: " + camera +
         "\nnodes:\n  - {stage: simulator, distance: 2 m, integration_time: 2 ms, noise: none, model: model.yaml}\n"
         "  - {stage: four_phase_decoder}\n  - name: undo\n    stage: model_correction\n" +
         model + "  - {stage: optimized_bistatic}\n  - {stage: statistics, value: 2 m, path: out.json}\n";
}

class ModelCorrectionNode : public testing::Test {
 protected:
  ModelCorrectionNode() {
    write_text(
        folder.path() / "model.yaml",
        "model: 1\neffects:\n  - {effect: wiggling, amplitude: 10 mm}\n  - {effect: lens_distortion, k1: -0.1}\n");
  }
  /// Root mean square error of the depth relative to the board's, m.
  double rms() const {
    return nlohmann::json::parse(read_text(folder.path() / "out.json"))["inputs"][0]["rms"].get<double>();
  }
  TemporaryFolder folder;
};

TEST_F(ModelCorrectionNode, TakesAModelInPlaceAndExplainSaysWhatBecomesOfEachEffect) {
  write_text(folder.path() / "p.yaml", pipeline("camcube2", in_place));
  const Outcome explained = shell("\"$TOFGRAPH\" explain p.yaml", folder.path());
  ASSERT_EQ(explained.exit_code, 0) << explained.err;
  for (const char* words : {"undoes wiggling: each pixel's distance is corrected",
                            "undoes lens_distortion: the frames have the corrected camera",
                            "leaves board_tilt: belongs to the set-up, not to the camera",
                            "leaves mixed_pixels: mixes neighbours so strongly", "replaces the rays"})
    EXPECT_NE(explained.out.find(words), std::string::npos) << words << "\n" << explained.out;
  const Outcome outcome = shell("\"$TOFGRAPH\" run p.yaml", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_LT(rms(), 20e-6);
}

/// A table is constant beyond its ends: a dependence on the time is visible only between them.
TEST_F(ModelCorrectionNode, LooksForAllTimesAtWhichAnEffectMayChange) {
  write_text(folder.path() / "times.csv", "0.5,20\n0.6,0\n");
  write_text(folder.path() / "model.yaml",
             "model: 1\neffects: [{effect: integration_time_offset, table: times.csv}]\n");
  write_text(folder.path() / "p.yaml", pipeline("camcube2", "    model: model.yaml\n"));
  for (const char* time : {"0.5 ms", "2 ms"}) {
    const std::string set = " --force --set simulator.integration_time='" + std::string(time) + "'";
    const Outcome outcome = shell("\"$TOFGRAPH\" run p.yaml" + set, folder.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_LT(rms(), 20e-6) << time;
  }
}

/// Three steps of 120 degrees.
TEST_F(ModelCorrectionNode, KnowsTheExposuresOfTheFrames) {
  std::string text = pipeline("mlx75027_three_step", "    model: model.yaml\n");
  text.replace(text.find("four_phase_decoder"), 18, "phase_decoder");
  write_text(folder.path() / "p.yaml", text);
  write_text(folder.path() / "model.yaml",
             "model: 1\neffects: [{effect: wiggling, amplitude: 10 mm}, {effect: zero_offset, offset: 7 mm}]\n");
  const std::string near = " --set simulator.distance='700 mm' --set statistics.value='700 mm'";
  const Outcome outcome = shell("\"$TOFGRAPH\" run p.yaml" + near, folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_LT(rms(), 20e-6);
}

/// During warm-up, tables are interpolated: the result is bit-identical, whichever frame comes first.
TEST_F(ModelCorrectionNode, GivesTheSameWithAnyNumberOfThreads) {
  write_text(folder.path() / "model.yaml",
             "model: 1\neffects: [{effect: warm_up, drift: 20 mm}, {effect: wiggling, amplitude: 5 mm}]\n");
  write_text(folder.path() / "scene.yaml",
             "scene: 1\ncamera: camcube2\nmodel: model.yaml\nframes: 2\nobjects: [{name: board, type: board, distance: "
             "2 m}]\nsequence: [{key: time_since_power_on, values: [10 s, 20 s, 30 s, 60 s, 120 s, 200 s, 400 s]}]\n");
  write_text(folder.path() / "p.yaml",
             "pipeline: 1\nnodes:\n  - {stage: simulator, scene: scene.yaml}\n  - {stage: four_phase_decoder}\n"
             "  - {stage: model_correction, model: model.yaml}\n  - {stage: statistics, value: 2 m, path: out.json}\n");
  std::string first;
  for (const char* threads : {"1", "4", "4"}) {
    const Outcome outcome = shell("\"$TOFGRAPH\" run p.yaml --force --threads " + std::string(threads), folder.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::string text = read_text(folder.path() / "out.json");
    if (first.empty()) first = text;
    EXPECT_TRUE(text == first) << threads << " threads";
  }
}

TEST_F(ModelCorrectionNode, IsAppliedOnce) {
  const std::string once = pipeline("camcube2", "    model: model.yaml\n"), next = "  - {stage: optimized_bistatic}\n";
  write_text(folder.path() / "p.yaml", once);
  const Outcome explained = shell("\"$TOFGRAPH\" explain p.yaml", folder.path());
  EXPECT_NE(explained.out.find("model_correction, effects"), std::string::npos) << explained.out;
  std::string twice = once;
  twice.insert(twice.find(next), "  - {name: again, stage: model_correction, model: model.yaml}\n");
  write_text(folder.path() / "p.yaml", twice);
  const Outcome refused = shell("\"$TOFGRAPH\" check p.yaml", folder.path());
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("node 'again' (model_correction): 'distance' already has model_correction applied"),
            std::string::npos)
      << refused.err;
}

TEST_F(ModelCorrectionNode, SaysWhereNothingIsUndone) {
  write_text(folder.path() / "p.yaml",
             pipeline("camcube2", "    model: {effects: [{effect: temporal_noise, factor: 2}]}\n"));
  const Outcome outcome = shell("\"$TOFGRAPH\" explain p.yaml", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("leaves temporal_noise: does not change the distance"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.err.find("nothing is undone"), std::string::npos) << outcome.err;
}

TEST_F(ModelCorrectionNode, TakesTheModelThatTheProfileNames) {
  std::string profile = read_text(TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml");
  write_text(folder.path() / "mine.yaml", profile + "\nmodel: model.yaml\n");
  write_text(folder.path() / "p.yaml", pipeline("mine.yaml", ""));
  const Outcome outcome = shell("\"$TOFGRAPH\" run p.yaml", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_LT(rms(), 20e-6);
  write_text(folder.path() / "mine.yaml", profile + "\nmodel: gone.yaml\n");
  const Outcome gone = shell("\"$TOFGRAPH\" check mine.yaml", folder.path());
  EXPECT_EQ(gone.exit_code, 2);
  EXPECT_NE(gone.err.find("there is no model"), std::string::npos) << gone.err;
}

}  // namespace
}  // namespace tofgraph::tests
