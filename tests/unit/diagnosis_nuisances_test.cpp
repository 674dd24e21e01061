// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: LastingResidue.KeepsNoEffect*:LastingResidue.IsNone*:Clutter.ABoardThatStands*
// Rooms: diagnosis simulation
// Nuisances of single conditions are no effect: sessions, displaced boards, a residual that is smooth over the image.
// None of them is named, and an effect beside them keeps its name.
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/board_nuisances.hpp"
#include "diagnosis/search/search.hpp"
#include "tests/unit/clutter.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

TEST_F(Clutter, SessionsAreNoEffect) {
  constexpr std::array<double, 3> offset = {-3e-3, 1e-3, 4e-3};
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].session = std::to_string(i % 3);
  measure();
  keep_few();
  const auto session = [&](std::size_t i, std::size_t) { return offset.at(i % 3); };
  EXPECT_EQ(names(searched(shifted(data_with({}, 21), session))), std::vector<std::string>{});
  const SearchResult result = searched(shifted(data_with(wiggling(), 22), session));
  expect_wiggling_alone(result, {wiggle.begin(), wiggle.end()});
  // Maximum-likelihood standard deviation of three offsets about zero.
  EXPECT_NEAR(result.after.state.random_sd.session, std::sqrt((9 + 1 + 16) / 3.0) * 1e-3, 3e-4);
  EXPECT_LT(result.after.state.random_sd.jitter, 1e-3);
}

TEST_F(Clutter, ABoardThatStandsElsewhereIsNamedAndNoEffect) {
  constexpr std::size_t lost = 7;
  const auto off = [&](std::size_t i, std::size_t s) { return i == lost ? 20e-3 * design->shift(i)[s] : 0; };
  for (const bool hidden : {false, true}) {
    const SearchResult result = searched(shifted(data_with(hidden ? wiggling() : std::vector<Term>{}, 23), off));
    if (hidden)
      expect_wiggling_alone(result, {wiggle.begin(), wiggle.end()});
    else
      EXPECT_EQ(names(result), std::vector<std::string>{});
    ASSERT_EQ(result.misplaced.size(), 1U);
    EXPECT_EQ(result.misplaced[0].condition, lost);
    EXPECT_NEAR(result.misplaced[0].error, 20e-3, 2e-3);
    EXPECT_LT(result.after.state.random_sd.jitter, 1e-3) << "the others' is as it was";
  }
  EXPECT_TRUE(searched(data_with(wiggling(), 24)).misplaced.empty());
}

TEST_F(Clutter, AnErrorWithinTheNoiseOfADarkBoardIsNoMisplacement) {
  constexpr std::size_t dark = 7;
  constexpr double noise = 5e-3;  // m, of the mean over the board
  const std::size_t n = design->superpixels();
  for (const double sizes : {4.0, 10.0}) {
    std::vector<Observations> data = blank;
    for (std::size_t s = distance * n; s < (distance + 1) * n; ++s) {
      const double shift = design->shift(dark)[s];
      data[dark].variance[s] = noise * noise * shift * shift * static_cast<double>(n);
      data[dark].value[s] += sizes * noise * shift;
    }
    const Problem problem = make_problem(*design, data);
    const BoardOffsets offsets =
        board_offsets_of(problem, {{}, std::vector<double>(problem.targets.size(), 0), {.jitter = 3e-4}});
    EXPECT_NEAR(offsets.error[dark], sizes * noise, 1e-9);
    EXPECT_NEAR(offsets.noise[dark], noise, 1e-9);
    EXPECT_EQ(misplaced(offsets).size(), sizes > settings.misplaced_sd ? 1U : 0U);
  }
}

/// With light from inside the camera, a brighter board appears at another distance without having moved.
TEST_F(Clutter, ABrighterBoardStandsWhereItStood) {
  const std::size_t brighter = conditions.size() - 1;
  const std::string target = std::exchange(conditions[brighter].target, "brighter");
  measure();
  const auto design_of_truth = std::move(design);
  const auto its_candidates = std::move(candidates);
  const auto crosstalk = std::ranges::find_if(its_candidates, [](const auto& c) { return c->name() == "crosstalk"; });
  const Problem truth = make_problem(*design_of_truth, blank);
  State state{{random_term(**crosstalk, 3, 30)}, std::vector<double>(truth.targets.size(), 0), {}};
  state.random_sd = {.jitter = 5e-4, .offset = 0, .light = 2e-3};
  state.log_reflectivity[static_cast<std::size_t>(truth.target[brighter])] = 0.1;
  const std::vector<Observations> data = injected(truth, state, 31);
  conditions[brighter].target = target;
  measure();
  const Problem problem = make_problem(*design, data);
  state.log_reflectivity.assign(problem.targets.size(), 0);
  update_reflectivity_jacobian(problem, state);
  EXPECT_LT(std::abs(board_offsets_of(problem, state).error[brighter]), 2e-3);
  state.random_sd.light = 0;
  EXPECT_GT(std::abs(board_offsets_of(problem, state).error[brighter]), 6e-3)
      << "whose light is taken for known has moved";
}

/// A residual that lasts for some conditions, as caused by air and reflections.
class LastingResidue : public Clutter {
 protected:
  void SetUp() override {
    Clutter::SetUp();
    for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].order = (7 * i) % conditions.size();
    measure();
    keep_few();
  }
  /// Waves over the image. @param turns radians from one condition to the next, standard deviation
  std::vector<Observations> with_waves(std::vector<Observations> data, double turns) const {
    std::mt19937_64 generator(48);
    std::normal_distribution<double> normal;
    struct Wave {
      double x, y, phase, turn;
    };
    std::vector<Wave> waves(30);
    for (Wave& w : waves)
      w = {2 * normal(generator), 2 * normal(generator), 6 * normal(generator), turns * normal(generator)};
    return shifted(std::move(data), [&](std::size_t i, std::size_t s) {
      double sum = 0;
      for (const Wave& w : waves) {
        const auto x = static_cast<double>(s % 12) / 6, y = static_cast<double>(s / 12) / 6;
        sum += std::cos(w.x * x + w.y * y + w.phase + w.turn * static_cast<double>(*conditions[i].order));
      }
      return 0.5e-3 * sum * std::sqrt(2.0 / 30);
    });
  }
};

/// With few independent runs it is unlikely to look like a pattern.
TEST_F(LastingResidue, IsNoEffect) {
  const SearchResult result = searched(with_waves(data_with({}, 49), 1.0 / 3));
  EXPECT_EQ(names(result), std::vector<std::string>{});
  EXPECT_FALSE(result.something_left());
  ASSERT_TRUE(result.after.state.nuisances.smooth_field);
  const std::set<Eigen::Index> runs(result.after.state.nuisances.runs.begin(), result.after.state.nuisances.runs.end());
  EXPECT_GE(runs.size(), 4U);
  EXPECT_LE(runs.size(), 10U) << "of 20 conditions, correlated over some 3";
}

TEST_F(LastingResidue, KeepsNoEffectFromItsName) {
  const SearchResult result = searched(with_waves(data_with(wiggling(), 51), 1.0 / 3));
  EXPECT_EQ(names(result), std::vector<std::string>{"wiggling"});
}

/// A field that lasts for the whole campaign may belong to the camera, and sign flips cannot detect it.
TEST_F(LastingResidue, IsNoneWhereItNeverChanges) {
  const SearchResult result = searched(with_waves(data_with({}, 52), 0));
  EXPECT_FALSE(result.after.state.nuisances.smooth_field);
  EXPECT_TRUE(result.something_left()) << fmt::format("{}", fmt::join(names(result), ", "));
}

/// The effective sample size of a gain is the number of groups of conditions that change sign together.
TEST_F(LastingResidue, IsCarriedByRuns) {
  const std::vector<Observations> data = data_with({}, 53);
  const Problem problem = make_problem(*design, data);
  Group group{{Column(design->size(), std::vector<double>(design->rows(), 0))}};
  for (std::size_t i = 0; i < design->size(); ++i)
    std::fill_n(group.columns[0][i].begin(), design->superpixels(), 1e-3 * (i % 2 == 0 ? 1 : -1));
  std::vector<Observations> even = data;
  for (std::size_t i = 0; i < even.size(); ++i) {
    for (std::size_t row = 0; row < design->rows(); ++row)
      even[i].value[row] = blank[i].value[row] + group.columns[0][i][row], even[i].variance[row] = 1e-8;
  }
  const Problem same = with_data(problem, even);
  ModelFit fit;
  fit.state = {{}, std::vector<double>(problem.targets.size(), 0), {.jitter = 1e-6, .offset = 0, .light = 1e-6}};
  const double all = static_cast<double>(design->size());
  EXPECT_GT(score_of(same, fit, group).effective_sample_size, 0.8 * all);
  for (std::size_t i = 0; i < design->size(); ++i) fit.state.nuisances.runs.push_back(static_cast<Eigen::Index>(i / 5));
  EXPECT_NEAR(score_of(same, fit, group).effective_sample_size, all / 5, 0.5);
}

/// A score is the decrease in deviance when its columns are fitted, beside shared effects and a smooth field.
TEST_F(Clutter, AScoreIsTheFallOfTheDeviance) {
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    conditions[i].session = std::to_string(i / 7);
    conditions[i].order = i;
  }
  measure();
  const std::vector<Observations> data = shifted(data_with({}, 30), [](std::size_t i, std::size_t s) {
    return 3e-3 * (i / 7 == 1) + 1e-5 * static_cast<double>(s);
  });
  const Problem problem = make_problem(*design, data);
  ModelFit fit;
  fit.state = {{},
               std::vector<double>(problem.targets.size(), 0.1),
               {.jitter = 5e-4, .offset = 0, .drift = 3e-4, .session = 2e-3}};
  fit.state.nuisances.smooth_field = std::make_shared<const SmoothField>(SmoothField(data), 2e-4);
  Group group;
  for (const int power : {1, 2}) {
    Column& column = group.columns.emplace_back(design->size(), std::vector<double>(design->rows(), 0));
    for (std::size_t i = 0; i < design->size(); ++i) {
      for (std::size_t s = 0; s < design->superpixels(); ++s)
        column[i][distance * design->superpixels() + s] =
            1e-3 * std::pow(0.1 * static_cast<double>(i), power) + 1e-5 * static_cast<double>(s % 12);
    }
  }
  const auto rows = expected(problem, fit.state);
  const std::vector<double> weight(design->size(), 1);
  const auto deviance = [&](std::span<const Column> columns) {
    std::vector<Gram> grams = grams_of(problem, fit.state, rows, columns);
    std::vector<double> determinants(grams.size());
    for (std::size_t i = 0; i < grams.size(); ++i) grams[i] = marginal(grams[i], fit.state.random_sd, determinants[i]);
    const Unknowns unknowns = problem.unknowns(columns.size());
    return solve(assemble(grams, determinants, unknowns, weight), unknowns, fit.state.random_sd);
  };
  const Score score = score_of(problem, fit, group);
  const Solution with = deviance(group.columns);
  EXPECT_GT(score.gain, 1);
  EXPECT_NEAR(score.gain, deviance({}).deviance - with.deviance, 1e-6 * score.gain);
  for (Eigen::Index c = 0; c < 2; ++c) EXPECT_NEAR(score.values(c), with.values(c), 1e-6 * std::abs(with.values(c)));

  // Beside a map with a free value per superpixel; its steps are so large that their prior has no influence.
  Column map(design->size(), std::vector<double>(design->rows(), 0));
  std::vector<Column> values(design->superpixels(), map);
  for (std::size_t i = 0; i < design->size(); ++i) {
    for (std::size_t s = 0; s < design->superpixels(); ++s)
      for (const std::size_t row : {s, amplitude * design->superpixels() + s})
        map[i][row] = values[s][i][row] = 0.1 * (1 + 0.05 * static_cast<double>((i + row) % 5));
  }
  std::vector<Column> both = values;
  both.insert(both.end(), group.columns.begin(), group.columns.end());
  const Group* const only = &group;
  const Scanner scanner(problem, fit, std::span(&only, 1), std::span(&map, 1));
  const double beside = scanner.scan(fit.state.random_sd, 0).scores[0].gain;
  EXPECT_NEAR(beside, deviance(values).deviance - deviance(both).deviance, 1e-5 * score.gain);
  EXPECT_LT(beside, 0.9 * score.gain);
}

/// A model with large errors: board positions and light are unconstrained. The part common to each condition then
/// carries no information; the remainder of columns that are nearly common must not be rounding noise.
TEST_F(Clutter, AScorePromisesNoMoreThanThereIs) {
  measure();
  std::vector<Observations> data = data_with({}, 31);
  const std::size_t n = design->superpixels();
  for (std::size_t i = 0; i < design->size(); ++i) {
    for (std::size_t s = 0; s < n; ++s)
      data[i].value[amplitude * n + s] += 0.3 * std::sin(static_cast<double>(s + 7 * i));
    for (double& variance : data[i].variance) variance *= 1e-6;
  }
  const Problem problem = make_problem(*design, data);
  ModelFit fit;
  fit.state = {{}, std::vector<double>(problem.targets.size(), 0), {.jitter = 1, .offset = 0.01, .light = 0.1}};
  Group group;
  group.columns.reserve(8);
  for (const double part : {1.0, 1e-5, 1e-7, 0.0}) {
    Column& board = group.columns.emplace_back(design->size(), std::vector<double>(design->rows(), 0));
    Column& light = group.columns.emplace_back(design->size(), std::vector<double>(design->rows(), 0));
    for (std::size_t i = 0; i < design->size(); ++i) {
      for (std::size_t s = 0; s < n; ++s) {
        const double other = part * std::cos(static_cast<double>(3 * s + i));
        board[i][s] = fit.state.jitter_response(problem, i, s) + other;
        light[i][amplitude * n + s] = light[i][intensity * n + s] = 1 + other;
      }
    }
  }
  const Group* const only = &group;
  const Scan scanned = scan(problem, fit, std::span(&only, 1));
  const Eigen::MatrixXd& information = scanned.scores[0].information;
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(information).eigenvalues();
  EXPECT_GT(values.minCoeff(), -1e-9 * values.maxCoeff());
  Eigen::MatrixXd inner = information;
  inner.diagonal().array() += 1 / (settings.prior_width * settings.prior_width);
  const Eigen::VectorXd score = scanned.scores[0].score();
  EXPECT_LE(score.dot(inner.ldlt().solve(score)), scanned.square);
  EXPECT_GT(scanned.square, 0);
}

TEST(SmoothResidue, IsWhitenedAsItsCovarianceSays) {
  std::mt19937_64 generator(29);
  std::uniform_real_distribution<double> uniform(0.5, 2);
  constexpr std::size_t n = 144, unknown = 17;
  Observations data{std::vector<double>(observables * n, 0), std::vector<double>(observables * n, 1e-8)};
  for (std::size_t s = 0; s < n; ++s) data.variance[s] *= uniform(generator);
  data.variance[unknown] = std::numeric_limits<double>::infinity();
  constexpr double sd = 3e-4;
  const SmoothField smooth_field(SmoothField({data}), sd);
  const Eigen::MatrixXd modes = smooth_field.modes(0);
  const Eigen::VectorXd variance = smooth_field.taken(0).array() / (1 - smooth_field.taken(0).array());
  const Eigen::MatrixXd covariance =
      Eigen::MatrixXd::Identity(n, n) + modes * variance.asDiagonal() * modes.transpose();
  Eigen::MatrixXd root = Eigen::MatrixXd::Identity(n, n);
  smooth_field.whiten(0, root);
  EXPECT_LT((root * covariance * root.transpose() - Eigen::MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(smooth_field.log_determinant(0), covariance.ldlt().vectorD().array().log().sum(), 1e-8);
  double sum = 0;
  for (std::size_t s = 0; s < n; ++s) {
    const auto at = static_cast<Eigen::Index>(s);
    if (s != unknown)
      sum += (covariance(at, at) - 1) * data.variance[s];
    else
      EXPECT_NEAR(covariance(at, at), 1, 1e-12);
  }
  EXPECT_NEAR(std::sqrt(sum / (n - 1)), sd, 0.02 * sd) << "over the image it is what it is called";
}

}  // namespace
}  // namespace tofgraph::diagnosis
