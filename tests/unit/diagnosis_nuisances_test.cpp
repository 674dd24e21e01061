// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What conditions have of their own is no effect: sessions, boards that stand elsewhere, a residue that is smooth over
// the image. None of it makes a name, and an effect beside it keeps its own.
#include "tests/unit/rail.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <set>

namespace tofgraph::diagnosis {
namespace {

class Clutter : public Rail {
 protected:
  /// Few candidates do here.
  void keep_few() {
    const std::set<std::string> kept = {"wiggling",        "crosstalk",   "source_position",
                                        "lens_distortion", "zero_offset", "integration_time_offset",
                                        "principal_point"};
    std::erase_if(candidates, [&](const auto& c) { return !kept.contains(c->name()); });
  }
  void SetUp() override {
    Rail::SetUp();
    keep_few();
  }

  /// Data in which every pixel of a condition shows more distance. @param more by condition and superpixel, m
  template <class F> std::vector<Observations> shifted(std::vector<Observations> data, F more) const {
    const std::size_t n = design->superpixels();
    for (std::size_t i = 0; i < data.size(); ++i) {
      for (std::size_t s = 0; s < n; ++s) data[i].value[distance * n + s] += more(i, s);
    }
    return data;
  }

  SearchResult searched(const std::vector<Observations>& data) const {
    return search(make_problem(*design, data), {}, candidates, {});
  }

  /// A wiggle, and what the clutter makes of the search for it.
  void expect_wiggling_alone(const SearchResult& result, const std::vector<double>& truth) const {
    ASSERT_EQ(names(result), std::vector<std::string>{"wiggling"});
    EXPECT_TRUE(result.rest.empty()) << name_of(result.rest.front());
    EXPECT_EQ(result.patterns_without_axis(), 0U);
    EXPECT_NEAR(result.after.state.terms[0].values[0], truth[0], 4e-4);
    EXPECT_NEAR(result.after.state.terms[0].values[1], truth[1], 0.1);
  }

  static constexpr std::array<double, 2> wiggle = {5e-3, 0.4};
  std::vector<Term> wiggling() const { return {{&effect("wiggling"), {wiggle.begin(), wiggle.end()}}}; }
};

TEST_F(Clutter, SessionsAreNoEffect) {
  constexpr std::array<double, 3> offset = {-3e-3, 1e-3, 4e-3};
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].session = std::to_string(i % 3);
  measure();
  keep_few();
  const auto session = [&](std::size_t i, std::size_t) { return offset.at(i % 3); };
  EXPECT_EQ(names(searched(shifted(data_with({}, 21), session))), std::vector<std::string>{});
  const SearchResult result = searched(shifted(data_with(wiggling(), 22), session));
  expect_wiggling_alone(result, {wiggle.begin(), wiggle.end()});
  // The likeliest standard deviation of three offsets around zero.
  EXPECT_NEAR(result.after.state.variances.session, std::sqrt((9 + 1 + 16) / 3.0) * 1e-3, 3e-4);
  EXPECT_LT(result.after.state.variances.jitter, 1e-3);
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
    EXPECT_NEAR(result.misplaced[0].off, 20e-3, 2e-3);
    EXPECT_LT(result.after.state.variances.jitter, 1e-3) << "the others' is as it was";
  }
  EXPECT_TRUE(searched(data_with(wiggling(), 24)).misplaced.empty());
}

/// Each target a shape of its own, 1 mm in waves of 0.9 to 1.3 m: heights in the places where pixels meet the board.
class BentBoards : public Clutter {
 protected:
  /// @param of shape of a target
  template <class F> std::vector<Observations> bent(std::vector<Observations> data, F of) const {
    const std::size_t n = design->superpixels();
    for (std::size_t i = 0; i < data.size(); ++i) {
      const io::Condition& c = design->conditions()[i];
      for (std::size_t s = 0; s < n; ++s) {
        const simulation::Vector3& ray = design->pixels().rays[s];
        const double height = of(c.target, c.board_distance * ray.x / ray.z, c.board_distance * ray.y / ray.z);
        for (std::size_t o = 0; o < observables; ++o) data[i].value[o * n + s] += height * design->shift(i)[o * n + s];
      }
    }
    return data;
  }
  static double own_shape(const std::string& target, double x, double y) {
    const auto k = static_cast<double>(target.size() % 5);
    return 1e-3 * (std::sin(2 * std::numbers::pi * x / (0.9 + 0.1 * k) + k) +
                   std::cos(2 * std::numbers::pi * y / 1.2 - 2 * k));
  }
};

TEST_F(BentBoards, AreNoEffectAndAreShownAsTheyAre) {
  const SearchResult result = searched(bent(data_with({}, 41), own_shape));
  EXPECT_EQ(names(result), std::vector<std::string>{});
  ASSERT_TRUE(result.allowed.boards);
  EXPECT_NEAR(result.allowed.boards->sd, 1e-3, 2e-4);
  const SearchResult beside = searched(bent(data_with(wiggling(), 42), own_shape));
  expect_wiggling_alone(beside, {wiggle.begin(), wiggle.end()});
}

/// What all targets have alike is the camera's, or the room's.
TEST_F(BentBoards, OneShapeForAllIsNone) {
  const SearchResult result =
      searched(bent(data_with({}, 43), [](const std::string&, double x, double y) { return own_shape("one", x, y); }));
  EXPECT_FALSE(result.allowed.boards);
  EXPECT_TRUE(result.something_left() || !result.found.empty());
}

/// One target, seen from many distances: what goes with the board grows in the image as it comes near.
class OneBentBoard : public BentBoards {
 protected:
  void SetUp() override {
    BentBoards::SetUp();
    for (io::Condition& c : conditions) c.target = "white";
    measure();
    keep_few();
  }
};

TEST_F(OneBentBoard, IsNoEffectAndKeepsItsPlace) {
  const SearchResult result = searched(bent(data_with({}, 44), own_shape));
  EXPECT_EQ(names(result), std::vector<std::string>{});
  EXPECT_FALSE(result.something_left());
  ASSERT_TRUE(result.allowed.boards);
  EXPECT_NEAR(result.allowed.boards->sd, 1e-3, 2e-4);
  EXPECT_LT(result.after.state.variances.jitter, 8e-4) << "0.5 mm";
  expect_wiggling_alone(searched(bent(data_with(wiggling(), 45), own_shape)), {wiggle.begin(), wiggle.end()});
}

/// What goes with the camera is none of the board's, however smooth.
TEST_F(OneBentBoard, IsNotTakenForTheCamera) {
  for (const char* hidden : {"source_position", "principal_point"}) {
    const SearchResult result = searched(data_with({random_term(effect(hidden), 1, 46)}, 46));
    EXPECT_EQ(names(result), std::vector<std::string>{hidden});
    EXPECT_FALSE(result.allowed.boards);
  }
}

/// Boards that lean: their shapes stand out along their own normal, and no amplitude lacks anything.
TEST_F(OneBentBoard, LeansAndStaysAsItIs) {
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].board_tilt_y = i % 4 == 1 ? 0.5 : 0;
  measure();
  keep_few();
  std::vector<Observations> data = data_with({}, 47);
  const std::size_t n = design->superpixels();
  for (std::size_t i = 0; i < data.size(); ++i) {
    const simulation::BoardPose pose = pose_of(design->conditions()[i]);
    const std::vector<simulation::Vector3>& rays = design->pixels().rays;
    std::vector<simulation::Hit> hits(n);
    simulation::board_tracer(design->camera().focal_length, pose)({}, rays, hits);
    const double lean = std::cos(pose.tilt_y);
    for (std::size_t s = 0; s < n; ++s) {
      // Along the board, which turns about y; a height along its normal is so much more along the axis.
      const double x = hits[s].point.x / lean, height = own_shape("white", x, hits[s].point.y) / lean;
      for (std::size_t o = 0; o < observables; ++o) data[i].value[o * n + s] += height * design->shift(i)[o * n + s];
    }
  }
  const SearchResult result = searched(data);
  EXPECT_EQ(names(result), std::vector<std::string>{});
  EXPECT_FALSE(result.something_left());
  EXPECT_LT(result.lack_of_fit, 1.03);
}

/// A residue that stays for some conditions, as air and reflections do, has few chances to look like a pattern.
TEST_F(Clutter, AResidueThatStaysForAWhileIsNoEffect) {
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].order = (7 * i) % conditions.size();
  measure();
  keep_few();
  std::mt19937_64 generator(48);
  std::normal_distribution<double> normal;
  struct Wave {
    double x, y, phase, turn;
  };
  std::vector<Wave> waves(30);
  for (Wave& w : waves)
    w = {2 * normal(generator), 2 * normal(generator), 6 * normal(generator), normal(generator) / 3};
  const auto residue = [&](std::size_t i, std::size_t s) {
    double sum = 0;
    for (const Wave& w : waves) {
      const auto x = static_cast<double>(s % 12) / 6, y = static_cast<double>(s / 12) / 6;
      sum += std::cos(w.x * x + w.y * y + w.phase + w.turn * static_cast<double>(*conditions[i].order));
    }
    return 0.5e-3 * sum * std::sqrt(2.0 / 30);
  };
  const SearchResult result = searched(shifted(data_with({}, 49), residue));
  EXPECT_EQ(names(result), std::vector<std::string>{});
  EXPECT_FALSE(result.something_left());
  ASSERT_TRUE(result.allowed.residue);
  const std::set<Eigen::Index> runs(result.allowed.runs.begin(), result.allowed.runs.end());
  EXPECT_GE(runs.size(), 4U);
  EXPECT_LE(runs.size(), 10U) << "of 20 conditions, correlated over some 3";
}

/// A score is the fall of the deviance when its columns are solved for, beside what is shared and a residue.
TEST_F(Clutter, AScoreIsTheFallOfTheDeviance) {
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    conditions[i].session = std::to_string(i / 7);
    conditions[i].order = i;
  }
  measure();
  const std::vector<Observations> data = shifted(data_with({}, 30), [](std::size_t i, std::size_t s) {
    return 3e-3 * (i / 7 == 1) + 1e-5 * static_cast<double>(s);
  });
  Problem problem = make_problem(*design, data);
  problem.allowed.residue = std::make_shared<const Residue>(Residue(data), 2e-4);
  Fit fit;
  fit.state = {{},
               std::vector<double>(problem.targets.size(), 0.1),
               {.jitter = 5e-4, .offset = 0, .drift = 3e-4, .session = 2e-3}};
  Group group{"ramp", {}};
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
    std::vector<Gram> grams = grams_of(problem, rows, columns);
    std::vector<double> determinants(grams.size());
    for (std::size_t i = 0; i < grams.size(); ++i) grams[i] = marginal(grams[i], fit.state.variances, determinants[i]);
    const Unknowns unknowns = problem.unknowns(columns.size());
    return solve(assemble(grams, determinants, unknowns, weight), unknowns, fit.state.variances);
  };
  const Score score = score_of(problem, fit, {}, group, 0, 0);
  const Solution with = deviance(group.columns);
  EXPECT_GT(score.gain, 1);
  EXPECT_NEAR(score.gain, deviance({}).deviance - with.deviance, 1e-6 * score.gain);
  for (Eigen::Index c = 0; c < 2; ++c) EXPECT_NEAR(score.values(c), with.values(c), 1e-6 * std::abs(with.values(c)));
}

/// A model that is far off: boards may stand anywhere, and light may be anything. What is common to each condition then
/// says nothing; what is left of columns that are nearly that must not be rounding.
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
  Fit fit;
  fit.state = {{}, std::vector<double>(problem.targets.size(), 0), {.jitter = 1, .offset = 0.01, .light = 0.1}};
  Group group{"common", {}};
  group.columns.reserve(8);
  for (const double part : {1.0, 1e-5, 1e-7, 0.0}) {
    Column& board = group.columns.emplace_back(design->size(), std::vector<double>(design->rows(), 0));
    Column& light = group.columns.emplace_back(design->size(), std::vector<double>(design->rows(), 0));
    for (std::size_t i = 0; i < design->size(); ++i) {
      for (std::size_t s = 0; s < n; ++s) {
        const double other = part * std::cos(static_cast<double>(3 * s + i));
        board[i][s] = problem.jitter_response(i, s) + other;
        light[i][amplitude * n + s] = light[i][intensity * n + s] = 1 + other;
      }
    }
  }
  const Group* const only = &group;
  const Scan scanned = scan(problem, fit, {}, std::span(&only, 1), 0, 0);
  const Eigen::MatrixXd& information = scanned.scores[0].information;
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(information).eigenvalues();
  EXPECT_GT(values.minCoeff(), -1e-9 * values.maxCoeff());
  Eigen::MatrixXd inner = information;
  inner.diagonal().array() += 1 / (prior_width * prior_width);
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
  const Residue residue(Residue({data}), sd);
  const Eigen::MatrixXd modes = residue.modes(0);
  const Eigen::VectorXd variance = residue.taken(0).array() / (1 - residue.taken(0).array());
  const Eigen::MatrixXd covariance =
      Eigen::MatrixXd::Identity(n, n) + modes * variance.asDiagonal() * modes.transpose();
  Eigen::MatrixXd root = Eigen::MatrixXd::Identity(n, n);
  residue.whiten(0, root);
  EXPECT_LT((root * covariance * root.transpose() - Eigen::MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(residue.log_determinant(0), covariance.ldlt().vectorD().array().log().sum(), 1e-8);
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
