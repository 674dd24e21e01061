// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: CornersCurved.*
// Rooms: calibration
// Corners of large squares imaged by lenses that curve their edges: no bias, and a focal length within its interval.
#include <gtest/gtest.h>

#include "calibration/corners.hpp"
#include "tests/unit/lens_images.hpp"

#include <algorithm>
#include <cmath>

using namespace tofgraph::calibration;

namespace {

constexpr int size = 204;

/// Errors of corners in noise-free images.
struct Errors {
  std::vector<double> outward;  ///< px, sum per 20 px ring of the error away from the principal point
  std::vector<double> count;
  double squares = 0, corners = 0, largest = 0;
  int views = 0;
  Observations seen;

  double rms() const { return std::sqrt(squares / corners / 2); }
  double bias() const {  ///< mean radial error in the worst ring with at least 20 corners, px
    double worst = 0;
    for (std::size_t ring = 0; ring < count.size(); ++ring)
      if (count[ring] >= 20) worst = std::max(worst, std::abs(outward[ring] / count[ring]));
    return worst;
  }
};

void add(const test::TrueLens& lens, const std::vector<Corner>& corners, std::vector<Eigen::Vector2d> truth,
         Errors& errors) {
  const Corner& first = corners.front();
  if ((Eigen::Vector2d(first.u, first.v) - truth[first.point]).norm() > 3) std::ranges::reverse(truth);  // half a turn
  for (const Corner& c : corners) {
    const Eigen::Vector2d& t = truth[c.point];
    const Eigen::Vector2d miss(c.u - t.x(), c.v - t.y()), radius(t.x() - lens.cx, t.y() - lens.cy);
    const auto ring = static_cast<std::size_t>(radius.norm() / 20);
    errors.outward.resize(std::max(errors.outward.size(), ring + 1));
    errors.count.resize(errors.outward.size());
    errors.outward[ring] += miss.dot(radius) / std::max(radius.norm(), 1e-9);
    errors.count[ring] += 1;
    errors.squares += miss.squaredNorm();
    errors.corners += 1;
    errors.largest = std::max(errors.largest, miss.norm());
  }
}

/// Errors for boards all over the image, tilted and rotated; squares of 15 to 30 px in its middle.
Errors errors_of(const test::TrueLens& lens, int count) {
  test::TrueBoard board;
  board.columns = 6;
  board.rows = 5;
  board.square = 0.05;
  const std::vector<Eigen::Vector2d> rays = test::subpixel_rays(lens, size);
  const tofgraph::io::Pattern pattern{board.columns, board.rows, board.square};
  const test::Light light{.blur = 0.5, .noise = 0};
  std::mt19937 random(3);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  Errors errors;
  errors.seen = {.width = size, .height = size, .points = board_points(pattern), .fisheye = lens.fisheye};
  for (int tries = 0; errors.views < count && tries < 20 * count; ++tries) {
    const double tilt = uniform(0.1, 0.7), about = uniform(0, 2 * M_PI),
                 distance = lens.fx * board.square / uniform(15, 30);
    const double reach = 0.35 * size / lens.fx * distance;
    const test::TruePose pose{{tilt * std::cos(about), tilt * std::sin(about), uniform(-0.4, 0.4)},
                              {uniform(-reach, reach), uniform(-reach, reach), distance}};
    std::vector<Eigen::Vector2d> truth;
    bool inside = true;
    for (const BoardPoint& p : errors.seen.points) {
      const Eigen::Vector3d at = pose.camera({p.x, p.y, 0});
      truth.push_back(lens.image(at));
      inside &= at.z() > 0.02 && truth.back().minCoeff() > 8 && truth.back().maxCoeff() < size - 9;
    }
    if (!inside) continue;
    const BoardSearch search =
        find_board(test::rendered(rays, size, pose, chessboard(board, light), light, 1), pattern);
    if (!search.found()) continue;
    add(lens, search.corners, truth, errors);
    errors.seen.views.push_back(
        {.id = "view" + std::to_string(errors.views), .corners = search.corners, .distances = {}});
    ++errors.views;
  }
  return errors;
}

/// Expects a bias and an rms error of corners up to 0.02 px, and focal lengths within 2.5 standard deviations.
void expect_exact(const char* name, const test::TrueLens& lens) {
  const Errors errors = errors_of(lens, 16);
  ASSERT_EQ(errors.views, 16) << name;
  std::printf("%s: %.0f corners, rms %.4f px a coordinate, largest %.3f px; outward by rings of 20 px:", name,
              errors.corners, errors.rms(), errors.largest);
  for (std::size_t ring = 0; ring < errors.count.size(); ++ring)
    std::printf(" %+.4f (%.0f)", errors.outward[ring] / errors.count[ring], errors.count[ring]);
  const LensSolution solution = solve_lens(errors.seen, {.warp = false, .distances = false});
  std::printf("\n  focal length %.3f +- %.3f, %.3f +- %.3f px, true %.2f, %.2f; variance factor %.2f\n",
              solution.lens[lens::fx], solution.sd(lens::fx), solution.lens[lens::fy], solution.sd(lens::fy), lens.fx,
              lens.fy, solution.variance_factor);
  EXPECT_LE(errors.bias(), 0.02) << name;
  EXPECT_LE(errors.rms(), 0.02) << name;
  EXPECT_NEAR(solution.lens[lens::fx], lens.fx, 2.5 * solution.sd(lens::fx)) << name;
  EXPECT_NEAR(solution.lens[lens::fy], lens.fy, 2.5 * solution.sd(lens::fy)) << name;
}

test::TrueLens lens_of(double focal, double k1, double k2, bool fisheye) {
  return {.fx = focal, .fy = focal, .cx = 101.3, .cy = 102.4, .k1 = k1, .k2 = k2, .p1 = 0, .p2 = 0, .fisheye = fisheye};
}

TEST(CornersCurved, APinhole) { expect_exact("pinhole", lens_of(120, 0, 0, false)); }

TEST(CornersCurved, ABarrel) { expect_exact("k1 = -0.3", lens_of(160, -0.3, 0.1, false)); }

TEST(CornersCurved, AFisheyeOf120Degrees) { expect_exact("fisheye 120 deg", lens_of(97.4, 0, 0, true)); }

TEST(CornersCurved, AFisheyeOf146Degrees) { expect_exact("fisheye 146 deg", lens_of(80, 0, 0, true)); }

}  // namespace
