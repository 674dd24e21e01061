// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Rail.IntervalsAllow*
// Rooms: diagnosis
// Identifiability of values: regions of several amplitudes, intervals that allow for effects too small to detect.
#include "diagnosis/model/intervals.hpp"

#include "diagnosis/search/search.hpp"
#include "tests/unit/rail.hpp"

#include <random>

namespace tofgraph::diagnosis {
namespace {

/// Three amplitudes whose differences are known to 0.1 of a typical value and whose common part is unknown.
ModelFit differences_alone(const Candidate& candidate, const std::vector<double>& values) {
  ModelFit fit;
  fit.state.terms = {{&candidate, values}};
  fit.covariance = Eigen::Matrix3d::Identity() * 0.01 + Eigen::Matrix3d::Constant(1e4);
  return fit;
}

std::vector<Interval> each_alone(const ModelFit& fit) {
  std::vector<Interval> all;
  for (std::size_t k = 0; k < 3; ++k) {
    const double half = 1.96 * 100 * fit.state.terms[0].candidate->free()[k].typical;
    all.push_back({fit.state.terms[0].values[k] - half, fit.state.terms[0].values[k] + half});
  }
  return all;
}

TEST_F(Rail, SizesOfWhichTheDifferencesAreKnownSaySomething) {
  const Candidate& gains = effect("phase_gain");
  const double step = gains.free()[0].typical;
  const ModelFit differ = differences_alone(gains, {20 * step, 21 * step, 20 * step});
  EXPECT_EQ(identifiability_of(differ, 0, each_alone(differ), 1).why, "");
  const ModelFit alike = differences_alone(gains, {20 * step, 20 * step, 20 * step});
  EXPECT_EQ(identifiability_of(alike, 0, each_alone(alike), 1).why,
            "none of its amplitudes differs significantly from zero");
  // The square is 0.67 / 0.01, and the 95 % limit for three amplitudes is 7.81: with ten times the scatter the result
  // is not significant.
  EXPECT_EQ(identifiability_of(differ, 0, each_alone(differ), 8).why, "");
  EXPECT_EQ(identifiability_of(differ, 0, each_alone(differ), 9).why,
            "none of its amplitudes differs significantly from zero");
}

/// @param half of the nonlinear parameter's interval, in typical values
Unidentified identifiability_at(const Candidate& candidate, const std::string& shape, double value, double half) {
  ModelFit fit;
  fit.state.terms = {{&candidate, {}}};
  std::vector<Interval> all;
  for (const FreeParameter& p : candidate.free()) {
    const double here = p.name == shape ? value : p.typical, away = (p.name == shape ? half : 0.001) * p.typical;
    fit.state.terms[0].values.push_back(here);
    all.push_back({here - away, here + away});
  }
  const auto n = static_cast<Eigen::Index>(all.size());
  fit.covariance = Eigen::MatrixXd::Identity(n, n) * 1e-6;
  return identifiability_of(fit, 0, all, 1);
}

/// A warm-up of seconds is an offset; a reflection known to be near remains one; a fraction may have any value.
TEST_F(Rail, AShapeThatWentToItsLimitSaysNothing) {
  const Candidate& warm_up = effect("warm_up");
  const Unidentified there = identifiability_at(warm_up, "time_constant", 9, 2);
  EXPECT_TRUE(there.at_limit);
  EXPECT_EQ(there.why, "its time_constant reached its limit (9 s, at least 1 s)");
  ASSERT_TRUE(there.nonlinear);
  EXPECT_EQ(warm_up.free()[*there.nonlinear].name, "time_constant");
  EXPECT_EQ(identifiability_at(warm_up, "time_constant", 60, 2).why, "");
  EXPECT_EQ(identifiability_at(warm_up, "time_constant", 9, 0.1).why, "");
  EXPECT_EQ(identifiability_at(warm_up, "time_constant", 9, 20).why,
            "these conditions do not determine its time_constant");
  EXPECT_EQ(identifiability_at(effect("static_reflection"), "distance", 2e-3, 0.01).why, "");
  EXPECT_EQ(identifiability_at(effect("stray_light"), "uniform", 0, 2).why, "");
}

TEST_F(Rail, WhatDoesAsMuchIsChosenInItsPlace) {
  EffectFinding found;
  found.name = "zero_offset";
  found.rivals = {{.candidate = &effect("rail_offset"), .tied = true},
                  {.candidate = &effect("warm_up"), .limit = "its time_constant reached its limit"},
                  {.candidate = &effect("wiggling")}};
  EXPECT_EQ(found.names(), (std::vector<std::string>{"zero_offset", "rail_offset", "warm_up"}));
}

TEST_F(Rail, ARefinementFarBeyondWhatIsTypicalHasItsPrice) {
  const Candidate& plain = effect("lens_distortion");
  const auto size = std::ranges::find(plain.refinements(), "k2", &Refinement::name);
  ASSERT_NE(size, plain.refinements().end());
  const auto k2 = static_cast<std::size_t>(size - plain.refinements().begin());
  const auto bic_with = [&](double typical_values) {
    const Term term = refined({&plain, {-0.1}}, k2, std::vector<double>{typical_values * size->parameters[0].typical});
    return ModelFit{.state = {{term}, {}, {}}, .deviance = 50, .dimension = 2, .covariance = {}}.bic(100);
  };
  EXPECT_NEAR(bic_with(0), 50 + 2 * std::log(100.0), 1e-9) << "off: as without a prior";
  EXPECT_NEAR(bic_with(-3) - bic_with(0), 9, 1e-9) << "-2 ln of the normal density, less its value at off";
}

/// Lenses with a random k2 that is not fitted: coverage of the interval of k1.
TEST_F(Rail, IntervalsAllowForWhatIsTooSmallToBeSeen) {
  const Candidate& plain = effect("lens_distortion");
  const auto size = std::ranges::find(plain.refinements(), "k2", &Refinement::name);
  ASSERT_NE(size, plain.refinements().end());
  const auto k2 = static_cast<std::size_t>(size - plain.refinements().begin());
  constexpr double share = 1;  // of the typical value: the standard deviation of the drawn k2
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  int held_open = 0, held_shut = 0;
  constexpr int campaigns = 40;
  for (int i = 0; i < campaigns; ++i) {
    const double k1 = -0.1;
    const double hidden = share * size->parameters.front().typical * normal(generator);
    const Term truth = refined({&plain, {k1}}, k2, std::vector<double>{hidden});
    const std::vector<Observations> data = data_with({truth}, 900 + static_cast<std::uint64_t>(i));
    const Problem problem = make_problem(*design, data);
    State start{{{&plain, {k1}}}, first_log_reflectivity(problem), {}};
    start.random_sd.offset = 0;
    State fitted = fit(problem, start).state;
    update_precomputed(problem, fitted);  // as data are reduced: averaged over the superpixels
    start = comparable_with(fitted, start);
    const ModelFit best = fit(problem, start);
    const Interval open = intervals(problem, best, 1, 1)[0],
                   shut = intervals(problem, best, 1, 1, Refinements::as_they_are)[0];
    EXPECT_LE(open.low, shut.low);
    EXPECT_GE(open.high, shut.high);
    held_open += open.low <= k1 && k1 <= open.high ? 1 : 0;
    held_shut += shut.low <= k1 && k1 <= shut.high ? 1 : 0;
  }
  EXPECT_GE(held_open, 35) << "of 40, where 38 are expected, and less than 35 come once in seventy";
  EXPECT_LT(held_shut, 20) << "k2 moves k1 by more than noise does";
}

}  // namespace
}  // namespace tofgraph::diagnosis
