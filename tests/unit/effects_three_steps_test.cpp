// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Influence of harmonics, steps and gains on three samples, in closed form.
#include <gtest/gtest.h>

#include <tofgraph/physics/unwrapping.hpp>

#include <sstream>

#include "tests/unit/effect_exposures.hpp"
#include "tests/unit/effect_fixture.hpp"

using namespace tofgraph;
using namespace tofgraph::test;

namespace {

class ThreeSteps : public testing::Test {
 protected:
  Samples with(const std::string& list) const { return samples(list, view_of(camera_), camera_); }

  const ExposedCamera camera_{three()};
  const Samples ideal_ = with("");
};

double length_of(double ratio) { return ratio * c_light / (4 * pi * own); }  // m, of wiggling
std::string wiggles(int order, double ratio, double angle) {
  const std::string suffix = order == 3 ? "" : std::to_string(order);
  std::ostringstream list;
  list.precision(17);
  list << "{effect: wiggling, amplitude" << suffix << ": " << length_of(ratio) << " m, phase" << suffix << ": " << angle
       << " rad}";
  return list.str();
}

TEST_F(ThreeSteps, TheThirdHarmonicIsAnOffset) {
  // 3 * 120 deg is a full turn: the same in all three.
  const Samples real = with(wiggles(3, 0.03, 0.7));
  const physics::PhaseDecoding decode(three(), own);
  for (std::size_t i = 0; i < pixels; ++i) {
    const Complex p = ideal_.phasor(i);
    const double a = std::abs(p), offset = 0.03 * a * std::cos(3 * std::arg(p) + 0.7);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(real.c[k][i] - ideal_.c[k][i], offset, 1e-9 * a);
    EXPECT_LT(std::abs(real.phasor(i) - p), 1e-9 * a);
    EXPECT_NEAR(real.mean(i), offset, 1e-9 * a);
    const auto before = decode({ideal_.c[0][i], ideal_.c[1][i], ideal_.c[2][i]}),
               after = decode({real.c[0][i], real.c[1][i], real.c[2][i]});
    EXPECT_NEAR(after.distance, before.distance, 1e-9);
    EXPECT_NEAR(after.amplitude, before.amplitude, 1e-9 * a);
  }
}

TEST_F(ThreeSteps, TheFifthAndSeventhHarmonicsAreTurnsInSixCycles) {
  // 5 * 120 deg is -120 deg: the conjugate; 7 * 120 deg is 120 deg.
  const double m = 0.01;
  const Samples fifth = with(wiggles(5, m, -1.1)), seventh = with(wiggles(7, m, 0.3));
  for (std::size_t i = 0; i < pixels; ++i) {
    const Complex p = ideal_.phasor(i);
    const double a = std::abs(p), psi = std::arg(p);
    EXPECT_LT(std::abs(fifth.phasor(i) - p - m * a * std::polar(1.0, -(5 * psi - 1.1))), 1e-9 * a);
    EXPECT_LT(std::abs(seventh.phasor(i) - p - m * a * std::polar(1.0, 7 * psi + 0.3)), 1e-9 * a);
    EXPECT_NEAR(fifth.mean(i), 0, 1e-9 * a);
    EXPECT_NEAR(seventh.mean(i), 0, 1e-9 * a);
    // To first order; the second is half of m^2.
    EXPECT_NEAR(std::arg(fifth.phasor(i) / p), -m * std::sin(6 * psi - 1.1), m * m);
    EXPECT_NEAR(std::abs(fifth.phasor(i)) / a - 1, m * std::cos(6 * psi - 1.1), m * m);
    EXPECT_NEAR(std::arg(seventh.phasor(i) / p), m * std::sin(6 * psi + 0.3), m * m);
    EXPECT_NEAR(std::abs(seventh.phasor(i)) / a - 1, m * std::cos(6 * psi + 0.3), m * m);
  }
}

TEST_F(ThreeSteps, TheSecondHarmonicIsATurnInThreeCycles) {
  // Four samples show it in N2 only; 2 * 120 deg is -120 deg.
  const double m = 0.02;
  const Samples real = with("{effect: even_harmonic, ratio: 0.02}");
  for (std::size_t i = 0; i < pixels; ++i) {
    const Complex p = ideal_.phasor(i);
    const double a = std::abs(p), psi = std::arg(p);
    EXPECT_LT(std::abs(real.phasor(i) - p - m * a * std::polar(1.0, -2 * psi)), 1e-9 * a);
    EXPECT_NEAR(real.mean(i), 0, 1e-9 * a);
    EXPECT_NEAR(std::arg(real.phasor(i) / p), -m * std::sin(3 * psi), m * m);
  }
}

TEST_F(ThreeSteps, ErrorsOfStepsAndGainsAreTheirMeanAndTwoCycles) {
  const Samples stepped = with("{effect: phase_step_error, step1: 10 mrad, step2: -4 mrad}"),
                gained = with("{effect: phase_gain, gain1: 1 %, gain2: -0.5 %}");
  const double errors[] = {0, 0.010, -0.004}, gains[] = {0, 0.010, -0.005};
  for (std::size_t i = 0; i < pixels; ++i) {
    const Complex p = ideal_.phasor(i);
    const double psi = std::arg(p);
    double turned_by_steps = 0, turned_by_gains = 0, more = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double twice = 2 * (psi + static_cast<double>(k) * 2 * pi / 3);
      turned_by_steps += errors[k] * (1 - std::cos(twice)) / 3;
      turned_by_gains -= gains[k] * std::sin(twice) / 3;
      more += gains[k] * (1 + std::cos(twice)) / 3;
      EXPECT_NEAR(stepped.intensity[k][i], ideal_.intensity[k][i], 1e-9 * ideal_.intensity[k][i]);
      EXPECT_NEAR(gained.intensity[k][i], (1 + gains[k]) * ideal_.intensity[k][i], 1e-9 * ideal_.intensity[k][i]);
    }
    EXPECT_NEAR(std::arg(stepped.phasor(i) / p), turned_by_steps, 1e-4) << "to first order";
    EXPECT_NEAR(std::arg(gained.phasor(i) / p), turned_by_gains, 1e-4);
    EXPECT_NEAR(std::abs(gained.phasor(i) / p) - 1, more, 1e-4);
  }
}

TEST_F(ThreeSteps, TapsThatDifferAddTheLightToTheMean) {
  const Samples real = with("{effect: tap_mismatch, ratio: 4 %}"),
                lit = with("{effect: ambient_light, rate: 2e5 counts/s}");
  for (std::size_t i = 0; i < pixels; ++i) {
    const double light = ideal_.intensity[0][i];
    EXPECT_NEAR(real.mean(i), 0.04 * light, 1e-9 * light);
    EXPECT_LT(std::abs(real.phasor(i) - ideal_.phasor(i)), 1e-9 * light);
    EXPECT_LT(std::abs(lit.phasor(i) - ideal_.phasor(i)), 1e-9 * light);
    EXPECT_NEAR(lit.intensity[2][i], light + 200, 1e-9 * light);
  }
}

TEST_F(ThreeSteps, AConverterOfThirdOrderMakesNoErrorOfThePhase) {
  // A^2 - B^2 = 2 I c; A^3 - B^3 = 3 I^2 c + c^3/4, and c^3 has a first and a third harmonic: the third is an offset.
  const Samples real = with("{effect: adc_nonlinearity, quadratic: 10 %, cubic: 20 %}");
  const double fs = 30000;
  for (std::size_t i = 0; i < pixels; ++i) {
    const Complex p = ideal_.phasor(i);
    const double a = std::abs(p), light = ideal_.intensity[0][i];
    const double less = 0.1 * 2 * light / fs + 0.2 * (3 * light * light + 3 * a * a / 16) / (fs * fs);
    EXPECT_LT(std::abs(real.phasor(i) - (1 - less) * p), 1e-9 * a);
    EXPECT_NEAR(real.mean(i), -0.2 * a * a * a / 16 * std::cos(3 * std::arg(p)) / (fs * fs), 1e-9 * a);
  }
}

}  // namespace
