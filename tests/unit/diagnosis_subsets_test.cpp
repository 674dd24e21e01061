// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The best sets of effects, compared with an exhaustive search with dense least squares.
#include "diagnosis/search/alternatives.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>

#include <algorithm>
#include <map>
#include <random>

namespace tofgraph::diagnosis {
namespace {

/// Columns of unit noise, a residual, and their Gram matrix and scores.
struct Regression {
  Eigen::MatrixXd columns;
  Eigen::VectorXd residual;
  Eigen::MatrixXd information() const { return columns.transpose() * columns; }
  Eigen::VectorXd score() const { return columns.transpose() * residual; }
  /// Decrease in the sum of squares, from a decomposition that never forms a Gram matrix.
  double gain(const std::vector<Eigen::Index>& chosen) const {
    const Eigen::MatrixXd some = columns(Eigen::all, chosen);
    const Eigen::VectorXd fitted = some * some.colPivHouseholderQr().solve(residual);
    return residual.squaredNorm() - (residual - fitted).squaredNorm();
  }
};

constexpr double exact = 1e-12;  // of a prior: effectively none

std::vector<Choice> single_columns(Eigen::Index count) {
  std::vector<Choice> choices;
  for (Eigen::Index c = 0; c < count; ++c) choices.push_back({static_cast<std::size_t>(c), {c}, 1});
  return choices;
}

const Subset& best_of(const std::vector<Subset>& sets, std::size_t size) {
  return *std::ranges::find_if(sets, [size](const Subset& set) { return set.choices.size() == size; });
}

/// Two columns that nearly cancel, so that each alone explains almost nothing, and a third that resembles their sum: a
/// greedy search takes the third first.
TEST(Subsets, FindAPairThatNoneOfWhichShowsAlone) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  Regression all{Eigen::MatrixXd(400, 6), {}};
  for (double& value : all.columns.reshaped()) value = normal(generator);
  all.columns.col(1) = -all.columns.col(0) + 0.1 * all.columns.col(1);
  const Eigen::VectorXd truth = 8 * (all.columns.col(0) + all.columns.col(1));
  all.columns.col(2) = truth / 8 + 0.05 * all.columns.col(2);
  all.residual = truth;
  std::vector<double> alone;
  for (Eigen::Index c = 0; c < 6; ++c) alone.push_back(all.gain({c}));
  ASSERT_GT(alone[2], 5 * std::max(alone[0], alone[1])) << "the first step of a greedy search is wrong";
  const std::vector<Subset> sets =
      best_subsets(all.information(), all.score(), single_columns(6), {.price = 5, .prior = exact});
  EXPECT_EQ(best_of(sets, 2).choices, (std::vector<std::size_t>{0, 1}));
  EXPECT_NEAR(best_of(sets, 2).gain, truth.squaredNorm(), 1e-6 * truth.squaredNorm());
  EXPECT_NEAR(best_of(sets, 2).values(0), 8, 1e-6);
  EXPECT_NEAR(best_of(sets, 2).values(1), 8, 1e-6);
}

/// More single effects than sets may be requested.
TEST(Subsets, AsManyOfEachSizeAsAreAsked) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  Regression all{Eigen::MatrixXd(100, 8), {}};
  for (double& value : all.columns.reshaped()) value = normal(generator);
  all.residual = all.columns * Eigen::VectorXd::LinSpaced(8, 4, 9);
  const std::vector<Subset> sets = best_subsets(all.information(), all.score(), single_columns(8),
                                                {.kept = 2, .singles = 5, .price = 5, .prior = exact});
  const auto of_size = [&](std::size_t size) {
    return std::ranges::count_if(sets, [size](const Subset& set) { return set.choices.size() == size; });
  };
  EXPECT_EQ(of_size(1), 5);
  EXPECT_EQ(of_size(2), 2);
  EXPECT_EQ(of_size(3), 2);
}

/// Effects with one to three columns and one or two choices each, correlated.
TEST(Subsets, AreThoseOfAllThatAreTriedOneByOne) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    std::vector<Choice> choices;
    Eigen::Index count = 0;
    for (std::size_t effect = 0; effect < 7; ++effect) {
      for (std::size_t way = 0; way < 1 + effect % 2; ++way) {
        Choice choice{effect, {}, 0};
        for (std::size_t c = 0; c < 1 + (effect + way) % 3; ++c) choice.columns.push_back(count++);
        choice.dimension = static_cast<double>(choice.columns.size());
        choices.push_back(std::move(choice));
      }
    }
    Regression all{Eigen::MatrixXd(60, count), Eigen::VectorXd(60)};
    for (double& value : all.columns.reshaped()) value = normal(generator);
    all.columns *= Eigen::MatrixXd::Identity(count, count) + 0.5 * Eigen::MatrixXd::Ones(count, count);
    for (double& value : all.residual) value = normal(generator);
    all.residual += all.columns.col(0) + 0.5 * all.columns.col(count - 1);

    constexpr double price = 3;
    std::map<std::size_t, double> most;  // merit by size
    const std::size_t n = choices.size();
    for (std::size_t bits = 1; bits < std::size_t{1} << n; ++bits) {
      std::vector<Eigen::Index> columns;
      std::vector<std::size_t> effects;
      double cost = 0;
      for (std::size_t c = 0; c < n; ++c) {
        if ((bits >> c & 1U) == 0) continue;
        effects.push_back(choices[c].effect);
        cost += price * choices[c].dimension;
        std::ranges::copy(choices[c].columns, std::back_inserter(columns));
      }
      const std::size_t size = effects.size();
      if (size > 4 || std::ranges::adjacent_find(effects) != effects.end()) continue;
      const double merit = all.gain(columns) - cost;
      const auto [at, first] = most.try_emplace(size, merit);
      if (!first) at->second = std::max(at->second, merit);
    }
    const std::vector<Subset> sets =
        best_subsets(all.information(), all.score(), choices, {.price = price, .prior = exact});
    for (const auto& [size, merit] : most) EXPECT_NEAR(best_of(sets, size).merit, merit, 1e-8) << size;
  }
}

TEST(Subsets, WithABeamAreAsGoodWhereNothingIsHidden) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  Regression all{Eigen::MatrixXd(200, 30), Eigen::VectorXd(200)};
  for (double& value : all.columns.reshaped()) value = normal(generator);
  for (double& value : all.residual) value = normal(generator);
  all.residual += all.columns(Eigen::all, std::vector<int>{3, 8, 17, 29}).rowwise().sum();
  const auto found = [&](std::size_t beam) {
    return best_subsets(all.information(), all.score(), single_columns(30), {.price = 5, .prior = exact, .beam = beam});
  };
  EXPECT_EQ(best_of(found(50), 4).choices, (std::vector<std::size_t>{3, 8, 17, 29}));
  EXPECT_NEAR(best_of(found(50), 4).merit, best_of(found(100000), 4).merit, 1e-9);
}

}  // namespace
}  // namespace tofgraph::diagnosis
