// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: ModelCorrection.ANewRecording*:ModelCorrection.KeepsTheNoise:ModelCorrection.TakesStrayLight*
// Rooms: diagnosis simulation plugins
// model_correction in use: with the result of a search, with noise, lenses, stray light; rejected input.
#include "tests/hidden_effects/campaign.hpp"
#include "tests/hidden_effects/model_correction_fixture.hpp"
#include "tests/program.hpp"

#include <functional>

namespace tofgraph::hidden {
namespace {

/// A campaign with noise and jitter, searched as by a user; then new boards of the same camera, at distances and with
/// targets that the campaign did not contain, corrected with the model found.
TEST_F(ModelCorrection, ANewRecordingIsCorrectedWithWhatTheSearchFound) {
  CampaignOptions campaign;
  campaign.every = 2;
  campaign.frames = 2;
  campaign.effects.add("wiggling", {{"amplitude", 6e-3}, {"phase", 0.7}});
  campaign.effects.add("crosstalk", {{"real", 1200}, {"imaginary", -900}});
  campaign.seed = 21;
  campaign.folder = folder_ / "campaign";
  make_campaign(campaign);
  const std::string in = campaign.folder.string();
  const tests::Outcome outcome = tests::shell("\"$TOFGRAPH\" diagnose --model " + in + "/model.yaml --data " + in +
                                                  "/campaign.yaml -o " + (folder_ / "gap").string(),
                                              folder_);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  Physics with, without;
  with.effects = campaign.effects;
  Harness stage("model_correction model=" + (folder_ / "gap/model.yaml").string());
  stage.camera("camcube2");
  for (const double distance : {0.87, 1.63, 2.71, 3.86, 5.2, 6.3}) {
    View view;
    view.distance = distance;
    view.reflectivity = 0.37;
    view.integration_time = 3e-3;
    const Decoded seen = photograph(with, view), ideal = photograph(without, view);
    const Floats result = corrected(stage, seen, view);
    const auto flags = stage.get<std::uint16_t>("flags");
    const double effect = mean_difference(seen.distance, ideal.distance, flags);
    const double left = mean_difference(result, ideal.distance, flags);
    EXPECT_LE(left, 0.1 * effect) << distance << " m, effect " << effect << " m";
    show("found", distance, effect, left);
  }
}

/// With noise: the scatter of a pixel's distances equals that without the effect, and sigma agrees with it.
TEST_F(ModelCorrection, KeepsTheNoise) {
  for (const char* effect : {"wiggling", "phase_step_error", "zero_offset", "amplitude_walk", "crosstalk",
                             "integration_time_offset", "fixed_pattern", "modulation_frequency"}) {
    Physics with, without;
    with.maps = maps();
    with.effects.add_typical(effect, 2, 13, Drawn::plain);
    Harness stage("model_correction model=" + model_of(with));
    stage.camera("camcube2");
    View view = boards()[1];
    view.distance = 1.0;
    const Taps with_effect = expected_taps(with, view), without_it = expected_taps(without, view);
    std::mt19937_64 random(5), other(6);
    Statistics before, after;
    double sigma = 0;
    constexpr int frames = 24;
    for (int frame = 0; frame < frames; ++frame) {
      const Decoded seen = photograph(with, with_effect, &random);
      Floats known(seen.amplitude.size());
      for (std::size_t i = 0; i < known.size(); ++i) known[i] = noise_of(with.camera, seen.amplitude[i]);
      stage.put<float>("sigma", {204, 204}, known, {.of = "distance"});
      after.add(corrected(stage, seen, view));
      for (const float value : stage.get<float>("sigma")) sigma += value * value / 41616.0 / frames;
      before.add(photograph(without, without_it, &other).distance);
    }
    EXPECT_NEAR(after.sd() / before.sd(), 1, 0.03) << effect;
    EXPECT_NEAR(std::sqrt(sigma) / after.sd(), 1, 0.03) << effect;
  }
}

/// Lens, principal point and sources are passed on as a camera with which the boards have their true positions.
TEST_F(ModelCorrection, GeometryLeavesAsACamera) {
  for (const char* effect : {"lens_distortion", "principal_point", "source_position"}) {
    Physics with;
    with.effects.add_typical(effect, 2, 14);
    Harness stage("model_correction model=" + model_of(with));
    stage.camera("camcube2");
    for (View view : boards()) {
      view.tilt_x = 0;
      const Floats result = corrected(stage, photograph(with, view), view);
      double error = 0, nominal = 0;
      for (std::size_t i = 0; i < result.size(); i += 7) {
        error += std::abs(depth_of(stage.camera_out(), i, result[i]) - view.distance) / (41616 / 7);
        nominal += std::abs(depth_of(stage.camera(), i, result[i]) - view.distance) / (41616 / 7);
      }
      EXPECT_LE(error, std::max(0.02 * nominal, 1e-4)) << effect << " at " << view.distance << " m";
      show(effect, view.distance, nominal, error);
    }
  }
}

/// A bright box near the camera in front of a dark wall; the scattered light is added here, from its formula.
TEST_F(ModelCorrection, TakesStrayLightOffTheImage) {
  const Physics plain;
  Physics with;
  with.effects.add("stray_light", {{"fraction", 0.06}, {"width", 35}, {"uniform", 0.5}});
  View box, wall;
  box.distance = 0.6;
  wall.distance = 2.5;
  wall.reflectivity = 0.1;
  const PhasorImage near = light_on_sensor(plain, box, 0).phasor, far = light_on_sensor(plain, wall, 0).phasor;
  PhasorImage clean(near.size());
  for (std::size_t i = 0; i < clean.size(); ++i) {
    const bool on_box = i % 204 >= 60 && i % 204 < 130 && i / 204 >= 70;
    clean[i] = on_box ? near[i] : far[i];
  }
  const Decoded ideal = decoded(clean), seen = decoded(scattered(clean, 0.06, 35, 0.5));
  Harness stage("model_correction model=" + model_of(with));
  stage.camera("camcube2");
  const Floats result = corrected(stage, seen, wall);
  const auto flags = stage.get<std::uint16_t>("flags");
  EXPECT_EQ(std::ranges::count(flags, 0), 204 * 204);
  const double effect = mean_difference(seen.distance, ideal.distance, flags);
  const double left = mean_difference(result, ideal.distance, flags);
  EXPECT_GT(effect, 0.05);
  EXPECT_LE(left, 1e-4);
  show("stray_light", 2.5, effect, left);
  // With noise the scatter equals that without stray light, to 10 %.
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal(0, 3);  // counts
  const PhasorImage dirty = scattered(clean, 0.06, 35, 0.5);
  Statistics before, after;
  for (int frame = 0; frame < 8; ++frame) {
    PhasorImage without(clean), with_noise(dirty);
    for (std::size_t i = 0; i < clean.size(); ++i) {
      const std::complex<double> noise(normal(random), normal(random));
      without[i] += noise;
      with_noise[i] += noise;
    }
    before.add(decoded(without).distance);
    after.add(corrected(stage, decoded(with_noise), wall));
  }
  EXPECT_NEAR(after.sd() / before.sd(), 1, 0.1);
}

TEST_F(ModelCorrection, LeavesWhatCannotBeUndone) {
  const std::filesystem::path file = folder_ / "left.yaml";
  std::ofstream(file) << "model: 1\ncamera: camcube2\neffects:\n  - {effect: mixed_pixels, blur: 0.7 px}\n"
                         "  - {effect: board_tilt, x: 5 mrad}\n  - {effect: ambient_light, rate: 1e5 counts/s}\n";
  Harness stage("model_correction model=" + file.string());
  stage.camera("camcube2");
  View view;
  const Decoded seen = photograph(Physics(), view);
  EXPECT_EQ(corrected(stage, seen, view), seen.distance);
}

TEST_F(ModelCorrection, RefusesAModelWhoseDistanceFalls) {
  const std::filesystem::path file = folder_ / "folded.yaml";
  std::ofstream(file) << "model: 1\ncamera: camcube2\neffects:\n  - {effect: wiggling, amplitude: 500 mm}\n"
                         "  - {effect: tap_mismatch, ratio: 2 %}\n";
  Harness stage("model_correction model=" + file.string());
  stage.camera("camcube2");
  stage.put<float>("distance", {204, 204}, Floats(41616, 1));
  try {
    stage.run();
    FAIL() << "was not refused";
  } catch (const std::exception& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("the measured distance falls while the true one rises"));
    EXPECT_THAT(error.what(), testing::HasSubstr("by the effect wiggling"));
  }
}

/// Frames must contain the quantities that the model depends on, else they are rejected.
TEST_F(ModelCorrection, NeedsWhatItsEffectsDependOn) {
  const auto refusal = [&](const char* effect, const std::function<void(Harness&)>& spoil) -> std::string {
    Physics with;
    with.effects.add_typical(effect, 1, 15);
    Harness stage("model_correction model=" + model_of(with));
    stage.camera("camcube2");
    stage.put<float>("distance", {204, 204}, Floats(41616, 1));
    spoil(stage);
    try {
      stage.run();
      return "";
    } catch (const std::exception& error) {
      return error.what();
    }
  };
  const auto nothing = [](Harness&) {};
  EXPECT_EQ(refusal("zero_offset", nothing), "");
  EXPECT_THAT(refusal("amplitude_walk", nothing), testing::HasSubstr("depend on the amplitude, which does not arrive"));
  EXPECT_THAT(refusal("integration_time_offset", [](Harness& stage) { stage.known(0); }),
              testing::HasSubstr("depend on the integration time, which these frames do not tell"));
  const auto no_power_on = [](Harness& stage) {
    stage.metadata().integration_time = 1e-3;  // also affects its heating
    stage.metadata().time_since_power_on = std::nan("");
  };
  EXPECT_THAT(refusal("warm_up", no_power_on), testing::HasSubstr("the frame does not tell its time since power-on"));
}

}  // namespace
}  // namespace tofgraph::hidden
