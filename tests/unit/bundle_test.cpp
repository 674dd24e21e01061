// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: *
// Rooms: calibration
// Lens from corners, compared with the Cramer-Rao bound and its own intervals, with and without measured distances.
#include <gtest/gtest.h>

#include "calibration/bundle.hpp"
#include "calibration/lens_distances.hpp"
#include "tests/unit/lens_truth.hpp"

#include <array>
#include <cmath>

using namespace tofgraph::calibration;

namespace {

constexpr double corner_noise = 0.1;  // px
constexpr std::size_t seeds = 400;
constexpr std::array<const char*, 8> names = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"};

std::array<double, 8> values_of(const test::TrueLens& l) { return {l.fx, l.fy, l.cx, l.cy, l.k1, l.k2, l.p1, l.p2}; }

/// 100 calibrations of the same views with different noise.
void compare_with_bound(const test::TrueScene& scene) {
  const Eigen::MatrixXd bound = scene.bound(corner_noise, true);
  const std::array<double, 8> truth = values_of(scene.lens);
  std::array<double, 8> squares{}, inside{};
  for (unsigned seed = 0; seed < seeds; ++seed) {
    const LensSolution solution = solve_lens(scene.observed(corner_noise, seed), {});
    ASSERT_EQ(solution.left_out.size(), 0U);
    for (std::size_t i = 0; i < 8; ++i) {
      const double error = solution.lens[i] - truth[i];
      squares[i] += error * error / seeds;
      inside[i] += std::abs(error) < 1.96 * solution.sd(i) ? 1.0 / seeds : 0;
    }
  }
  double mean_inside = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double crb = std::sqrt(bound(at, at)), rms = std::sqrt(squares[i]);
    std::printf("%s: bound %.3g, rms error %.3g, ratio %.3f, inside %.0f %%\n", names[i], crb, rms, rms / crb,
                100 * inside[i]);
    EXPECT_LE(rms, 1.1 * crb) << names[i];
    EXPECT_GE(inside[i], 0.90) << names[i];
    mean_inside += inside[i] / 8;
  }
  EXPECT_LE(mean_inside, 0.99);
  const double focal = std::sqrt(bound(0, 0)) / scene.lens.fx;
  EXPECT_GE(focal, 0.001) << "the views are as hard as those of a real camera";
  EXPECT_LE(focal, 0.0035);
}

test::TrueScene scene_of(double sag) {
  test::TrueScene scene;
  scene.board.sag = sag;
  scene.poses = test::true_poses(scene.lens, scene.board, 25);
  return scene;
}

TEST(Bundle, ReachesTheCramerRaoBoundWithHonestIntervals) { compare_with_bound(scene_of(0)); }

TEST(Bundle, ReachesTheBoundWithAWarpedBoard) { compare_with_bound(scene_of(1e-3)); }

/// Simulated measured distances: half of the path source - point - lens - pixel with two lamps, plus an offset, a
/// scale, a shift per view and noise; wiggling is the amplitude of a cyclic error with four periods in the unambiguous
/// range of 20 MHz.
void add_distances(const test::TrueScene& scene, Observations& seen, unsigned seed, double wiggling = 0) {
  constexpr double pitch = 40e-6, period = 7.5 / 4, noise = 1e-3, offset = 0.02, scale = 0.003, shift = 1e-3;
  const double focal_length = (scene.lens.fx + scene.lens.fy) / 2 * pitch;
  const Eigen::Vector3d lamps[] = {{-0.05, 0, 0}, {0.05, 0, 0}};
  seen.light = LightPaths{{{{-0.05, 0, 0}, 0.5}, {{0.05, 0, 0}, 0.5}}, {pitch, pitch}};
  std::mt19937 random(seed + 1000);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < scene.poses.size(); ++i) {
    const double of_view = shift * normal(random);
    for (double x = -0.1; x <= 0.1; x += 0.02) {
      for (double y = -0.07; y <= 0.07; y += 0.02) {
        const Eigen::Vector3d optical = scene.poses[i].camera(scene.board.bent(x, y));
        const Eigen::Vector2d pixel = scene.lens.image(optical);
        const Eigen::Vector3d point = optical + Eigen::Vector3d(0, 0, focal_length);
        const double forth = ((point - lamps[0]).norm() + (point - lamps[1]).norm()) / 2;
        const double inside = focal_length * optical.norm() / optical.z();
        const double half = (forth + optical.norm() + inside) / 2;
        const double cyclic = wiggling * std::sin(2 * M_PI * half / period);
        seen.views[i].distances.push_back(
            {pixel.x(), pixel.y(), half * (1 + scale) + offset + of_view + cyclic + noise * normal(random), noise});
      }
    }
  }
}

/// An unknown offset and an unknown scale of the distances, which tilted boards determine, do not bias the focal
/// length.
TEST(Bundle, DistancesOfTheBoardHalveTheErrorOfTheFocalLength) {
  const test::TrueScene scene = scene_of(0.3e-3);
  double alone = 0, together = 0, inside = 0, stated = 0, offset = 0, bias = 0;
  constexpr unsigned count = 40;
  for (unsigned seed = 0; seed < count; ++seed) {
    Observations seen = scene.observed(corner_noise, seed);
    add_distances(scene, seen, seed);
    LensOptions options;
    const LensSolution with = solve_lens(seen, options);
    options.distances = false;
    const LensSolution without = solve_lens(seen, options);
    ASSERT_TRUE(with.with_distances && !without.with_distances);
    const double error = with.lens[lens::fx] - scene.lens.fx;
    alone += std::pow(without.lens[lens::fx] - scene.lens.fx, 2) / count;
    together += error * error / count;
    bias += error / count;
    stated += with.sd(lens::fx) / count;
    offset += with.range_offset / count;
    inside += std::abs(error) < 1.96 * with.sd(lens::fx) ? 1.0 / count : 0;
    if (seed == 0)
      std::printf("shift sd %.2g m, noise factor %.3f, scale %.4f\n", with.range_shift_sd, with.range_noise_factor,
                  with.range_scale);
  }
  std::printf(
      "fx: rms error %.3f px from corners, %.3f px with distances (stated %.3f, bias %.3f, inside %.0f %%), "
      "offset %.2f mm\n",
      std::sqrt(alone), std::sqrt(together), stated, bias, 100 * inside, 1e3 * offset);
  EXPECT_LE(std::sqrt(together), 0.5 * std::sqrt(alone));
  EXPECT_LE(std::abs(bias), 3 * std::sqrt(together / count));
  EXPECT_GE(inside, 0.85);
  EXPECT_NEAR(offset, 0.02, 0.002);
}

/// A range-dependent distance error of 20 mm would bias the focal length; correct distances are hardly ever rejected.
TEST(Bundle, DistancesThatDoNotFitTheCornersAreTold) {
  const test::TrueScene scene = scene_of(0.3e-3);
  for (const double wiggling : {0.0, 0.02, -0.02}) {
    const unsigned count = wiggling == 0 ? 30 : 5;
    unsigned told = 0;
    double worst = 0, worst_alone = 0;
    for (unsigned seed = 0; seed < count; ++seed) {
      Observations seen = scene.observed(corner_noise, seed);
      add_distances(scene, seen, seed, wiggling);
      LensOptions options;
      const LensSolution joint = solve_lens(seen, options);
      options.distances = false;
      const LensSolution corners = solve_lens(seen, options);
      const DistanceCheck check = check_distances(corners, joint);
      const LensSolution& result = check.fit() ? joint : corners;
      if (!check.fit() && wiggling == 0)
        std::printf("  seed %u: chi-square %.1f of %.0f, p %.2g, scale %.4f\n", seed, check.statistic, check.terms,
                    check.p_value, check.range_scale);
      told += check.fit() ? 0 : 1;
      worst = std::max(worst, std::abs(joint.lens[lens::fx] - scene.lens.fx) / joint.sd(lens::fx));
      worst_alone = std::max(worst_alone, std::abs(result.lens[lens::fx] - scene.lens.fx) / result.sd(lens::fx));
      EXPECT_EQ(check.fit(), check.reason().empty());
    }
    std::printf("wiggling %.0f mm: told %u of %u; fx off by %.1f sd with distances, %.1f sd in the result\n",
                wiggling * 1e3, told, count, worst, worst_alone);
    EXPECT_LT(worst_alone, 3);
    if (wiggling == 0)
      EXPECT_LE(told, 1U);
    else
      EXPECT_EQ(told, count);
  }
}

}  // namespace
