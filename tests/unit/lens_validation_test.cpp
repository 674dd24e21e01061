// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: LensStructure.ALensOfTheModelIsNotAccused:ProjectionUncertainty.*:LensJudgement.HalvesAgree*
// Rooms: calibration
// Validation of a fitted lens, compared with many calibrations of the same scene: its uncertainty, and the test of the
// lens model.
#include <gtest/gtest.h>

#include "calibration/lens_validation.hpp"
#include "tests/unit/lens_truth.hpp"

#include <array>
#include <cmath>

using namespace tofgraph::calibration;

namespace {

constexpr double corner_noise = 0.1;  // px

test::TrueScene scene_of(const test::TrueLens& lens) {
  test::TrueScene scene;
  scene.lens = lens;
  scene.board.sag = 0.5e-3;
  scene.poses = test::true_poses(scene.lens, scene.board, 25);
  return scene;
}

test::TrueLens fisheye() {
  test::TrueLens lens;
  lens.fisheye = true;
  lens.fx = lens.fy = 110;  // 100 deg over the image
  lens.k1 = -0.08;
  return lens;
}

TEST(LensStructure, ALensOfTheModelIsNotAccused) {
  const test::TrueScene scene = scene_of({});
  int accused = 0, board = 0;
  std::array<int, 2> improbable{};
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Observations seen = scene.observed(corner_noise, seed);
    const LensSolution solution = solve_lens(seen, {});
    const Structure lens = lens_structure(seen, solution), bend = board_structure(seen, solution);
    accused += lens.found ? 1 : 0;
    board += bend.found ? 1 : 0;
    improbable[0] += lens.p_value < 0.05 ? 1 : 0;
    improbable[1] += bend.p_value < 0.05 ? 1 : 0;
  }
  std::printf("accused: lens %d, board %d of 100; p < 0.05: %d, %d\n", accused, board, improbable[0], improbable[1]);
  EXPECT_EQ(accused, 0);
  EXPECT_EQ(board, 0);
  EXPECT_LE(improbable[0], 12) << "5 of 100 are expected";
  EXPECT_LE(improbable[1], 12);
}

TEST(LensStructure, ALensOffTheModelIsSaid) {
  test::TrueLens strong;
  strong.k3 = 150;
  strong.k4 = -600;
  for (const auto& [name, lens] : {std::pair{"fisheye", fisheye()}, {"strong k3 and r^9", strong}}) {
    int said = 0;
    double size = 0;
    for (unsigned seed = 0; seed < 10; ++seed) {
      const Observations seen = scene_of(lens).observed(corner_noise, seed);
      const Structure structure = lens_structure(seen, solve_lens(seen, {}));
      said += structure.found ? 1 : 0;
      size += structure.size / 10;
      if (seed == 0) std::printf("%s: %s\n", name, structure.explanation.c_str());
    }
    std::printf("%s: said in %d of 10, %.3f px\n", name, said, size);
    EXPECT_EQ(said, 10) << name;
  }
}

/// The fit assumes a flat board, which bends into an S: this is attributed to the board, not to the lens.
TEST(LensStructure, ABoardBentOtherwiseIsTold) {
  const test::TrueScene scene = scene_of({});
  Observations seen = scene.observed(corner_noise, 3);
  for (std::size_t i = 0; i < seen.views.size(); ++i) {
    for (Corner& corner : seen.views[i].corners) {
      const BoardPoint& p = seen.points[corner.point];
      const double a = p.x / 0.105;
      Eigen::Vector3d at = scene.board.bent(p.x, p.y);
      const Eigen::Vector2d flat = scene.lens.image(scene.poses[i].camera(at));
      at.z() += 2e-3 * a * a * a;
      const Eigen::Vector2d bent = scene.lens.image(scene.poses[i].camera(at));
      corner.u += bent.x() - flat.x();
      corner.v += bent.y() - flat.y();
    }
  }
  const Structure board = board_structure(seen, solve_lens(seen, {}));
  EXPECT_TRUE(board.found) << board.p_value << " " << board.size;
  EXPECT_NE(board.explanation.find("S shape along x"), std::string::npos) << board.explanation;
}

/// A point fixed relative to the boards of all views, projected by 100 calibrations.
TEST(ProjectionUncertainty, IsTheScatterOfManyCalibrations) {
  const test::TrueScene scene = scene_of({});
  constexpr unsigned count = 100;
  constexpr std::array<std::array<double, 3>, 3> places = {{{101, 102, 0.8}, {20, 30, 0.8}, {180, 100, 3}}};
  std::array<double, 3> squares{}, stated{};
  for (unsigned seed = 0; seed < count; ++seed) {
    const LensSolution solution = solve_lens(scene.observed(corner_noise, seed), {});
    const ProjectionUncertainty uncertainty(solution);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto [u, v, range] = places[i];
      // the true point behind the pixel, then its position relative to the boards: the mean over views of the position
      // that each view gives
      Eigen::Vector2d ray(0, 0);
      for (int k = 0; k < 50; ++k) {
        const Eigen::Vector2d miss = Eigen::Vector2d(u, v) - scene.lens.image({ray.x(), ray.y(), 1});
        ray += miss / scene.lens.fx;
      }
      const Eigen::Vector3d truth = range * Eigen::Vector3d(ray.x(), ray.y(), 1).normalized();
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const SolvedView& view : solution.views) {
        const test::TruePose& pose = scene.poses[view.view];
        const Eigen::Matrix3d turn = Eigen::AngleAxisd(pose.turn.norm(), pose.turn.normalized()).toRotationMatrix();
        const Eigen::Vector3d on_board = turn.transpose() * (truth - pose.place);
        const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(view.pose.rotation.data());
        const Eigen::Map<const Eigen::Vector3d> shift(view.pose.translation.data());
        mean += (rotation * on_board + shift) / static_cast<double>(solution.views.size());
      }
      test::TrueLens fitted{solution.lens[0], solution.lens[1], solution.lens[2], solution.lens[3],
                            solution.lens[4], solution.lens[5], solution.lens[6], solution.lens[7]};
      // the bend of the true board displaces it 0.5 mm from the edge of the flat one: the same in all calibrations
      squares[i] += (fitted.image(mean) - Eigen::Vector2d(u, v)).squaredNorm() / count;
      const auto j = *uncertainty.jacobian(u, v, range);
      stated[i] += (j * solution.covariance * j.transpose()).trace() / count;
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::printf("scatter %.4f px, stated %.4f px\n", std::sqrt(squares[i]), std::sqrt(stated[i]));
    EXPECT_NEAR(std::sqrt(squares[i] / stated[i]), 1, 0.2);
  }
}

TEST(LensJudgement, HalvesAgreeAndLeftOutViewsArePredicted) {
  const test::TrueScene scene = scene_of({});
  double ratio = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    const Observations seen = scene.observed(corner_noise, seed);
    const LensSolution solution = solve_lens(seen, {});
    const TwoSets halves = compare_halves(seen, {}, solution);
    ASSERT_TRUE(halves.done);
    ratio += halves.difference / halves.predicted / 10;
    const HeldOutViews held_out = predict_left_out(seen, {}, solution);
    ASSERT_TRUE(held_out.done);
    EXPECT_GE(held_out.rms, held_out.fitted);
    EXPECT_NEAR(held_out.rms, corner_noise, 0.01);
    EXPECT_LT(held_out.low, held_out.rms);
    EXPECT_GT(held_out.high, held_out.rms);
  }
  std::printf("halves differ by %.2f of the prediction\n", ratio);
  EXPECT_GT(ratio, 0.4);
  EXPECT_LT(ratio, 1.5);
}

/// Adding the suggested view improves the lens more than the average view at a random pose.
TEST(LensJudgement, TheSuggestedViewHelpsMoreThanOthers) {
  test::TrueScene scene = scene_of({});
  scene.poses.resize(8);
  const LensSolution before = solve_lens(scene.observed(corner_noise, 0), {});
  const Observations seen = scene.observed(corner_noise, 0);
  const NextView next = suggest_view(seen, before);
  ASSERT_TRUE(next.found);
  EXPECT_LT(next.after, next.before);
  const auto mean_sd = [&](const std::vector<test::TruePose>& poses) {
    test::TrueScene more = scene;
    more.poses.insert(more.poses.end(), poses.begin(), poses.end());
    const LensSolution solution = solve_lens(more.observed(corner_noise, 0), {});
    double sum = 0;
    for (const double u : {20.0, 100.0, 180.0})
      for (const double v : {20.0, 100.0, 180.0}) sum += ProjectionUncertainty(solution).at(u, v, 0.8) / 9;
    return sum;
  };
  const Eigen::AngleAxisd turn(Eigen::AngleAxisd(next.tilt[1], Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(next.tilt[0], Eigen::Vector3d::UnitX()));
  const double suggested = mean_sd({{turn.angle() * turn.axis(), {next.centre[0], next.centre[1], next.centre[2]}}});
  double others = 0;
  const auto random = test::true_poses(scene.lens, scene.board, 8, 99);
  for (const test::TruePose& pose : random) others += mean_sd({pose}) / 8;
  std::printf("suggested %.4f px, others %.4f px on the average\n", suggested, others);
  EXPECT_LT(suggested, others);
}

/// The suggested view is feasible: the board is seen from the front, with its outer squares inside the image.
TEST(LensJudgement, TheSuggestedViewShowsTheWholeBoardFromTheFront) {
  test::TrueScene wide;
  wide.lens = {.fx = 71.3, .fy = 70.8, .k1 = 0.03, .k2 = 0, .p1 = 0, .p2 = 0, .fisheye = true};
  wide.board.square = 0.06;
  wide.poses = test::true_poses(wide.lens, wide.board, 8);
  test::TrueScene usual = scene_of({});
  usual.poses.resize(8);
  for (const test::TrueScene& scene : {usual, wide}) {
    Observations seen = scene.observed(corner_noise, 0);
    seen.fisheye = scene.lens.fisheye;
    const NextView next = suggest_view(seen, solve_lens(seen, {.warp = false}));
    ASSERT_TRUE(next.found);
    const Eigen::AngleAxisd turn(Eigen::AngleAxisd(next.tilt[1], Eigen::Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(next.tilt[0], Eigen::Vector3d::UnitX()));
    const test::TruePose pose{turn.angle() * turn.axis(), {next.centre[0], next.centre[1], next.centre[2]}};
    const Eigen::Vector3d normal = turn.toRotationMatrix().col(2);
    const double x = (scene.board.columns + 1) / 2.0 * scene.board.square,
                 y = (scene.board.rows + 1) / 2.0 * scene.board.square;
    for (const double along : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
      for (const double across : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
        const Eigen::Vector3d at = pose.camera({along * x, across * y, 0});
        const Eigen::Vector2d pixel = scene.lens.image(at);
        EXPECT_GT(normal.dot(at.normalized()), 0.5) << "from behind, or at a grazing angle";
        EXPECT_GT(pixel.minCoeff(), 0) << pixel;
        EXPECT_LT(pixel.maxCoeff(), 203) << pixel;
      }
    }
  }
}

}  // namespace
