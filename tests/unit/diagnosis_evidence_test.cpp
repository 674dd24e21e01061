// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Rail.BarsAre*
// Rooms: diagnosis
// Figures of the gap report, compared with closed forms and brute force.
#include "diagnosis/data/ingest.hpp"
#include "diagnosis/model/intervals.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/report/diagnosis.hpp"
#include "diagnosis/report/gap_report_parts.hpp"
#include "tests/unit/rail.hpp"

#include <cmath>
#include <fstream>

namespace tofgraph::diagnosis {
namespace {

/// Many draws of noise, jitter and light: measured minus true values scatter as the bars state, as do superpixels.
TEST_F(Rail, BarsAreAsLongAsDrawsScatter) {
  const Term term{&effect("zero_offset"), {4e-3}};
  Problem problem = make_problem(*design, blank);
  const State truth{
      {term}, std::vector<double>(problem.targets.size(), 0.1), {.jitter = 5e-4, .offset = 0, .light = 2e-3}};
  const State ideal{{}, truth.log_reflectivity, truth.random_sd};
  for (const std::size_t o : {distance, amplitude}) {
    double square = 0, count = 0, of_pixels = 0, pixels = 0, of_map = 0, map = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const std::vector<Observations> data = injected(problem, truth, 100 + seed);
      Problem drawn = make_problem(*design, data);
      const Evidence e = evidence({drawn, ideal}, {drawn, truth}, o);
      for (const Evidence::Mean& mean : e.means) {
        square += std::pow((mean.measured - mean.extended) / mean.sd, 2);
        ++count;
      }
      for (std::size_t i = 0; i < e.after.size(); ++i) {
        for (std::size_t s = 0; s < e.after[i].size(); ++s, ++pixels)
          of_pixels += std::pow(e.after[i][s] / e.sd[i][s], 2);
      }
      for (std::size_t s = 0; s < e.map_after.size(); ++s, ++map) of_map += std::pow(e.map_after[s] / e.map_sd[s], 2);
    }
    // Some 400 conditions; the superpixels of one condition share its jitter.
    EXPECT_NEAR(square / count, 1, 0.25) << o;
    EXPECT_NEAR(of_pixels / pixels, 1, 0.25) << o;
    EXPECT_NEAR(of_map / map, 1, 0.9) << "what is common to a condition is common to its map " << o;
  }
  const Evidence exact = evidence({problem, ideal}, {problem, truth}, distance);
  for (const Evidence::Mean& mean : exact.means) {
    EXPECT_NEAR(mean.simulated, 0, 1e-9);
    EXPECT_LT(mean.extended, 4e-3) << "oblique rays are longer than the board is far";
    EXPECT_GT(mean.extended, 3.4e-3);
  }
}

/// An effect visible in a single condition is attributed to that condition.
TEST_F(Rail, TheConditionThatShowsAnEffectCarriesIt) {
  for (io::Condition& c : conditions) c.velocity = 0;  // unspecified means the full effect
  conditions[7].velocity = 0.3;
  measure();
  const Problem blank_problem = make_problem(*design, blank);
  const Term term{&effect("motion"), random_term(effect("motion"), 1, 3).values};
  const State truth{{term}, std::vector<double>(2, 0.1), {.jitter = 5e-4, .offset = 0, .light = 2e-3}};
  const std::vector<Observations> data = injected(blank_problem, truth, 5);
  const std::vector<double> shares = influence(make_problem(*design, data), truth, 0);
  ASSERT_EQ(shares.size(), design->size());
  double sum = 0;
  for (const double share : shares) sum += share;
  EXPECT_NEAR(sum, 1, 1e-9);
  EXPECT_GT(shares[7], 0.99);
}

/// Single column, known reflectivities: shares computed explicitly from dense covariances.
TEST_F(Rail, SharesAreThoseOfDenseCovariances) {
  conditions.resize(4);
  for (io::Condition& c : conditions) c.reflectivity = 0.6;
  measure();
  const Problem ideal = make_problem(*design, blank);
  const State truth{{{&effect("wiggling"), {5e-3, 0.4}}}, {}, {.jitter = 5e-4, .offset = 0, .light = 2e-3}};
  const std::vector<Observations> data = injected(ideal, truth, 8);
  const Problem problem = make_problem(*design, data);
  const std::vector<double> shares = influence(problem, truth, 0);
  const auto with = expected(problem, truth), without = expected(problem, State{{}, {}, truth.random_sd});
  std::vector<double> scores;
  double all = 0;
  for (std::size_t i = 0; i < design->size(); ++i) {
    const auto n = static_cast<Eigen::Index>(design->rows());
    Eigen::VectorXd x(n), r(n), g(n), h(n);
    Eigen::MatrixXd c = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto row = static_cast<std::size_t>(k);
      x(k) = with[i][row] - without[i][row];
      r(k) = data[i].value[row] - without[i][row];
      g(k) = 5e-4 * design->shift(i)[row];
      h(k) = 2e-3 * truth.light_response(problem, i, row);
      c(k, k) = data[i].variance[row];
    }
    c += g * g.transpose() + h * h.transpose();
    scores.push_back(x.dot(c.ldlt().solve(r)));
    all += scores.back();
  }
  for (std::size_t i = 0; i < shares.size(); ++i) EXPECT_NEAR(shares[i], scores[i] / all, 1e-4) << i;
}

TEST(ByCondition, AGapOutOfFoldIsTheRootMeanSquareOverItsFolds) {
  CrossFit folds;
  OutOfFold first{.condition = 1}, second{.condition = 1};
  first.before[distance] = 8e-6, first.after[distance] = 2e-6, first.count[distance] = 2;
  second.before[distance] = 24e-6, second.after[distance] = 4e-6, second.count[distance] = 4;
  folds.folds.resize(2);
  folds.folds[0].conditions = {first};
  folds.folds[1].conditions = {second};
  const auto gaps = gaps_by_condition(folds, 2);
  EXPECT_TRUE(std::isnan(gaps[0].before)) << "it was never put aside";
  EXPECT_NEAR(gaps[1].before, std::sqrt(32e-6 / 6), 1e-12);
  EXPECT_NEAR(gaps[1].after, 1e-3, 1e-12);
}

/// Boards alternately 1 mm nearer and farther, in a fit that allows 3 mm each: they differ by 1 mm.
TEST_F(Rail, ScatterIsWhatConditionsDifferBy) {
  const Problem exact = make_problem(*design, blank);
  State state{{}, std::vector<double>(exact.targets.size(), 0), {.jitter = 3e-3, .offset = 0, .light = 1e-6}};
  EXPECT_LT(scatter_of(exact, state)[distance], 1e-8) << "nothing is off";
  std::vector<Observations> off = blank;
  for (std::size_t i = 0; i < off.size(); ++i) {
    for (std::size_t row = 0; row < design->rows(); ++row)
      off[i].value[row] += (i / 2 % 2 == 0 ? 1e-3 : -1e-3) * design->shift(i)[row];
  }
  const Problem scattered = make_problem(*design, off);
  const double scatter = scatter_of(scattered, state)[distance];
  const MeasuredNoise noise = measured_noise(scattered, true, distance);
  EXPECT_NEAR(noise.scatter_left(scatter), 1e-3, 0.05e-3);
  const double both = noise.with_scatter(scatter), left = gap(scattered, state, distance);
  EXPECT_NEAR(both * both, left * left + std::pow(measured_noise(exact, true, distance).floor(), 2), 0.02e-6);
}

TEST(ParameterStatus, NumbersHaveTheDigitsOfTheirUncertainty) {
  EXPECT_EQ(with_uncertainty(4.0012e-3, {3.9812e-3, 4.0212e-3}, "m"), "4.001 mm ± 0.020 mm");
  EXPECT_EQ(with_uncertainty(599.606, {540, 659}, "counts/s"), "600 counts/s ± 60 counts/s");
  EXPECT_EQ(with_uncertainty(0.5, {0.49, 0.51}, "rad"), "28.65 deg ± 0.57 deg");
  EXPECT_EQ(with_uncertainty(1e-3, {0.9e-3, 2e-3}, "s"), "1.00 ms (0.90 ms to 2.00 ms)") << "its ends are not alike";
  EXPECT_EQ(with_uncertainty(0.03, {NAN, NAN}, ""), "0.03") << "no interval is known";
  EXPECT_EQ(with_uncertainty(0.005, {NAN, NAN}, "rad", 2), "0.29 deg");
  EXPECT_EQ(with_uncertainty(1500, {NAN, NAN}, "counts/s", 2), "1500 counts/s") << "no exponent";
  EXPECT_EQ(with_uncertainty(2.8134, {2.2, 3.4}, "m/s"), "2.81 mm/ms \u00b1 0.60 mm/ms");
}

/// The digits of a gap are limited by its interval, at least two.
TEST(Shown, GapsHaveTheDigitsOfTheirUncertainty) {
  Gap gap;
  gap.held_out_low = 16.3e-3, gap.held_out_high = 40.4e-3;
  EXPECT_EQ(shown_gap(90.2e-3, gap, distance), "90 mm");
  EXPECT_EQ(shown_gap(28.3e-3, gap, distance), "28 mm");
  EXPECT_EQ(shown_gap(0.1234e-3, gap, distance), "0.12 mm");
  gap.held_out_low = 0.723e-3, gap.held_out_high = 1.02e-3;
  EXPECT_EQ(shown_gap(3.4512e-3, gap, distance), "3.45 mm");
  EXPECT_EQ(shown_gap(0.88e-3, gap, distance), "0.88 mm");
  EXPECT_EQ(shown_gap(41.83e-3, gap, distance), "41.8 mm") << "three digits at most";
  gap.held_out_low = gap.held_out_high = NAN;
  EXPECT_EQ(shown_gap(3.4512e-3, gap, distance), "3.5 mm") << "nothing was held out";
  EXPECT_EQ(shown_gap(NAN, gap, distance), "-");
  EXPECT_EQ(shown_within(-0.004e-3, 0.5e-3, distance, true), "0.00 mm") << "a residual below its deviation";
  EXPECT_EQ(shown_within(4.5512e-3, 0.45e-3, distance, true), "+4.55 mm");
  EXPECT_EQ(shown_within(1234.5e-3, 120e-3, distance, true), "+1230 mm");
}

TEST_F(Rail, WhatTheDataSayOfAParameter) {
  const FreeParameter& size = effect("wiggling").free()[0];
  const FreeParameter& angle = effect("wiggling").free()[1];
  EXPECT_EQ(parameter_status(size, {3e-3, 5e-3}, 1e-4), ParameterStatus::determined);
  EXPECT_EQ(parameter_status(size, {-1e-3, 5e-3}, 1e-4), ParameterStatus::consistent_with_zero);
  EXPECT_EQ(parameter_status(size, {-1, 1}, 9000), ParameterStatus::not_determined) << "the prior alone has 100^2";
  EXPECT_EQ(parameter_status(angle, {-3, 4}, 2), ParameterStatus::not_determined) << "a whole turn";
  EXPECT_EQ(parameter_status(angle, {-0.1, 0.1}, 1e-3), ParameterStatus::determined) << "no angle changes nothing";
}

/// Limitations that follow from the settings of a campaign are noted before the search.
TEST_F(Rail, FewLevelsAndSettingsThatGoTogetherAreNoted) {
  const auto notes = [&](bool light) {
    measure();
    for (Observations& o : blank) {
      for (std::size_t row = design->superpixels(); !light && row < design->rows(); ++row)
        o.variance[row] = std::numeric_limits<double>::infinity();
    }
    const Problem problem = make_problem(*design, blank);
    Measurements m;
    m.design = std::make_shared<const Design>(*design);
    m.observations = blank;
    m.replicates = m.taps = true;
    std::string all;
    for (const std::string& note : notes_on(m, problem)) all += note + "\n";
    return all;
  };
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    conditions[i].board_distance = 1 + static_cast<double>(i) / 10;
    conditions[i].integration_time = i % 2 == 0 ? 1e-3 : 2e-3;
  }
  EXPECT_NE(notes(true).find("There are only 2 integration times"), std::string::npos);
  EXPECT_EQ(notes(true).find("No target was measured"), std::string::npos) << "the light is known";
  EXPECT_NE(notes(false).find("No target was measured at one distance with two integration times"), std::string::npos);
  conditions[1].board_distance = conditions[0].board_distance;
  conditions[1].target = conditions[0].target;
  EXPECT_EQ(notes(false).find("No target was measured"), std::string::npos);
}

/// SHA-256 of "abc" (FIPS 180-2, appendix B.1).
TEST(Inputs, FilesAreNamedWithTheirHashes) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "inputs";
  std::filesystem::create_directories(folder / "captures");
  for (const char* name : {"model.yaml", "campaign.yaml", "captures/a.h5"}) std::ofstream(folder / name) << "abc";
  io::Condition one, same, gone;
  one.capture = same.capture = folder / "captures/a.h5";
  gone.capture = folder / "captures/b.h5";
  const auto inputs = hashed_inputs(folder / "model.yaml", folder / "campaign.yaml", {one, same, gone});
  ASSERT_EQ(inputs.size(), 3U);
  EXPECT_EQ(inputs[0].file, (folder / "model.yaml").string());
  EXPECT_EQ(inputs[2].file, "captures/a.h5");
  for (const InputFile& input : inputs)
    EXPECT_EQ(input.sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace tofgraph::diagnosis
