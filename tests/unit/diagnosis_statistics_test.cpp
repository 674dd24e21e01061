// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The search's statistics, compared with dense linear algebra, closed forms and published examples.
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/data/superpixels.hpp"
#include "diagnosis/model/mixed_model.hpp"
#include "diagnosis/model/scan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tofgraph::diagnosis {
namespace {

struct Dense {
  std::vector<Eigen::MatrixXd> columns;  // effects, g, o, h, u, residual
  std::vector<Eigen::VectorXd> variance;
};

Dense random_conditions(std::size_t conditions, Eigen::Index rows, Eigen::Index effects) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.5, 2);
  Dense dense;
  for (std::size_t i = 0; i < conditions; ++i) {
    dense.columns.emplace_back(
        Eigen::MatrixXd::NullaryExpr(rows, effects + gram_tail, [&] { return normal(generator); }));
    dense.variance.emplace_back(Eigen::VectorXd::NullaryExpr(rows, [&] { return uniform(generator); }));
  }
  return dense;
}

std::vector<Gram> grams_of(const Dense& dense) {
  std::vector<Gram> grams;
  for (std::size_t i = 0; i < dense.columns.size(); ++i)
    grams.emplace_back(dense.columns[i].transpose() * dense.variance[i].cwiseInverse().asDiagonal() * dense.columns[i]);
  return grams;
}

TEST(MixedModel, IsTheDenseGeneralisedLeastSquares) {
  constexpr Eigen::Index rows = 9, effects = 2;
  constexpr int targets = 2;
  const RandomEffectSd random_sd{.jitter = 0.7, .offset = 0.3, .light = 0.4};
  const Dense dense = random_conditions(6, rows, effects);
  const std::vector<Gram> grams = grams_of(dense);
  const std::vector<int> target = {0, 1, 0, 1, -1, 0};
  const std::vector<double> weight(6, 1.0);

  std::vector<Gram> marginals(6);
  std::vector<double> determinants(6);
  for (std::size_t i = 0; i < 6; ++i) marginals[i] = marginal(grams[i], random_sd, determinants[i]);
  const Unknowns unknowns{effects, target, targets};
  const Solution solution = solve(assemble(marginals, determinants, unknowns, weight), unknowns, random_sd);

  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(effects + targets, effects + targets);
  Eigen::VectorXd score = Eigen::VectorXd::Zero(effects + targets);
  double square = 0, determinant = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::MatrixXd& all = dense.columns[i];
    const Eigen::VectorXd g = all.col(effects), o = all.col(effects + 1), h = all.col(effects + 2),
                          r = all.col(effects + gram_tail - 1);
    const Eigen::MatrixXd noise = dense.variance[i].asDiagonal();
    const Eigen::MatrixXd covariance = noise + std::pow(random_sd.jitter, 2) * g * g.transpose() +
                                       std::pow(random_sd.offset, 2) * o * o.transpose() +
                                       std::pow(random_sd.light, 2) * h * h.transpose();
    Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, effects + targets);
    design.leftCols(effects) = all.leftCols(effects);
    if (target[i] >= 0) design.col(effects + target[i]) = h;
    const Eigen::MatrixXd inverse = covariance.inverse();
    information += design.transpose() * inverse * design;
    score += design.transpose() * inverse * r;
    square += r.dot(inverse * r);
    determinant += std::log(covariance.determinant() / noise.determinant());
  }
  information.diagonal().array() += 1 / (settings.prior_width * settings.prior_width);
  const Eigen::VectorXd expected = information.inverse() * score;
  for (Eigen::Index j = 0; j < expected.size(); ++j) EXPECT_NEAR(solution.values(j), expected(j), 1e-10);
  EXPECT_NEAR(solution.deviance, square - expected.dot(score) + determinant, 1e-9);
  EXPECT_NEAR(solution.dimension, 2, 1e-3);
}

/// Random effects shared by conditions enter the joint covariance of all of them.
TEST(MixedModel, IsTheDenseOneWithWhatConditionsShare) {
  constexpr Eigen::Index rows = 7, effects = 2, conditions = 5, all = rows * conditions;
  constexpr int targets = 1;
  const RandomEffectSd random_sd{
      .jitter = 0.7, .offset = 0.3, .light = 0.4, .drift = 0.6, .drift_light = 0.2, .session = 0.9};
  const Dense dense = random_conditions(conditions, rows, effects);
  const std::vector<Gram> grams = grams_of(dense);
  const std::vector<int> target = {0, 0, -1, 0, 0};
  const std::vector<std::vector<Shared>> shared = {
      {{3, 0, 1}, {3, 2, 1}}, {{3, 0, -0.4}, {2, 1, 0.8}}, {{3, 0, 0.3}, {2, 1, -1}, {3, 2, 1}}, {}, {{2, 1, 0.5}}};
  const std::vector<double RandomEffectSd::*> sd = {&RandomEffectSd::drift, &RandomEffectSd::drift_light,
                                                    &RandomEffectSd::session};
  const Unknowns unknowns{effects, target, targets, shared, sd};
  std::vector<Gram> marginals(conditions);
  std::vector<double> determinants(conditions);
  for (std::size_t i = 0; i < conditions; ++i) marginals[i] = marginal(grams[i], random_sd, determinants[i]);
  const std::vector<double> weight(conditions, 1.0);
  const Solution solution = solve(assemble(marginals, determinants, unknowns, weight), unknowns, random_sd);

  Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(all, all), design = Eigen::MatrixXd::Zero(all, effects + targets),
                  along = Eigen::MatrixXd::Zero(all, 3);
  Eigen::MatrixXd covariance = noise;
  Eigen::VectorXd residual(all);
  const std::array<double, 3> own = {random_sd.jitter, random_sd.offset, random_sd.light};
  for (std::size_t i = 0; i < conditions; ++i) {
    const auto first = static_cast<Eigen::Index>(i) * rows;
    const Eigen::MatrixXd& columns = dense.columns[i];
    noise.diagonal().segment(first, rows) = dense.variance[i];
    for (Eigen::Index d = 0; d < random_directions; ++d) {
      const Eigen::VectorXd direction = columns.col(effects + d);
      covariance.block(first, first, rows, rows) +=
          std::pow(own.at(static_cast<std::size_t>(d)), 2) * direction * direction.transpose();
    }
    for (const Shared& s : shared[i])
      along.col(s.unknown).segment(first, rows) += s.factor * columns.col(effects + s.direction);
    design.block(first, 0, rows, effects) = columns.leftCols(effects);
    if (target[i] >= 0) design.col(effects).segment(first, rows) = columns.col(effects + light_direction);
    residual.segment(first, rows) = columns.col(effects + gram_tail - 1);
  }
  covariance += noise;
  for (Eigen::Index u = 0; u < 3; ++u)
    covariance += std::pow(random_sd.*sd[static_cast<std::size_t>(u)], 2) * along.col(u) * along.col(u).transpose();
  const Eigen::MatrixXd inverse = covariance.inverse();
  Eigen::MatrixXd information = design.transpose() * inverse * design;
  information.diagonal().array() += 1 / (settings.prior_width * settings.prior_width);
  const Eigen::VectorXd score = design.transpose() * inverse * residual, expected = information.inverse() * score;
  for (Eigen::Index j = 0; j < expected.size(); ++j) EXPECT_NEAR(solution.values(j), expected(j), 1e-9);
  const Eigen::MatrixXd known = information.inverse();
  for (Eigen::Index j = 0; j < effects; ++j) EXPECT_NEAR(solution.covariance(j, j), known(j, j), 1e-9);
  const double determinant = Eigen::MatrixXd(covariance * noise.inverse()).partialPivLu().determinant();
  EXPECT_NEAR(solution.deviance, residual.dot(inverse * residual) - expected.dot(score) + std::log(determinant), 1e-8);
}

/// Pixels known to a thousandth of a millimetre, board and camera offsets of up to a metre: the remaining information
/// of the pixels is a part in 10^12 of the original, compared with long double.
TEST(MixedModel, KeepsWhatIsLeftWhereBoardsMayStandAnywhere) {
  constexpr Eigen::Index rows = 60, effects = 2;
  std::mt19937 generator(8);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(rows, effects + gram_tail);
  for (Eigen::Index c = 0; c < all.cols(); ++c) {
    for (Eigen::Index r = 0; r < rows; ++r) all(r, c) = 1e5 * normal(generator);
  }
  all.col(effects + 1) = all.col(effects);  // a camera with a common distance error acts like a displaced board
  all.col(0) = all.col(effects) + 1e-5 * all.col(0);
  const RandomEffectSd random_sd{.jitter = 1, .offset = 1, .light = 0.1};
  double determinant = 0;
  const Gram left = marginal(all.transpose() * all, random_sd, determinant);

  using Exact = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const Exact exact = all.cast<long double>();
  Exact covariance = Exact::Identity(rows, rows);
  const std::array<double, random_directions> own = {random_sd.jitter, random_sd.offset, random_sd.light};
  for (Eigen::Index d = 0; d < random_directions; ++d)
    covariance += static_cast<long double>(own.at(static_cast<std::size_t>(d)) * own.at(static_cast<std::size_t>(d))) *
                  exact.col(effects + d) * exact.col(effects + d).transpose();
  const Exact expected = exact.transpose() * covariance.llt().solve(exact);
  for (Eigen::Index c = 0; c < effects; ++c) EXPECT_NEAR(left(c, c) / static_cast<double>(expected(c, c)), 1, 1e-2);
}

/// A model with large errors is not compensated by a camera drift of metres.
TEST(MixedModel, HoldsWhatWandersWithinWhatCamerasDo) {
  const std::vector<int> target = {-1, -1};
  const std::vector<std::vector<Shared>> shared = {{{uniform_direction, 0, 1}}, {{uniform_direction, 0, 1}}};
  const std::vector<double RandomEffectSd::*> sd = {&RandomEffectSd::drift};
  const Unknowns unknowns{0, target, 0, shared, sd};
  const RandomEffectSd random_sd{.drift = 1e-3};
  for (const auto& [off, expected] : {std::pair(5e-3, 5e-3), std::pair(3.0, 10e-3)}) {
    NormalEquations equations{Eigen::MatrixXd::Constant(1, 1, 1e12), Eigen::VectorXd::Constant(1, 1e12 * off), 0, 0};
    equations.square = 1e12 * off * off;
    EXPECT_NEAR(solve(equations, unknowns, random_sd).values(0), expected, 0.1 * expected);
  }
}

TEST(MixedModel, FindsTheVarianceBetweenConditions) {
  // One row per condition, g = 1: r is normal with variance 1 + jitter^2, whose most likely value is the mean square.
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  std::vector<Gram> grams;
  double square = 0;
  for (int i = 0; i < 400; ++i) {
    const double r = 0.02 * normal(generator), noise = 1e-4;
    square += r * r / 400;
    Eigen::Vector<double, gram_tail> row = Eigen::Vector<double, gram_tail>::Zero();
    row(0) = 1;
    row(gram_tail - 1) = r;
    grams.emplace_back(row * row.transpose() / noise);
  }
  const std::vector<int> target(400, -1);
  const Profile found = profile(grams, {0, target, 0}, {});
  EXPECT_NEAR(found.random_sd.jitter, std::sqrt(square - 1e-4), 2e-4);
}

/// The same with 14 conditions whose mean square is 36 times that of a stated jitter. Since the rows have no other
/// noise, the most likely standard deviation under the half-normal prior follows from a quadratic equation in its
/// square.
/// The search for the variances has equations of its own for the change of one of them.
TEST(MixedModel, NoOtherVariancesHaveLessDeviance) {
  constexpr Eigen::Index effects = 2;
  constexpr std::size_t conditions = 60;
  constexpr double jitter = 0.004, offset = 0.003, light = 0.005;
  Dense dense = random_conditions(conditions, 12, effects);
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  std::vector<int> target;
  std::vector<std::vector<Shared>> shared;
  for (std::size_t i = 0; i < conditions; ++i) {
    Eigen::MatrixXd& all = dense.columns[i];
    all.middleCols(effects, random_directions) *= 1000;
    all.col(effects + gram_tail - 1) += jitter * normal(generator) * all.col(effects) +
                                        offset * normal(generator) * all.col(effects + 1) +
                                        light * normal(generator) * all.col(effects + light_direction);
    target.push_back(static_cast<int>(i % 3) - 1);
    const double wave = std::cos(0.1 * static_cast<double>(i));
    shared.push_back({{uniform_direction, 0, wave}, {light_direction, 1, wave}});
  }
  const std::vector<Gram> grams = grams_of(dense);
  const std::vector<double RandomEffectSd::*> sd = {&RandomEffectSd::drift, &RandomEffectSd::drift_light};
  const Unknowns unknowns{effects, target, 2, shared, sd};
  const auto deviance = [&](const RandomEffectSd& random_sd) {
    std::vector<Gram> marginals = grams;
    const std::vector<double> determinants = marginalise(marginals, random_sd);
    return solve(assemble(marginals, determinants, unknowns), unknowns, random_sd).deviance;
  };
  const Profile found = profile(grams, unknowns, {});
  EXPECT_NEAR(found.solution.deviance, deviance(found.random_sd), 1e-9 * std::abs(found.solution.deviance));
  EXPECT_NEAR(found.random_sd.jitter, jitter, 0.3 * jitter);
  EXPECT_NEAR(found.random_sd.offset, offset, 0.3 * offset);
  EXPECT_NEAR(found.random_sd.light, light, 0.3 * light);
  for (double RandomEffectSd::*which : {&RandomEffectSd::jitter, &RandomEffectSd::offset, &RandomEffectSd::light}) {
    for (const double factor : {0.85, 1.15}) {
      RandomEffectSd other = found.random_sd;
      other.*which *= factor;
      EXPECT_GT(deviance(other), found.solution.deviance + 0.1) << factor;
    }
  }
}

TEST(MixedModel, AStatedJitterIsThePriorOfThatBetweenConditions) {
  constexpr double stated = 5e-5, seen = 3e-4, conditions = 14;
  std::vector<Gram> grams;
  for (int i = 0; i < static_cast<int>(conditions); ++i) {
    Eigen::Vector<double, gram_tail> row = Eigen::Vector<double, gram_tail>::Zero();
    row(0) = 1;
    row(gram_tail - 1) = i % 2 == 0 ? seen : -seen;
    grams.emplace_back(row * row.transpose() / 1e-16);
  }
  const std::vector<int> target(grams.size(), -1);
  Unknowns unknowns{0, target, 0};
  EXPECT_NEAR(profile(grams, unknowns, {}).random_sd.jitter, seen, 1e-2 * seen);
  unknowns.jitter = stated;
  const double a = 1 / (stated * stated),
               square = (std::sqrt(1 + 4 * a * seen * seen / conditions) - 1) * conditions / (2 * a);
  EXPECT_NEAR(profile(grams, unknowns, {}).random_sd.jitter, std::sqrt(square), 1e-2 * std::sqrt(square));
}

/// A drift about a mean over 40 conditions, a column common to all of them, scattered boards: from any initial
/// variances, the fit with the column is at least as good as without.
TEST(MixedModel, AColumnMoreIsNeverWorse) {
  constexpr int conditions = 40;
  std::mt19937 generator(8);
  std::normal_distribution<double> normal;
  std::vector<Gram> with, without;
  std::vector<std::vector<Shared>> shared;
  for (int i = 0; i < conditions; ++i) {
    // In m, with a pixel noise of 0.1 mm: 8 mm of offset, 5 mm more in every second one, 0.4 mm of
    // jitter.
    const double r = 8e-3 + (i % 2 == 0 ? 5e-3 : 0) + 4e-4 * normal(generator), noise = 1e-8;
    Eigen::Vector<double, 1 + gram_tail> row = Eigen::Vector<double, 1 + gram_tail>::Zero();
    row(0) = i % 2 == 0 ? 8e-3 : 0;
    row(1) = row(1 + uniform_direction) = 1;
    row(gram_tail) = r;
    with.emplace_back(row * row.transpose() / noise);
    without.emplace_back(row.tail(gram_tail) * row.tail(gram_tail).transpose() / noise);
    shared.push_back({{uniform_direction, 0, 1}, {uniform_direction, 1, std::cos(M_PI * i / (conditions - 1))}});
  }
  const std::vector<double RandomEffectSd::*> sd = {&RandomEffectSd::mean, &RandomEffectSd::drift};
  const std::vector<int> target(conditions, -1);
  for (const double jitter : {1e-5, 5e-4, 1e-2, 0.5}) {
    for (const double drift : {1e-6, 1e-4, 2e-3}) {
      const RandomEffectSd start{.jitter = jitter, .offset = 0, .drift = drift};
      const double less = profile(without, {0, target, 0, shared, sd}, start).solution.deviance;
      const double more = profile(with, {1, target, 0, shared, sd}, start).solution.deviance;
      EXPECT_LT(more, less) << jitter << " " << drift;
      // The same minimum from every start.
      EXPECT_NEAR(more, profile(with, {1, target, 0, shared, sd}, {.offset = 0}).solution.deviance, 0.1);
    }
  }
}

TEST(FalseDiscoveries, AreThoseOfThePublishedExample) {
  // Benjamini and Hochberg 1995, section 4: at 0.05 the four smallest of fifteen are rejected.
  const std::vector<double> p = {0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344,
                                 0.0459, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0000};
  EXPECT_EQ(false_discovery_limit(p, 0.05), 0.0095);
  EXPECT_EQ(false_discovery_limit({0.2, 0.9}, 0.05), 0);
}

/// Frames of a flat signal with normal noise on the samples; taps A, B = level +- c / 2.
FrameSums noisy_frames(std::complex<double> phasor, double level, double sd, std::size_t frames, unsigned seed) {
  constexpr std::size_t size = 24;
  FrameSums sums(FrameSums::Kind::taps, size, size);
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise(0, sd);
  for (std::size_t f = 0; f < frames; ++f) {
    std::vector<std::uint16_t> taps(8 * size * size);
    const auto clean = physics::samples_of(phasor);
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t i = 0; i < size * size; ++i) {
        taps[2 * k * size * size + i] =
            static_cast<std::uint16_t>(std::lround(level + clean[k] / 2 + noise(generator)));
        taps[(2 * k + 1) * size * size + i] =
            static_cast<std::uint16_t>(std::lround(level - clean[k] / 2 + noise(generator)));
      }
    }
    sums.add_taps(taps, 60000);
  }
  return sums;
}

TEST(Superpixels, HaveTheNoiseThatTheySay) {
  // Compared with 40 repetitions: squared errors in units of the variance have the mean 1 +- sqrt(2 / values).
  const std::complex<double> ideal = std::polar(800.0, 1.0), seen = std::polar(840.0, 1.01);
  const std::vector<Signal> base(24 * 24, Signal{ideal, 1000, 0, 0});
  const std::array<double, observables> truth = {1.193 * 0.01, std::log(1.05), std::log(1.1), 0, 0};
  std::array<double, observables> squares{};
  constexpr unsigned repetitions = 40;
  for (unsigned seed = 1; seed <= repetitions; ++seed) {
    ReductionCounts counts;
    const Observations o = reduce(noisy_frames(seen, 1100, 12, 4, seed), base, 2, {}, 1.193, {0, 23, 0, 23}, counts);
    EXPECT_EQ(counts.pixels, 24u * 24u);
    for (std::size_t k = 0; k < observables; ++k) {
      for (std::size_t s = 0; s < 4; ++s)
        squares[k] += std::pow(o.value[4 * k + s] - truth[k], 2) / o.variance[4 * k + s] / (4 * repetitions);
    }
  }
  for (std::size_t k = 0; k < observables; ++k)
    EXPECT_NEAR(squares[k], 1, 4 * std::sqrt(2.0 / (4 * repetitions))) << observable_names[k];
}

TEST(Superpixels, SaturationIsCountedInTheRegionAlone) {
  FrameSums sums(FrameSums::Kind::taps, 3, 2);
  std::vector<std::uint16_t> taps(8 * 6, 1000);
  taps[1] = taps[6 + 5] = 65535;  // row 0, column 1; row 1, column 2
  sums.add_taps(taps, 60000);
  EXPECT_EQ(sums.saturated({0, 2, 0, 1}), 2U);
  EXPECT_EQ(sums.saturated({0, 1, 0, 1}), 1U);
  EXPECT_EQ(sums.saturated({0, 0, 0, 1}), 0U);
}

/// A profile that states half or twice the true noise is corrected by the scatter of the pixels of a single frame.
TEST(Superpixels, OfOneFrameHaveTheNoiseOfTheirPixels) {
  const std::complex<double> ideal = std::polar(800.0, 1.0);
  const std::vector<Signal> base(24 * 24, Signal{ideal, 1000, 0, 0});
  for (const double stated : {6.0, 24.0}) {
    double square = 0;
    constexpr unsigned repetitions = 100;
    for (unsigned seed = 1; seed <= repetitions; ++seed) {
      ReductionCounts counts;
      const Observations o =
          reduce(noisy_frames(ideal, 1000, 12, 1, seed), base, 2, {stated, 0}, 1.193, {0, 23, 0, 23}, counts);
      for (std::size_t s = 0; s < 4; ++s) {
        const double error = o.value[4 * distance + s];
        square += error * error / o.variance[4 * distance + s] / (4 * repetitions);
      }
    }
    EXPECT_NEAR(square, 1, 4 * std::sqrt(2.0 / (4 * repetitions))) << stated;
  }
}

TEST(Superpixels, AreLeftOutWhereTapsAreNearlyEmptyOrFull) {
  const std::vector<Signal> base(24 * 24, Signal{{20, 0}, 20, 0, 0});
  ReductionCounts counts;
  const Observations dark = reduce(noisy_frames({20, 0}, 20, 3, 4, 1), base, 2, {}, 1.193, {0, 23, 0, 23}, counts);
  EXPECT_TRUE(std::isinf(dark.variance[0]));
  const Observations full =
      reduce(noisy_frames({20000, 0}, 49500, 50, 4, 1), base, 2, {}, 1.193, {0, 23, 0, 23}, counts);
  EXPECT_TRUE(std::isinf(full.variance[0]));
}

}  // namespace
}  // namespace tofgraph::diagnosis
