// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Closed-form derivatives of the bundle residuals, compared with Ceres' automatic derivatives of the same residuals.
#include <gtest/gtest.h>

#include "calibration/bundle_cost.hpp"

#include <Eigen/Geometry>

#include <array>
#include <random>
#include <vector>

using namespace tofgraph::calibration;

namespace {

constexpr int of_lens = static_cast<int>(lens::count);

/// Residuals and their derivatives with respect to each parameter block.
struct Evaluated {
  std::vector<double> residuals;
  std::vector<std::vector<double>> derivatives;
};
Evaluated evaluated(const ceres::CostFunction& cost, const std::vector<const double*>& parameters) {
  const auto rows = static_cast<std::size_t>(cost.num_residuals());
  Evaluated result{.residuals = std::vector<double>(rows)};
  std::vector<double*> pointers;
  for (const int size : cost.parameter_block_sizes())
    result.derivatives.emplace_back(rows * static_cast<std::size_t>(size), 1e9);
  for (std::vector<double>& block : result.derivatives) pointers.push_back(block.data());
  EXPECT_TRUE(cost.Evaluate(parameters.data(), result.residuals.data(), pointers.data()));
  return result;
}

void expect_same(const ceres::CostFunction& cost, const ceres::CostFunction& automatic,
                 const std::vector<const double*>& parameters) {
  const Evaluated own = evaluated(cost, parameters), expected = evaluated(automatic, parameters);
  for (std::size_t i = 0; i < expected.residuals.size(); ++i)
    EXPECT_NEAR(own.residuals[i], expected.residuals[i], 1e-9);
  for (std::size_t block = 0; block < expected.derivatives.size(); ++block) {
    for (std::size_t i = 0; i < expected.derivatives[block].size(); ++i) {
      const double value = expected.derivatives[block][i];
      EXPECT_NEAR(own.derivatives[block][i], value, 1e-8 * (1 + std::abs(value)))
          << "block " << block << ", number " << i;
    }
  }
}

/// A state of the fit in which no parameter is zero, including those that are rarely free.
class BundleCost : public testing::Test {
 protected:
  BundleCost() {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation.data()) =
        Eigen::AngleAxisd(0.5, Eigen::Vector3d(0.3, -0.8, 0.4).normalized()).toRotationMatrix();
  }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

  std::mt19937 random{4};
  std::array<double, 9> rotation{};
  LensParameters lens{316, 318, 101, 103, -0.44, 0.22, 0.002, -0.005, 0.05, 0.003, 0.1, -0.06, 0.02};
  std::array<double, 3> warp{1e-3, -2e-3, 5e-4};
  std::array<double, 2> range{0.02, 0.003};
  std::array<double, 7> pose{0.01, -0.02, 0.015, 0.05, -0.03, 0.7, 1e-3};
};

TEST_F(BundleCost, DerivativesOfACornerAreTheAutomaticOnes) {
  using Automatic = ceres::AutoDiffCostFunction<cost::CornerResidual, 2, of_lens, 3, 7>;
  for (int trial = 0; trial < 40; ++trial) {
    const double a = uniform(-1, 1), b = uniform(-1, 1);
    const cost::CornerResidual residual{.u = 90,
                                        .v = 110,
                                        .white = {9, -2, 11},
                                        .point = {0.1 * a, 0.07 * b, {a * a, b * b, a * b}},
                                        .radius = 0,
                                        .rotation = rotation.data()};
    if (trial == 20) std::fill_n(pose.begin(), 3, 0.0);  // initial state of each fit
    const Automatic automatic(new cost::CornerResidual(residual));
    expect_same(cost::CornerCost(residual), automatic, {lens.data(), warp.data(), pose.data()});
  }
}

TEST_F(BundleCost, DerivativesOfADistanceAreTheAutomaticOnes) {
  using Automatic = ceres::AutoDiffCostFunction<cost::DistanceResidual, 1, of_lens, 3, 2, 7>;
  const LightPaths light{{{{-0.05, 0, 0}, 0.4}, {{0.05, 0, 0}, 0.6}}, {40e-6, 41e-6}};
  for (int trial = 0; trial < 40; ++trial) {
    const cost::DistanceResidual residual{.u = uniform(20, 180),
                                          .v = uniform(20, 180),
                                          .distance = 0.72,
                                          .sd = 1e-3,
                                          .half_extent = {0.1, 0.07},
                                          .isotropic = trial % 2 == 1,
                                          .light = &light,
                                          .rotation = rotation.data()};
    if (trial == 20) std::fill_n(pose.begin(), 3, 0.0);
    const Automatic automatic(new cost::DistanceResidual(residual));
    expect_same(cost::DistanceCost(residual), automatic, {lens.data(), warp.data(), range.data(), pose.data()});
  }
}

}  // namespace
