// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Effects with moving scenes, with several frequencies, and with more than four images.
#include <gtest/gtest.h>

#include "tests/unit/effect_exposures.hpp"
#include "tests/unit/effect_fixture.hpp"
#include "tests/unit/effect_formulas.hpp"

using namespace tofgraph;
using namespace tofgraph::test;

namespace {

TEST(AnyExposures, AMovingSceneIsSeenElsewhereInEachImage) {
  for (const Exposures& exposures : {three(), nine()}) {
    const ExposedCamera camera(exposures);
    View view;
    view.camera = &camera.view();
    view.board = {1.2, 0, 0, 0.85, 0, 0.4};
    view.acquisition.moving = true;
    const Samples real = samples("", view, camera);
    view.acquisition.moving = false;
    const auto count = static_cast<double>(exposures.size());
    for (std::size_t k = 0; k < exposures.size(); ++k) {
      View there = view;  // 80 frames/s
      there.board.distance += 0.4 * static_cast<double>(k) / (count * 80);
      const Samples still = samples("", there, camera);
      for (std::size_t i = 0; i < pixels; ++i)
        EXPECT_NEAR(real.c[k][i], still.c[k][i], 1e-9 * still.intensity[k][i]) << k;
    }
  }
}

// Several frequencies.

TEST(SeveralFrequencies, ALengthIsAnotherAngleAndAnAngleIsNot) {
  constexpr double slow = 16e6, fast = 80e6;
  const ExposedCamera camera(steps({0, 120, 240}, {fast, slow}));
  View view = view_of(camera);
  view.acquisition.on = {false, true};  // one source: its phase is that of its path
  const Samples ideal = samples("", view, camera);
  const auto with = [&](const std::string& list) { return samples("{effect: " + list + "}", view, camera); };
  const Samples wiggling = with("wiggling, amplitude5: 5 mm, phase5: 0.4 rad"),
                multipath = with("multipath, strength: 5 %, extra_path: 0.8 m"),
                warm_up = with("warm_up, drift: 10 mm, time_constant: 700 s"),
                crystal = with("modulation_frequency, error: 500 ppm"),
                crosstalk = with("crosstalk, real: 3000 counts/s, imaginary: -2000 counts/s"),
                source = with("source_phase, difference: 100 mrad");
  for (const double f : {slow, fast}) {
    const double radians = 4 * pi * f / c_light;
    for (std::size_t i = 0; i < pixels; ++i) {
      const Complex p = ideal.phasor(i, f);
      const double a = std::abs(p);
      const auto turn = [&](const Samples& real) { return std::arg(real.phasor(i, f) / p); };
      EXPECT_LT(std::abs(wiggling.phasor(i, f) - p - 5e-3 * radians * a * std::polar(1.0, -(5 * std::arg(p) + 0.4))),
                1e-9 * a);
      const double delta = 2 * pi * f * 0.8 / c_light;
      EXPECT_NEAR(turn(multipath), std::atan2(0.05 * std::sin(delta), 1 + 0.05 * std::cos(delta)), 1e-9);
      EXPECT_NEAR(turn(warm_up), 10e-3 * warm(700) * radians, 1e-9);
      const World world;
      const Spot at = spot(world, view.pixels.at[2 * i], view.pixels.at[2 * i + 1]);
      const double path = physics::norm(at.at - world.sources[1]) + at.back;
      EXPECT_NEAR(turn(crystal), 500e-6 * radians * path / 2, 1e-9);
      EXPECT_LT(std::abs(crosstalk.phasor(i, f) - p - Complex(6, -4)), 1e-9 * a);
      EXPECT_NEAR(turn(source), 0.05, 1e-9);
    }
  }
}

// Images from 4 on.

TEST(Further, AreTheImagesFromFourOn) {
  const ExposedCamera camera(nine());
  const View view = view_of(camera);
  const Samples ideal = samples("", view, camera);
  const Samples stepped = samples(
      "{effect: phase_step_error, step1: 1 mrad, step2: 2 mrad, step3: 3 mrad, further: [4 mrad, 5 mrad, -6 mrad]}",
      view, camera);
  const Samples gained =
      samples("{effect: phase_gain, gain1: 1 %, gain2: 2 %, gain3: 3 %, further: [0.04, 0.05, -0.06, 0.07, 0.08]}",
              view, camera);
  const double errors[] = {0, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3, -6e-3, 0, 0};
  const double gains[] = {1, 1.01, 1.02, 1.03, 1.04, 1.05, 0.94, 1.07, 1.08};
  for (std::size_t k = 0; k < 9; ++k) {
    for (std::size_t i = 0; i < pixels; ++i) {
      const Complex p = ideal.phasor(i, camera.frequency(k));
      const double light = ideal.intensity[k][i];
      const double c = std::abs(p) * std::cos(std::arg(p) + nine()[k].phase + errors[k]);
      EXPECT_NEAR(stepped.c[k][i], c, 1e-9 * light) << k;
      EXPECT_NEAR(stepped.intensity[k][i], light, 1e-9 * light) << k;
      EXPECT_NEAR(gained.c[k][i], gains[k] * ideal.c[k][i], 1e-9 * light) << k;
      EXPECT_NEAR(gained.intensity[k][i], gains[k] * light, 1e-9 * light) << k;
    }
  }
}

TEST(Further, OfMoreImagesThanThereAreIsRefused) {
  const auto problem = [](const std::string& list, const Exposures& exposures) {
    const ExposedCamera camera(exposures);
    try {
      effects(list, camera.view());
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  const Exposures five = steps({10, 63, 150, 215, 301});
  for (const std::string effect : {"phase_step_error", "phase_gain"}) {
    const std::string unit = effect == "phase_gain" ? "" : " rad", begin = "{effect: " + effect + ", further: [";
    const std::string one = begin + "0.01" + unit + "]}", two = begin + "0.01" + unit + ", 0.02" + unit + "]}";
    EXPECT_EQ(problem(one, five), "none");
    EXPECT_EQ(problem(two, nine()), "none");
    EXPECT_NE(problem(two, five).find("has 2 values, but the camera takes 5 images"), std::string::npos)
        << problem(two, five);
    EXPECT_NE(problem(two, five).find("further"), std::string::npos);
    EXPECT_NE(problem(one, three()).find("has 1 values, but the camera takes 3 images"), std::string::npos)
        << problem(one, three());
    EXPECT_NE(problem(one, steps({0, 90, 180, 270})).find("takes 4 images"), std::string::npos);
  }
  for (const char* third : {"{effect: phase_step_error, step3: 1 mrad}", "{effect: phase_gain, gain3: 1 %}"})
    EXPECT_NE(problem(third, three()).find("is that of image 3, but the camera takes 3"), std::string::npos);
}

}  // namespace
