// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Wraps of several frequencies, compared with an exhaustive search in double and the closed form of wrong wraps.
#include <gtest/gtest.h>
#include <tofgraph/channels.hpp>

#include "tests/unit/cameras.hpp"
#include "tests/unit/phase_decoder_fixture.hpp"

using namespace tofgraph;
using namespace test;

namespace {

/// Every combination of wraps, in double: the lowest chi-square for each distance that it implies.
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
    // Near the limit the two differ by the rounding of the phases.
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
/// modulation (IEEE Trans. Instrum. Meas. 2011): for two frequencies m g and n g with coprime m and n, the wraps are
/// wrong if the difference of the two distances is off by more than half of c / (2 g m n).
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
  // Five standard deviations of the count, plus 6 %: the phase of a noisy phasor is not exactly normal.
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

/// 33.3333 MHz is not an exact third of 100 MHz: frequencies are multiples up to their rounding.
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

}  // namespace
