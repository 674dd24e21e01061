// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: *
// Rooms: calibration
// The same corners given to mrcal (Debian: mrcal), and views unseen by both. Skipped if mrcal is not installed.
#include <gtest/gtest.h>

#include "calibration/bundle.hpp"
#include "tests/program.hpp"
#include "tests/unit/lens_truth.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

using namespace tofgraph::calibration;
using namespace tofgraph::tests;

namespace {

constexpr double corner_noise = 0.1;  // px

std::string corners_file(const Observations& seen) {
  std::string text = "# filename x y level\n";
  char line[128];
  for (const View& view : seen.views) {
    for (const Corner& c : view.corners) {
      std::snprintf(line, sizeof line, "%s.png %.6f %.6f 0\n", view.id.c_str(), c.u, c.v);
      text += line;
    }
  }
  return text;
}

/// The eight numbers of mrcal's model file.
test::TrueLens lens_of(const std::string& model) {
  const std::size_t at = model.find('[', model.find("'intrinsics'"));
  std::string list = model.substr(at + 1, model.find(']', at) - at - 1);
  std::replace(list.begin(), list.end(), ',', ' ');
  std::istringstream numbers(list);
  test::TrueLens lens;
  numbers >> lens.fx >> lens.fy >> lens.cx >> lens.cy >> lens.k1 >> lens.k2 >> lens.p1 >> lens.p2;
  return lens;
}

/// Mean squared residual of the true corners of a new view after fitting its pose, px^2 per coordinate.
double held_out_error(const test::TrueScene& scene, const test::TruePose& truth, const test::TrueLens& lens) {
  test::TruePose pose = truth;
  const auto points = scene.board.points();
  const auto residuals = [&](const test::TruePose& at) {
    Eigen::VectorXd r(Eigen::Index(2 * points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d board = scene.board.bent(points[i].x, points[i].y);
      r.segment<2>(Eigen::Index(2 * i)) = scene.lens.image(truth.camera(board)) - lens.image(at.camera(board));
    }
    return r;
  };
  for (int step = 0; step < 10; ++step) {
    const Eigen::VectorXd r = residuals(pose);
    Eigen::MatrixXd jacobian(r.size(), 6);
    for (int i = 0; i < 6; ++i) {
      test::TruePose moved = pose;
      (i < 3 ? moved.turn[i] : moved.place[i - 3]) += 1e-6;
      jacobian.col(i) = (residuals(moved) - r) / 1e-6;
    }
    const Eigen::VectorXd change = jacobian.colPivHouseholderQr().solve(-r);
    pose.turn += change.head<3>();
    pose.place += change.tail<3>();
  }
  return residuals(pose).squaredNorm() / static_cast<double>(2 * points.size());
}

TEST(Mrcal, PredictsNewViewsNoBetterFromTheSameCorners) {
  const TemporaryFolder folder;
  if (shell("command -v mrcal-calibrate-cameras", folder.path()).exit_code != 0)
    GTEST_SKIP() << "mrcal is not installed";
  test::TrueScene scene;
  scene.board.sag = 0.5e-3;
  scene.poses = test::true_poses(scene.lens, scene.board, 25);
  const auto new_poses = test::true_poses(scene.lens, scene.board, 20, 1234);
  double ours = 0, theirs = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Observations seen = scene.observed(corner_noise, seed);
    const LensSolution solution = solve_lens(seen, {});
    const auto& p = solution.lens;
    const test::TrueLens own{p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]};
    write_text(folder.path() / "corners.vnl", corners_file(seen));
    const Outcome outcome = shell(
        "mrcal-calibrate-cameras --corners-cache corners.vnl --lensmodel LENSMODEL_OPENCV4 "
        "--focal 320 --object-spacing 0.03 --object-width-n 8 --object-height-n 6 --imagersize "
        "204 204 --outdir . 'view*.png'",
        folder.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err << outcome.out;
    const test::TrueLens mrcal = lens_of(read_text(folder.path() / "camera-0.cameramodel"));
    ASSERT_NEAR(mrcal.fx, scene.lens.fx, 10);
    for (const test::TruePose& pose : new_poses) {
      ours += held_out_error(scene, pose, own);
      theirs += held_out_error(scene, pose, mrcal);
    }
  }
  const double count = 8.0 * static_cast<double>(new_poses.size());
  std::printf("held-out projection error: %.5f px, mrcal %.5f px, ratio %.3f\n", std::sqrt(ours / count),
              std::sqrt(theirs / count), std::sqrt(ours / theirs));
  EXPECT_LE(std::sqrt(ours), 1.05 * std::sqrt(theirs));
}

}  // namespace
