// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Boards.UndoesAllOfThemTogether:ModelCorrection.UndoesAnEffect*
// Rooms: simulation plugins
// Distance errors from the plain camera's effects, removed by model_correction: single, combined, and unknown ones.
#include "tests/hidden_effects/model_correction_fixture.hpp"

namespace tofgraph::hidden {
namespace {

/// Expects at most 2 % of the error and 5 um over the pixels that are not flagged.
void expect_little_is_left(const char* what, Harness& stage, const Decoded& seen, const Decoded& ideal,
                           const View& view) {
  const Floats result = corrected(stage, seen, view);
  const auto flags = stage.get<std::uint16_t>("flags");
  const double effect = mean_difference(seen.distance, ideal.distance, flags);
  const double left = mean_difference(result, ideal.distance, flags);
  EXPECT_LE(left, 0.02 * effect + 5e-6) << view.distance << " m, effect " << effect << " m";
  show(what, view.distance, effect, left);
}

/// Images of the boards by the camera without effects, shared by all tests.
class Boards : public ModelCorrection {
 protected:
  static void SetUpTestSuite() {
    if (!ideal.empty()) return;
    for (const View& view : boards()) ideal.push_back(photograph(Physics(), view));
  }

  static inline std::vector<Decoded> ideal;
};

class OfEachEffect : public Boards, public testing::WithParamInterface<const char*> {};

/// Twice the typical amplitude: the remaining error is at most 2 % of it and 5 um, also if the error is small.
TEST_P(OfEachEffect, LeavesTwoPerCent) {
  Physics with;
  with.maps = maps();
  with.effects.add_typical(GetParam(), 2, 11);
  Harness stage("model_correction model=" + model_of(with));
  stage.camera("camcube2");
  const std::vector<View> views = boards();
  for (std::size_t i = 0; i < views.size(); ++i) {
    expect_little_is_left(GetParam(), stage, photograph(with, views[i]), ideal[i], views[i]);
    const auto flags = stage.get<std::uint16_t>("flags");
    EXPECT_LE(std::ranges::count_if(flags, [](std::uint16_t bits) { return bits != 0; }), 204 * 204 / 20);
  }
}

INSTANTIATE_TEST_SUITE_P(Camera, OfEachEffect, testing::ValuesIn(single),
                         [](const auto& effect) { return std::string(effect.param); });

/// All but modulation_frequency, which changes only the phase of the sources' light in the plain camera and that of all
/// light in the model: with light from inside the camera the two differ slightly.
TEST_F(Boards, UndoesAllOfThemTogether) {
  Physics with;
  with.maps = maps();
  for (const std::string effect : single)
    if (effect != "modulation_frequency") with.effects.add_typical(effect, 2, 12);
  Harness stage("model_correction model=" + model_of(with));
  stage.camera("camcube2");
  const std::vector<View> views = boards();
  for (std::size_t i = 0; i < views.size(); ++i)
    expect_little_is_left("all", stage, photograph(with, views[i]), ideal[i], views[i]);
}

/// Light of the haze at a pixel in counts per second, in steps of 1 mm from 0.5 m on, summed once.
class Glow {
 public:
  /// @param path to the board, m
  std::complex<double> until(double path) {
    constexpr double first = 0.5005, step = 0.001;  // m
    const auto steps = static_cast<std::size_t>(std::max(0.0, std::ceil((path - first) / step)));
    while (sums_.size() <= steps) {
      const double at = first + step * static_cast<double>(sums_.size() - 1);
      sums_.push_back(sums_.back() +
                      std::polar(3000 * step * std::exp(-0.1 * at) / (at * at), at / Camera().metres_per_radian()));
    }
    return sums_[steps];
  }

 private:
  std::vector<std::complex<double>> sums_{0};
};

/// A third-party effect, with its light implemented here: decoded phasors of a board behind haze.
TEST_F(ModelCorrection, UndoesAnEffectThatItDoesNotKnow) {
  const std::filesystem::path file = folder_ / "haze.yaml";
  std::ofstream(file) << "model: 1\ncamera: camcube2\neffects:\n"
                         "  - {effect: haze, extinction: 0.05 1/m, glow: 3000 counts/s}\n";
  const std::string folder = TOFGRAPH_BINARY_DIR "/tests/other_effects";
  Harness stage("model_correction model=" + file.string(), {folder});
  stage.camera("camcube2");
  Glow glow;
  for (const View& view : boards()) {
    PhasorImage light = light_on_sensor(Physics(), view, 0).phasor;
    const Decoded ideal = decoded(light);
    for (std::size_t i = 0; i < light.size(); ++i) {
      const double path = return_path(i, view);
      light[i] = light[i] * std::exp(-0.1 * path) + view.integration_time * glow.until(path);
    }
    const Decoded seen = decoded(light);
    expect_little_is_left("haze", stage, seen, ideal, view);
  }
}

}  // namespace
}  // namespace tofgraph::hidden
