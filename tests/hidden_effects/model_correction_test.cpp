// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What the plain camera's effects do to its distances, undone by model_correction: each, all together, unknown ones.
#include "tests/hidden_effects/model_correction_fixture.hpp"

namespace tofgraph::hidden {
namespace {

/// At most 2 % of the error and 5 um, over the pixels that are not flagged.
void expect_little_is_left(const char* what, Harness& stage, const Decoded& seen, const Decoded& ideal,
                           const View& view) {
  const Floats result = corrected(stage, seen, view);
  const auto flags = stage.get<std::uint16_t>("flags");
  const double effect = mean_difference(seen.distance, ideal.distance, flags);
  const double left = mean_difference(result, ideal.distance, flags);
  EXPECT_LE(left, 0.02 * effect + 5e-6) << view.distance << " m, effect " << effect << " m";
  show(what, view.distance, effect, left);
}

class OfEachEffect : public ModelCorrection, public testing::WithParamInterface<const char*> {};

/// Twice the typical size: what is left of the error is at most 2 % of it and 5 um, also where it is small.
TEST_P(OfEachEffect, LeavesTwoPerCent) {
  Physics with, without;
  with.maps = maps();
  with.effects.add_typical(GetParam(), 2, 11);
  Harness stage("model_correction model=" + model_of(with));
  stage.camera("camcube2");
  for (const View& view : boards()) {
    const Decoded seen = photograph(with, view), ideal = photograph(without, view);
    expect_little_is_left(GetParam(), stage, seen, ideal, view);
    const auto flags = stage.get<std::uint16_t>("flags");
    EXPECT_LE(std::ranges::count_if(flags, [](std::uint16_t bits) { return bits != 0; }), 204 * 204 / 20);
  }
}

INSTANTIATE_TEST_SUITE_P(Camera, OfEachEffect, testing::ValuesIn(single),
                         [](const auto& effect) { return std::string(effect.param); });

/// All but modulation_frequency, which turns in the plain camera the light of the sources alone and in the model all of
/// it: beside light from inside that is not quite the same.
TEST_F(ModelCorrection, UndoesAllOfThemTogether) {
  Physics with, without;
  with.maps = maps();
  for (const std::string effect : single)
    if (effect != "modulation_frequency") with.effects.add_typical(effect, 2, 12);
  Harness stage("model_correction model=" + model_of(with));
  stage.camera("camcube2");
  for (const View& view : boards()) {
    const Decoded seen = photograph(with, view), ideal = photograph(without, view);
    expect_little_is_left("all", stage, seen, ideal, view);
  }
}

/// An effect of somebody else's, with the light written here: decoded phasors of a board behind haze.
TEST_F(ModelCorrection, UndoesAnEffectThatItDoesNotKnow) {
  const std::filesystem::path file = folder_ / "haze.yaml";
  std::ofstream(file) << "model: 1\ncamera: camcube2\neffects:\n"
                         "  - {effect: haze, extinction: 0.05 1/m, glow: 3000 counts/s}\n";
  const std::string folder = TOFGRAPH_BINARY_DIR "/tests/other_effects";
  Harness stage("model_correction model=" + file.string(), {folder});
  stage.camera("camcube2");
  for (const View& view : boards()) {
    PhasorImage light = light_on_sensor(Physics(), view, 0).phasor;
    const Decoded ideal = decoded(light);
    for (std::size_t i = 0; i < light.size(); ++i) {
      const double path = return_path(i, view);
      light[i] *= std::exp(-0.1 * path);
      for (double at = 0.5 + 0.0005; at < path; at += 0.001)
        light[i] += std::polar(3000 * view.integration_time * 0.001 * std::exp(-0.1 * at) / (at * at),
                               at / Camera().metres_per_radian());
    }
    const Decoded seen = decoded(light);
    expect_little_is_left("haze", stage, seen, ideal, view);
  }
}

}  // namespace
}  // namespace tofgraph::hidden
