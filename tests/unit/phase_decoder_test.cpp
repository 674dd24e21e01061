// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Any exposures: against QR in double, exhaustive unwrapping in double, the closed form of wrong wraps, and the noise.
#include <gtest/gtest.h>
#include <tofgraph/channels.hpp>
#include <tofgraph/harness.hpp>

#include <Eigen/Dense>

#include "tests/unit/cameras.hpp"
#include "tests/unit/processors.hpp"

#include <cmath>
#include <random>

using namespace tofgraph;

namespace {

constexpr double c_light = 299792458.0, pi = 3.14159265358979323846, deg = pi / 180;
using Steps = std::vector<tofgraph_exposure>;

/// Three steps of 120 degrees at each frequency.
Steps three_at(const std::vector<double>& frequencies, int steps = 3) {
  Steps all;
  for (const double frequency : frequencies)
    for (int k = 0; k < steps; ++k) all.push_back({k * 2 * pi / steps, frequency});
  return all;
}
const std::vector<double> nine_images = {80e6, 16e6, 120e6};

double range_of(double frequency) { return c_light / (2 * frequency); }

/// One row of pixels.
struct Scene {
  std::vector<double> distances;
  double amplitude = 1000;  // counts
  double noise = 0;         // counts, sd of a sample
  unsigned seed = 1;
};

template <class T = float> std::vector<T> samples_of(const Steps& steps, const Scene& scene) {
  std::mt19937 generator(scene.seed);
  std::normal_distribution<double> normal;
  std::vector<T> samples;
  for (const auto& step : steps) {
    for (const double d : scene.distances) {
      const double c = scene.amplitude * std::cos(4 * pi * step.frequency * d / c_light + step.phase);
      samples.push_back(static_cast<T>(c + scene.noise * normal(generator)));
    }
  }
  return samples;
}

/// Rows of an image that has so many pixels.
std::size_t rows_of(std::size_t pixels) {
  std::size_t rows = 1;
  while (pixels / rows > 16000 || pixels % rows != 0) ++rows;
  return rows;
}

/// @param read_noise of a tap, counts
std::string profile(const Steps& steps, std::size_t pixels, double read_noise = 1) {
  static std::vector<std::unique_ptr<test::Camera>> cameras;
  auto& camera = *cameras.emplace_back(std::make_unique<test::Camera>(
      static_cast<std::uint32_t>(pixels / rows_of(pixels)), static_cast<std::uint32_t>(rows_of(pixels)), 12.8e-3, 40e-6,
      std::vector<tofgraph_light>{{"lamp", {0, 0, 0}, 1}}));
  camera.view.exposures = steps.data();
  camera.view.exposure_size = sizeof(tofgraph_exposure);
  camera.view.exposure_count = steps.size();
  camera.view.modulation_frequency = !steps.empty() && steps[0].frequency > 0 ? steps[0].frequency : 20e6;
  camera.view.read_noise = read_noise;
  camera.view.shot_noise = 0;
  return test::profile_of(camera.view);
}

struct Decoded {
  std::vector<float> distance, amplitude, sigma;
  std::vector<std::uint16_t> flags;
};

template <class T = float>
Decoded decode(const std::string& stage, const Steps& steps, const std::vector<T>& samples, double read_noise = 1) {
  const std::size_t pixels = samples.size() / steps.size();
  Harness harness(stage);
  harness.camera(profile(steps, pixels, read_noise));
  harness.put<T>("phases", {steps.size(), rows_of(pixels), pixels / rows_of(pixels)}, samples);
  harness.run();
  return {harness.get<float>("distance"), harness.get<float>("amplitude"), harness.get<float>("sigma"),
          harness.get<std::uint16_t>("flags")};
}

std::vector<double> ramp(double from, double to, std::size_t count) {
  std::vector<double> all;
  for (std::size_t i = 0; i < count; ++i)
    all.push_back(from + (to - from) * static_cast<double>(i) / static_cast<double>(count - 1));
  return all;
}

/// Least squares by QR of another library, in double: x, y, offset.
Eigen::Vector3d min_squares(const Steps& steps, const std::vector<double>& c) {
  Eigen::MatrixXd design(static_cast<Eigen::Index>(steps.size()), 3);
  Eigen::VectorXd right(design.rows());
  for (Eigen::Index k = 0; k < design.rows(); ++k) {
    const double phase = steps[static_cast<std::size_t>(k)].phase;
    design.row(k) << std::cos(phase), -std::sin(phase), 1;
    right[k] = c[static_cast<std::size_t>(k)];
  }
  return design.colPivHouseholderQr().solve(right);
}

/// The deviation of the distance by the covariance of the same fit, and the gradient of the angle.
double sigma_of(const Steps& steps, const Eigen::Vector3d& fit, double noise) {
  Eigen::MatrixXd design(static_cast<Eigen::Index>(steps.size()), 3);
  for (Eigen::Index k = 0; k < design.rows(); ++k) {
    const double phase = steps[static_cast<std::size_t>(k)].phase;
    design.row(k) << std::cos(phase), -std::sin(phase), 1;
  }
  const Eigen::Matrix3d covariance = noise * noise * (design.transpose() * design).inverse();
  const double square = fit[0] * fit[0] + fit[1] * fit[1];
  const Eigen::Vector2d gradient(-fit[1] / square, fit[0] / square);
  return c_light / (4 * pi * steps[0].frequency) * std::sqrt(gradient.dot(covariance.topLeftCorner<2, 2>() * gradient));
}

TEST(PhaseDecoder, NineImagesAreExactOverTheirWholeRange) {
  const Steps steps = three_at(nine_images);
  const double range = range_of(8e6);
  EXPECT_NEAR(range, 18.74, 0.005);
  const Scene scene{.distances = ramp(0.001, range - 0.001, 20000)};
  const auto samples = samples_of(steps, scene);
  test::on_each_processor([&](const std::string& processor) {
    const Decoded decoded = decode("phase_decoder", steps, samples);
    double worst = 0;
    for (std::size_t i = 0; i < scene.distances.size(); ++i) {
      worst = std::max(worst, std::abs(decoded.distance[i] - scene.distances[i]));
      ASSERT_EQ(decoded.flags[i], 0) << scene.distances[i] << " m, " << processor;
      ASSERT_NEAR(decoded.amplitude[i], 1000, 0.01) << processor;
    }
    RecordProperty(processor + "_worst_m", std::to_string(worst));
    EXPECT_LT(worst, 1e-4) << processor;
  });
}

TEST(PhaseDecoder, AnyStepsAreLeastSquares) {
  std::mt19937 generator(3);
  const auto even = [](int count) { return three_at({20e6}, count); };
  const Steps uneven = {{10 * deg, 20e6}, {75 * deg, 20e6}, {200 * deg, 20e6}, {290 * deg, 20e6}, {333 * deg, 20e6}};
  const Steps three_uneven = {{0, 20e6}, {80 * deg, 20e6}, {210 * deg, 20e6}};
  for (const Steps& steps : {even(3), even(5), even(8), uneven, three_uneven}) {
    const Scene scene{.distances = ramp(0.01, range_of(20e6) - 0.01, 3001), .noise = 20};
    const auto samples = samples_of(steps, scene);
    const std::size_t pixels = scene.distances.size();
    const Decoded decoded = decode("phase_decoder inconsistent_above=off", steps, samples, 20 / std::sqrt(2.0));
    double worst = 0, worst_sigma = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      std::vector<double> c;
      for (std::size_t k = 0; k < steps.size(); ++k) c.push_back(samples[k * pixels + i]);
      const Eigen::Vector3d fit = min_squares(steps, c);
      const double d = c_light / (4 * pi * 20e6) * std::atan2(fit[1], fit[0]);
      worst = std::max(worst, std::abs(std::remainder(decoded.distance[i] - d, range_of(20e6))));
      ASSERT_NEAR(decoded.amplitude[i], std::hypot(fit[0], fit[1]), 2e-3);
      worst_sigma = std::max(worst_sigma, std::abs(decoded.sigma[i] / sigma_of(steps, fit, 20) - 1));
    }
    EXPECT_LT(worst, 1e-6) << steps.size() << " steps";
    EXPECT_LT(worst_sigma, 1e-4) << steps.size() << " steps";
  }
}

TEST(PhaseDecoder, AnOffsetOfTheSamplesDoesNotMatter) {
  const Steps steps = {{0, 20e6}, {80 * deg, 20e6}, {210 * deg, 20e6}};
  const Scene scene{.distances = ramp(0.1, 7, 50)};
  auto samples = samples_of(steps, scene);
  for (float& c : samples) c += 500;
  const Decoded decoded = decode("phase_decoder", steps, samples);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_NEAR(decoded.distance[i], scene.distances[i], 2e-6);
}

/// The noise of one distance, again and again.
void expect_sigma(const Steps& steps, double distance, double noise) {
  const Scene scene{.distances = std::vector<double>(40000, distance), .noise = noise, .seed = 7};
  const Decoded decoded = decode("phase_decoder", steps, samples_of(steps, scene), noise / std::sqrt(2.0));
  double sum = 0, square = 0, sigma = 0, count = 0;
  for (std::size_t i = 0; i < scene.distances.size(); ++i) {
    if (decoded.flags[i] != 0) continue;
    const double error = decoded.distance[i] - distance;
    sum += error;
    square += error * error;
    sigma += decoded.sigma[i];
    ++count;
  }
  ASSERT_GT(count, 39000);
  const double sd = std::sqrt(square / count - sum / count * (sum / count));
  EXPECT_NEAR(sd / (sigma / count), 1, 0.03) << steps.size() << " exposures at " << distance << " m";
}

TEST(PhaseDecoder, SigmaIsTheNoise) {
  for (const double distance : {0.7, 5.21, 12.3, 18.1}) expect_sigma(three_at(nine_images), distance, 20);
  expect_sigma(three_at({80.32e6, 60.24e6}, 4), 3.3, 30);
  for (const double distance : {0.5, 1.9, 2.6, 6.1})
    expect_sigma({{0, 20e6}, {80 * deg, 20e6}, {210 * deg, 20e6}}, distance, 10);
}

/// Every combination of wraps, in double: chi-square of the best for each distance that it stands for.
struct Exhaustive {
  double distance = 0, confidence = 0;
};
Exhaustive exhaustive(const Steps& steps, const std::vector<double>& frequencies, const std::vector<double>& c,
                      double noise, double range) {
  std::vector<double> distances, weights;
  for (const double frequency : frequencies) {
    Steps own;
    std::vector<double> values;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      if (steps[k].frequency != frequency) continue;
      own.push_back(steps[k]);
      values.push_back(c[k]);
    }
    const Eigen::Vector3d fit = min_squares(own, values);
    const double scale = c_light / (4 * pi * frequency), amplitude = std::hypot(fit[0], fit[1]);
    double d = scale * std::atan2(fit[1], fit[0]);
    if (d < 0) d += range_of(frequency);
    distances.push_back(d);
    const double sd = scale * noise * std::sqrt(2.0 / static_cast<double>(own.size())) / amplitude;
    weights.push_back(1 / (sd * sd));
  }
  struct Candidate {
    double distance, chi2;
  };
  std::vector<Candidate> all;
  std::vector<int> wraps(frequencies.size(), -1);
  while (true) {
    double mean = 0, weight = 0, chi2 = 0;
    for (std::size_t b = 0; b < wraps.size(); ++b) {
      mean += weights[b] * (distances[b] + wraps[b] * range_of(frequencies[b]));
      weight += weights[b];
    }
    mean /= weight;
    for (std::size_t b = 0; b < wraps.size(); ++b)
      chi2 += weights[b] * std::pow(distances[b] + wraps[b] * range_of(frequencies[b]) - mean, 2);
    if (mean >= 0 && mean < range) all.push_back({mean, chi2});
    std::size_t b = 0;
    while (b < wraps.size() && ++wraps[b] > static_cast<int>(range / range_of(frequencies[b])) + 1) wraps[b++] = -1;
    if (b == wraps.size()) break;
  }
  const auto best = *std::ranges::min_element(all, {}, &Candidate::chi2);
  double second = 1e300;
  for (const Candidate& other : all)
    if (other.distance != best.distance) second = std::min(second, other.chi2);
  return {best.distance, 1 / (1 + std::exp((best.chi2 - second) / 2))};
}

TEST(PhaseDecoder, ChoosesTheWrapsOfAnExhaustiveSearchAndFlagsWhereTheyAreUncertain) {
  const Steps steps = three_at(nine_images);
  const double range = range_of(8e6), noise = 230;  // 0.19 rad
  Scene scene{.distances = ramp(0.3, range - 0.3, 2500), .noise = noise, .seed = 11};
  const auto samples = samples_of(steps, scene);
  const std::size_t pixels = scene.distances.size();
  const Decoded decoded =
      decode("phase_decoder invalidate_wrapped=false inconsistent_above=off", steps, samples, noise / std::sqrt(2.0));
  std::size_t flagged = 0, wrong_unflagged = 0, wrong = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    std::vector<double> c;
    for (std::size_t k = 0; k < steps.size(); ++k) c.push_back(samples[k * pixels + i]);
    const Exhaustive best = exhaustive(steps, nine_images, c, noise, range);
    const bool is_flagged = (decoded.flags[i] & flag::wrapped) != 0;
    const bool is_wrong = std::abs(decoded.distance[i] - scene.distances[i]) > 0.3;
    flagged += is_flagged ? 1 : 0;
    wrong += is_wrong ? 1 : 0;
    wrong_unflagged += is_wrong && !is_flagged ? 1 : 0;
    if (best.confidence > 0.6) {
      ASSERT_NEAR(decoded.distance[i], best.distance, 1e-3) << scene.distances[i];
    }
    // Near the limit the two differ by the phases' rounding.
    if (best.confidence > 0.9993) {
      EXPECT_FALSE(is_flagged) << scene.distances[i] << " m: " << best.confidence;
    }
    if (best.confidence < 0.9985) {
      EXPECT_TRUE(is_flagged) << scene.distances[i] << " m: " << best.confidence;
    }
  }
  EXPECT_GT(flagged, pixels / 100) << "the case is hard enough";
  EXPECT_LT(flagged, pixels / 2);
  EXPECT_LE(wrong_unflagged, pixels / 1000);
  RecordProperty("flagged", std::to_string(flagged));
  RecordProperty("wrong", std::to_string(wrong));
}

/// Jongenelen, Bailey, Payne, Dorrington, Carnegie, Analysis of errors in ToF range imaging with dual-frequency
/// modulation (IEEE Trans. Instrum. Meas. 2011): of two frequencies m g and n g with m and n coprime, the wraps are
/// wrong where the difference of the two distances is off by more than half of c / (2 g m n).
TEST(PhaseDecoder, TwoFrequenciesAreWrongAsOftenAsTheClosedFormSays) {
  const std::vector<double> frequencies = {80e6, 70e6};  // 8 and 7 times 10 MHz
  const Steps steps = three_at(frequencies, 4);
  const double noise = 160, half_step = c_light / (2 * 10e6) / 56 / 2;
  double variance = 0;
  for (const double f : frequencies) variance += std::pow(c_light / (4 * pi * f) * noise / std::sqrt(2.0) / 1000, 2);
  const double expected = std::erfc(half_step / std::sqrt(2 * variance));
  ASSERT_GT(expected, 0.002);
  ASSERT_LT(expected, 0.05);
  const Scene scene{.distances = std::vector<double>(200000, 6.5), .noise = noise, .seed = 5};
  const Decoded decoded = decode("phase_decoder invalidate_wrapped=false inconsistent_above=off", steps,
                                 samples_of(steps, scene), noise / std::sqrt(2.0));
  double wrong = 0;
  for (const float d : decoded.distance) wrong += std::abs(d - 6.5) > 0.5 ? 1 : 0;
  const double share = wrong / 200000;
  // Five standard deviations of the count, and 6 %: the phase of a noisy phasor is not quite normal.
  EXPECT_NEAR(share, expected, 5 * std::sqrt(expected / 200000) + 0.06 * expected);
}

TEST(PhaseDecoder, WithNoiseTheUnflaggedWrapsAreRight) {
  const Steps steps = three_at(nine_images);
  const Scene scene{.distances = ramp(0.2, range_of(8e6) - 0.2, 100000), .noise = 200, .seed = 23};
  const Decoded decoded = decode("phase_decoder", steps, samples_of(steps, scene), 200 / std::sqrt(2.0));
  double kept = 0, wrong = 0;
  for (std::size_t i = 0; i < scene.distances.size(); ++i) {
    if ((decoded.flags[i] & flag::wrapped) != 0) {
      ASSERT_TRUE(std::isnan(decoded.distance[i]) && (decoded.flags[i] & flag::invalid) != 0);
      continue;
    }
    ++kept;
    wrong += std::abs(decoded.distance[i] - scene.distances[i]) > 0.3 ? 1 : 0;
  }
  RecordProperty("kept", std::to_string(kept));
  RecordProperty("wrong", std::to_string(wrong));
  EXPECT_GT(kept / 1e5, 0.9);
  EXPECT_LT(kept / 1e5, 0.999) << "the case is hard enough";
  EXPECT_LE(wrong / kept, 1e-3);
}

TEST(PhaseDecoder, ABiasOfThePhasesIsAllowedFor) {
  const Steps steps = three_at(nine_images);
  const std::size_t pixels = 4000;
  const Scene scene{.distances = ramp(0.3, 18.4, pixels)};
  auto biased = samples_of(steps, scene);
  for (std::size_t k = 6; k < 9; ++k)  // 120 MHz, 0.2 rad too much
    for (std::size_t i = 0; i < pixels; ++i)
      biased[k * pixels + i] =
          static_cast<float>(1000 * std::cos(4 * pi * 120e6 * scene.distances[i] / c_light + steps[k].phase + 0.2));
  const Decoded sure = decode("phase_decoder", steps, biased),
                careful = decode("phase_decoder phase_error=0.1rad", steps, biased);
  std::size_t inconsistent = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    inconsistent += (sure.flags[i] & flag::inconsistent) != 0 ? 1 : 0;
    EXPECT_EQ(careful.flags[i], 0);
    EXPECT_NEAR(careful.distance[i], scene.distances[i], 0.1);
  }
  EXPECT_EQ(inconsistent, pixels) << "without the allowance every pixel disagrees";
}

TEST(PhaseDecoder, SamplesThatDoNotFitAreInconsistent) {
  const Steps steps = three_at({20e6}, 8);
  const std::size_t pixels = 20000;
  const double noise = 10;
  Scene scene{.distances = ramp(0.3, 7, pixels), .noise = noise};
  const auto good = samples_of(steps, scene);
  auto bad = good;
  for (std::size_t i = 0; i < pixels; ++i) bad[3 * pixels + i] += 150;
  const auto count = [&](const std::vector<float>& samples) {
    const Decoded decoded = decode("phase_decoder", steps, samples, noise / std::sqrt(2.0));
    return std::ranges::count_if(decoded.flags, [](auto f) { return (f & flag::inconsistent) != 0; });
  };
  EXPECT_LE(count(good), 2) << "five standard deviations: one of 3.5 million";
  EXPECT_EQ(count(bad), pixels);
}

TEST(PhaseDecoder, TapsGiveSaturationAndLight) {
  const Steps steps = three_at({60e6, 50e6});
  const std::size_t pixels = 3;
  std::vector<std::uint16_t> taps;
  const double d = 4.321, mean = 2000;
  for (const auto& step : steps) {
    const double c = 1000 * std::cos(4 * pi * step.frequency * d / c_light + step.phase);
    for (const double sign : {1.0, -1.0})
      for (std::size_t i = 0; i < pixels; ++i)
        taps.push_back(static_cast<std::uint16_t>(std::lround(i == 1 && sign > 0 ? 30000 : mean + sign * c / 2)));
  }
  Harness stage("phase_decoder");
  stage.camera(profile(steps, pixels));
  stage.put<std::uint16_t>("taps", {steps.size(), 2, 1, pixels}, taps);
  stage.run();
  EXPECT_NEAR(stage.get<float>("distance")[0], d, 1e-3);
  EXPECT_NEAR(stage.get<float>("intensity")[0], mean, 0.1);
  EXPECT_EQ(stage.get<std::uint16_t>("flags")[0], 0);
  EXPECT_TRUE(stage.get<std::uint16_t>("flags")[1] & flag::saturated);
  EXPECT_TRUE(std::isnan(stage.get<float>("distance")[1]));
}

TEST(PhaseDecoder, IntegersAndFloatsSayTheSame) {
  const Steps steps = three_at(nine_images);
  const Scene scene{.distances = ramp(0.3, 18.4, 999), .noise = 5};
  const auto whole = samples_of<std::int16_t>(steps, scene);
  const std::vector<float> same(whole.begin(), whole.end());
  const std::vector<std::int32_t> wide(whole.begin(), whole.end());
  const auto expected = decode("phase_decoder", steps, same).distance;
  EXPECT_EQ(decode("phase_decoder", steps, whole).distance, expected);
  EXPECT_EQ(decode("phase_decoder", steps, wide).distance, expected);
}

/// Taps with shot noise, and frequencies of which each is seen with another contrast.
TEST(PhaseDecoder, SigmaIsTheNoiseOfTaps) {
  const Steps steps = three_at(nine_images);
  const double amplitudes[] = {900, 1300, 400}, distance = 9.87, mean = 4000, read = 4, acquisition = 0.3;
  const std::size_t pixels = 40000, rows = rows_of(pixels);
  std::mt19937 generator(4);
  std::normal_distribution<double> normal;
  std::vector<std::uint16_t> taps;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const double c = amplitudes[k / 3] * std::cos(4 * pi * steps[k].frequency * distance / c_light + steps[k].phase);
    for (const double sign : {0.5, -0.5}) {
      const double counts = mean + sign * c, deviation = std::sqrt(read * read + acquisition * counts);
      for (std::size_t i = 0; i < pixels; ++i)
        taps.push_back(static_cast<std::uint16_t>(std::lround(counts + deviation * normal(generator))));
    }
  }
  Harness stage("phase_decoder read_noise=4counts shot_noise=0.3counts");
  stage.camera(profile(steps, pixels));
  stage.put<std::uint16_t>("taps", {steps.size(), 2, rows, pixels / rows}, taps);
  stage.run();
  const auto distances = stage.get<float>("distance"), sigmas = stage.get<float>("sigma");
  double sum = 0, square = 0, sigma = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    ASSERT_NEAR(distances[i], distance, 0.2);
    sum += distances[i] - distance;
    square += std::pow(distances[i] - distance, 2);
    sigma += sigmas[i];
  }
  const double n = static_cast<double>(pixels), sd = std::sqrt(square / n - sum / n * (sum / n));
  EXPECT_NEAR(sd / (sigma / n), 1, 0.03);
}

TEST(PhaseDecoder, WithoutNoiseNothingIsUncertain) {
  const Steps steps = three_at(nine_images);
  const Scene scene{.distances = ramp(0.1, 18.6, 500)};
  const std::string zero = " read_noise=0counts shot_noise=0counts";
  Harness harness("phase_decoder" + zero);
  harness.camera(profile(steps, 500));
  harness.put<float>("phases", {9, 1, 500}, samples_of(steps, scene));
  harness.run();
  for (std::size_t i = 0; i < 500; ++i) {
    EXPECT_NEAR(harness.get<float>("distance")[i], scene.distances[i], 1e-4);
    EXPECT_EQ(harness.get<std::uint16_t>("flags")[i], 0);
  }
  EXPECT_FALSE(harness.has("sigma"));
}

TEST(PhaseDecoder, WhatIsNoNumberIsInvalid) {
  const Steps steps = three_at(nine_images);
  auto samples = samples_of(steps, {.distances = ramp(1, 2, 40)});
  samples[4 * 40 + 7] = std::nanf("");
  samples[8 * 40 + 9] = std::numeric_limits<float>::infinity();
  const Decoded decoded = decode("phase_decoder", steps, samples);
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(std::isnan(decoded.distance[i]), i == 7 || i == 9) << i;
    EXPECT_EQ((decoded.flags[i] & flag::invalid) != 0, i == 7 || i == 9) << i;
  }
}

/// 33.3333 MHz is not an exact third of 100 MHz; nor do the two repeat before they are a hertz apart.
TEST(PhaseDecoder, FrequenciesAreMultiplesAsTheyAreRounded) {
  for (const auto& frequencies : {std::vector<double>{100e6, 33.3333e6}, {80e6, 26.66665e6}, {60e6, 40.00002e6}}) {
    const Steps steps = three_at(frequencies);
    const Scene scene{.distances = ramp(0.05, 4.4, 300)};
    const Decoded decoded = decode("phase_decoder", steps, samples_of(steps, scene));
    for (std::size_t i = 0; i < 300; ++i) {
      ASSERT_EQ(decoded.flags[i] & flag::wrapped, 0) << frequencies[1] << " Hz, " << scene.distances[i] << " m";
      ASSERT_NEAR(decoded.distance[i], scene.distances[i], 1e-3);
    }
  }
}

TEST(PhaseDecoder, BeyondTheGreatestRangeWrapsAreUncertain) {
  const Steps steps = three_at(nine_images);
  const double noise = 10;
  const auto flags_at = [&](double from, double to, const std::string& range) {
    const Scene scene{.distances = ramp(from, to, 200), .noise = noise};
    const Decoded decoded =
        decode("phase_decoder max_range=" + range, steps, samples_of(steps, scene), noise / std::sqrt(2.0));
    std::size_t wrapped = 0;
    for (std::size_t i = 0; i < 200; ++i) {
      wrapped += (decoded.flags[i] & flag::wrapped) != 0 ? 1 : 0;
      if ((decoded.flags[i] & flag::wrapped) == 0) {
        EXPECT_NEAR(decoded.distance[i], scene.distances[i], 0.02);
      }
    }
    return wrapped;
  };
  EXPECT_EQ(flags_at(0.001, 4.999, "5m"), 0U);
  EXPECT_EQ(flags_at(5.05, 9, "5m"), 200U);
  EXPECT_EQ(flags_at(9, 18, "5m"), 200U);
  EXPECT_EQ(flags_at(3.05, 6, "3m"), 200U);
}

TEST(PhaseDecoder, FlagsAsMuchOfGoodSamplesAsTheDeviationsSay) {
  const double share = std::erfc(3 / std::sqrt(2.0));
  for (const int count : {4, 5, 8}) {
    const Steps steps = three_at({20e6}, count);
    const std::size_t pixels = 100000;
    const Scene scene{.distances = ramp(0.3, 7, pixels), .noise = 10, .seed = 31};
    const Decoded decoded =
        decode("phase_decoder inconsistent_above=3", steps, samples_of(steps, scene), 10 / std::sqrt(2.0));
    const auto flagged = std::ranges::count_if(decoded.flags, [](auto f) { return (f & flag::inconsistent) != 0; });
    EXPECT_NEAR(static_cast<double>(flagged), share * pixels, 5 * std::sqrt(share * pixels)) << count;
  }
}

/// The four images in any order, either sign, exchanged taps: right as soon as the exposures say so.
TEST(FourPhaseDecoder, TakesAnyOrderOfItsSteps) {
  const Scene scene{.distances = ramp(0.05, 7.4, 500)};
  const std::vector<std::vector<double>> orders = {{0, 90, 180, 270}, {0, 270, 180, 90}, {180, 270, 0, 90},
                                                   {0, 180, 90, 270}, {270, 0, 180, 90}, {90, 0, -90, 180}};
  for (const auto& order : orders) {
    Steps steps;
    for (const double phase : order) steps.push_back({phase * deg, 20e6});
    const auto samples = samples_of(steps, scene);
    for (const char* stage : {"four_phase_decoder", "phase_decoder"}) {
      const Decoded decoded = decode(stage, steps, samples);
      for (std::size_t i = 0; i < 500; ++i)
        ASSERT_NEAR(decoded.distance[i], scene.distances[i], 2e-6) << stage << " " << order[0] << " " << order[1];
    }
  }
}

std::string message_of(const std::string& stage, const Steps& steps, std::size_t images) {
  try {
    Harness harness(stage);
    harness.camera(profile(steps, 4));
    harness.put<float>("phases", {images, 1, 4}, std::vector<float>(images * 4, 1));
    harness.prepare();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

void expect_words(const std::string& text, const std::string& words) {
  EXPECT_NE(text.find(words), std::string::npos) << text;
}

TEST(PhaseDecoder, SaysWhatCannotBeDecoded) {
  expect_words(message_of("phase_decoder", {{0, 0}, {pi, 0}}, 2), "2 exposures, expected 3 to 32");
  expect_words(message_of("phase_decoder", {{0, 0}, {pi, 0}, {0, 0}}, 3),
               "the steps 0, 180, 0 deg are only 2 different");
  expect_words(message_of("phase_decoder", {{0, 0}, {0.001, 0}, {0.002, 0}}, 3), "leave the phase undetermined");
  expect_words(message_of("phase_decoder", {{0, 20e6}, {2, 20e6}, {4, 0}}, 3),
               "exposure 2 has a frequency of 0 Hz or none");
  expect_words(message_of("phase_decoder", three_at({20e6, 31.7e6 + 1234}), 6),
               "have no common range: 6 exposures: 0, 120, 240 deg at 20 MHz; 0, 120, 240 deg at 31.7012 MHz");
  EXPECT_EQ(message_of("phase_decoder max_range=20m", three_at({20e6, 31.7e6 + 1234}), 6), "no error");
  expect_words(message_of("phase_decoder", three_at({20e6, 30e6, 40e6, 50e6}), 12), "up to three");
  expect_words(message_of("phase_decoder modulation_frequency=20MHz", three_at({20e6, 30e6}), 6), "one frequency");
  for (const char* parameter :
       {"max_range=5m", "wrap_confidence=0.9", "phase_error=0.1rad", "invalidate_wrapped=false"})
    expect_words(message_of(std::string("phase_decoder ") + parameter, three_at({20e6}), 3),
                 "is for several modulation frequencies");
  expect_words(message_of("phase_decoder", three_at({20e6}, 4), 3), "3 images");
  expect_words(message_of("four_phase_decoder", three_at({20e6}), 3), "take phase_decoder for it");
}

}  // namespace
