// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Arbitrary exposures of one frequency, compared with least squares by Eigen and with random draws of the noise.
#include "diagnosis/data/observables.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

namespace tofgraph::diagnosis {
namespace {

physics::Exposures steps(const std::vector<double>& degrees, double frequency = 0) {
  physics::Exposures all;
  for (const double d : degrees) all.push_back({d * M_PI / 180, frequency});
  return all;
}
const std::vector<std::vector<double>> several = {
    {0, 90, 180, 270}, {0, 180, 90, 270}, {0, 120, 240}, {10, 95, 200, 250, 320}, {0, 45, 90, 135, 180, 225, 270, 315}};

TEST(Demodulation, IsLeastSquares) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (const auto& degrees : several) {
    const Demodulation demodulation(steps(degrees));
    const auto n = static_cast<Eigen::Index>(degrees.size());
    Eigen::MatrixXd design(n, 3);
    Eigen::VectorXd samples(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double theta = degrees[static_cast<std::size_t>(k)] * M_PI / 180;
      design.row(k) << std::cos(theta), -std::sin(theta), 1;
      samples(k) = 1000 * normal(random);
    }
    const Eigen::Vector3d expected = design.colPivHouseholderQr().solve(samples);
    const Signal signal = demodulation.of_samples({samples.data(), degrees.size()}, 17);
    EXPECT_NEAR(signal.phasor.real(), expected(0), 1e-9);
    EXPECT_NEAR(signal.phasor.imag(), expected(1), 1e-9);
    EXPECT_NEAR(signal.null1, expected(2), 1e-9);
    EXPECT_EQ(signal.intensity, 17);
    // Residual of the first image, in units of its standard deviation.
    const Eigen::VectorXd left = samples - design * expected;
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(n, 0);
    const Eigen::VectorXd free = unit - design * design.colPivHouseholderQr().solve(unit);
    EXPECT_EQ(demodulation.has_null2(), n > 3);
    EXPECT_NEAR(signal.null2, n > 3 ? left(0) / free.norm() / std::sqrt(static_cast<double>(n)) : 0, 1e-9);
  }
}

TEST(Demodulation, OfFourStepsGivesTheNullChannelsOfTheReference) {
  const std::vector<double> taps = {900, 100, 700, 200, 400, 650, 500, 350};  // A0 B0 A1 B1 ..
  const Signal signal = Demodulation(steps(several[0])).of_taps(taps.data(), 1);
  const double c0 = 800, c1 = 500, c2 = -250, c3 = 150;
  EXPECT_NEAR(signal.phasor.real(), (c0 - c2) / 2, 1e-9);
  EXPECT_NEAR(signal.phasor.imag(), (c3 - c1) / 2, 1e-9);
  EXPECT_NEAR(signal.null1, (c0 + c1 + c2 + c3) / 4, 1e-9);
  EXPECT_NEAR(signal.null2, (c0 - c1 + c2 - c3) / 4, 1e-9);
  EXPECT_NEAR(signal.intensity, 3800.0 / 8, 1e-9);
}

TEST(Demodulation, KnowsItsNoise) {
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  for (const auto& degrees : several) {
    const Demodulation demodulation(steps(degrees));
    const std::complex<double> direction = std::polar(1.0, 0.7);
    double along = 0, across = 0, null1 = 0, null2 = 0;
    constexpr int draws = 40000;  // relative error of a variance: 0.7 %
    std::vector<double> samples(degrees.size());
    for (int i = 0; i < draws; ++i) {
      for (double& sample : samples) sample = normal(random);
      const Signal signal = demodulation.of_samples(samples, 0);
      const std::complex<double> turned = signal.phasor * std::conj(direction);
      along += turned.real() * turned.real() / draws;
      across += turned.imag() * turned.imag() / draws;
      null1 += signal.null1 * signal.null1 / draws;
      null2 += signal.null2 * signal.null2 / draws;
    }
    const auto variance = demodulation.variance(5.0 * direction);
    EXPECT_NEAR(along / variance.along, 1, 0.03);
    EXPECT_NEAR(across / variance.across, 1, 0.03);
    EXPECT_NEAR(null1 / demodulation.null1_variance(), 1, 0.03);
    if (demodulation.has_null2()) {
      EXPECT_NEAR(null2 / demodulation.null2_variance(), 1, 0.03);
    }
  }
}

TEST(Demodulation, RefusesWhatIsNoPhaseOfOneFrequency) {
  const auto message = [](const physics::Exposures& exposures) -> std::string {
    try {
      const Demodulation demodulation(exposures);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  physics::Exposures two = steps({0, 120, 240}, 80e6);
  for (const auto& exposure : steps({0, 120, 240}, 60e6)) two.push_back(exposure);
  EXPECT_NE(message(two).find("a search needs exposures of one frequency; there are 6 exposures"), std::string::npos)
      << message(two);
  EXPECT_NE(message(steps({0, 180, 360})).find("only 2 different ones"), std::string::npos);
}

}  // namespace
}  // namespace tofgraph::diagnosis
