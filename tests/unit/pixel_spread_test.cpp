// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Laws of the pixels' spread, recovered from standard deviations that were computed in closed form or drawn at random.
#include "diagnosis/search/pixel_spread.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph::diagnosis {
namespace {

constexpr double metres_per_radian = 299792458.0 / (4 * M_PI * 20e6);
const SpreadNoise profile{3, 0.012, 0.5, metres_per_radian};

/// Three targets at fourteen distances with two times each, seen by a camera of 1500 counts m^2/ms.
std::vector<SpreadRow> boards() {
  std::vector<SpreadRow> rows;
  for (const double reflectivity : {0.85, 0.3, 0.08}) {
    for (int i = 1; i <= 14; ++i) {
      for (const double time : {2e-3, 20e-3}) {
        SpreadRow row;
        row.target = std::to_string(reflectivity);
        row.distance = 0.5 * i;
        row.integration_time = time;
        row.amplitude = 1.75e6 * reflectivity * time / (row.distance * row.distance);
        row.gain = 1 + 0.1 * std::sin(i);
        row.frames = 250;
        rows.push_back(row);
      }
    }
  }
  return rows;
}

/// Standard deviations of a law, with the estimation error for `pixels` values.
template <class Law> std::vector<SpreadRow> with_law(Law law, double pixels, std::uint64_t seed = 1) {
  std::vector<SpreadRow> rows = boards();
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1 / std::sqrt(2 * pixels));
  for (SpreadRow& row : rows) row.sd = row.gain * law(row) * std::exp(normal(random));
  return rows;
}

double value_of(const PixelSpread& spread, SpreadLaw law) {
  const auto found = std::ranges::find(spread.terms, law, &SpreadTerm::law);
  return found == spread.terms.end() ? 0 : found->value;
}

double inside(const SpreadRow& row, double rate) {
  return metres_per_radian * rate * row.integration_time / row.amplitude;
}

TEST(PixelSpread, FindsEachLawAlone) {
  const std::pair<SpreadLaw, double> truths[] = {{SpreadLaw::pattern, 4e-3}, {SpreadLaw::growing, 1.5e-3}};
  for (const auto& [law, value] : truths) {
    const auto found = fit_spread(
        with_law([&](const SpreadRow& r) { return value * (law == SpreadLaw::growing ? r.distance : 1); }, 600),
        profile);
    ASSERT_TRUE(found);
    ASSERT_EQ(found->terms.size(), 1U);
    EXPECT_EQ(found->terms[0].law, law);
    EXPECT_NEAR(found->terms[0].value, value, 0.02 * value);
    EXPECT_EQ(found->within, 1);
    EXPECT_EQ(found->held_out_within, 1);
  }
}

TEST(PixelSpread, FindsAPatternBesideCrosstalkAndTheLightOfEachTarget) {
  const auto truth = [](const SpreadRow& row) { return std::hypot(4e-3, inside(row, 200)); };
  std::vector<SpreadRow> rows = with_law(truth, 600);
  for (SpreadRow& row : rows) {
    if (row.target.starts_with("0.08")) row.amplitude *= 2;  // a wrongly assumed reflectivity
  }
  const auto found = fit_spread(rows, profile);
  ASSERT_TRUE(found);
  EXPECT_NEAR(value_of(*found, SpreadLaw::pattern), 4e-3, 0.1e-3);
  const double rate = value_of(*found, SpreadLaw::inside);
  EXPECT_EQ(found->terms.size(), 2U);
  for (const auto& [target, light] : found->light) {
    const double wrong = target.starts_with("0.08") ? 2 : 1;  // the rate and all lights share one unknown factor
    EXPECT_NEAR(rate / light, 200 * wrong, 0.15 * 200 * wrong) << target;
  }
  EXPECT_GT(found->held_out_within, 0.95);
  EXPECT_FALSE(found->residual);
}

TEST(PixelSpread, FindsNoiseOfFramesThatIsGreaterThanTheProfile) {
  const auto truth = [](const SpreadRow& row) {  // (2.3) for four samples of taps with this variance each
    const double variance = 3 * 3 + 0.012 * row.amplitude;
    return 6 * metres_per_radian * std::sqrt(2 * variance) / (std::sqrt(2) * row.amplitude) / std::sqrt(250.0);
  };
  const auto found = fit_spread(with_law(truth, 600), profile);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->terms.size(), 1U);
  EXPECT_NEAR(value_of(*found, SpreadLaw::temporal_noise), 6, 0.9);
  SpreadNoise unknown = profile;
  unknown.read_noise = io::unknown;
  const auto without = fit_spread(with_law(truth, 600), unknown);
  ASSERT_TRUE(without);
  EXPECT_EQ(value_of(*without, SpreadLaw::temporal_noise), 0) << "a profile without noise has no law of it";
}

/// Random normal values truncated at 20 mm: the law found from them is that of the full distribution.
TEST(PixelSpread, KnowsThatFarPixelsWereLeftOut) {
  std::vector<SpreadRow> rows = boards();
  std::mt19937_64 random(7);
  for (SpreadRow& row : rows) {
    row.gain = 1;
    row.reach = 20e-3;
    std::normal_distribution<double> normal(0, std::hypot(4e-3, inside(row, 300)));
    double sum = 0, square = 0, count = 0;
    for (int i = 0; i < 4000; ++i) {
      const double z = normal(random);
      if (std::abs(z) > 20e-3) continue;
      sum += z;
      square += z * z;
      ++count;
    }
    row.sd = std::sqrt(square / count - sum * sum / count / count);
  }
  const auto found = fit_spread(rows, profile);
  ASSERT_TRUE(found);
  EXPECT_NEAR(value_of(*found, SpreadLaw::pattern), 4e-3, 0.2e-3);
  EXPECT_GT(value_of(*found, SpreadLaw::inside), 0);
  EXPECT_EQ(found->within, 1);
  for (SpreadRow& row : rows) row.reach = io::unknown;
  EXPECT_GT(fit_spread(rows, profile)->rms, 2 * found->rms) << "otherwise the largest deviations do not fit";
}

TEST(PixelSpread, NamesTheGroupThatNoLawExplains) {
  std::vector<SpreadRow> rows = with_law([](const SpreadRow&) { return 4e-3; }, 600);
  for (SpreadRow& row : rows) {
    if (row.distance == 5.0) row.sd *= 0.6;
  }
  const auto found = fit_spread(rows, profile);
  ASSERT_TRUE(found && found->residual);
  EXPECT_EQ(found->residual->setting, "distance");
  EXPECT_EQ(found->residual->level, "5 m");
  EXPECT_EQ(found->residual->rows, 6U);
  EXPECT_NEAR(found->residual->ratio, 0.62, 0.03);
  const std::vector<std::string> notes = notes_on_spread(*found);
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_THAT(notes[0], testing::HasSubstr("a fixed pattern of 3.9 mm"));
  EXPECT_THAT(notes[1], testing::HasSubstr("no law explains those of distance 5 m"));
}

TEST(PixelSpread, SaysNothingOfAFewRows) {
  std::vector<SpreadRow> rows = with_law([](const SpreadRow&) { return 4e-3; }, 600);
  rows.resize(6);
  EXPECT_FALSE(fit_spread(rows, profile));
}

}  // namespace
}  // namespace tofgraph::diagnosis
