// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Corners.BoardsAreFound*
// Rooms: calibration
// Boards in noisy images of few pixels: found, never a wrong one, and as accurate as stated.
#include <gtest/gtest.h>

#include "calibration/corners.hpp"
#include "tests/unit/lens_images.hpp"

#include <algorithm>
#include <cmath>

using namespace tofgraph::calibration;

namespace {

struct Score {
  int views = 0, found = 0, wrong = 0;
  int large = 0, large_found = 0;  ///< squares of at least 4 px everywhere
  double squares = 0, chi = 0, corners = 0;
};

/// Compares corners with the truth; a chessboard may be found turned by half a turn, a square one by quarter turns.
void compare(const BoardSearch& search, const std::vector<Eigen::Vector2d>& truth, Score& score) {
  ++score.views;
  if (!search.found()) return;
  ++score.found;
  double best = 1e300, chi = 0;
  for (const bool turned : {false, true}) {
    double squares = 0, c2 = 0;
    for (const Corner& c : search.corners) {
      const Eigen::Vector2d& t = truth[turned ? truth.size() - 1 - c.point : c.point];
      const Eigen::Vector2d miss(c.u - t.x(), c.v - t.y());
      Eigen::Matrix2d covariance;
      covariance << c.covariance[0], c.covariance[1], c.covariance[1], c.covariance[2];
      squares += miss.squaredNorm();
      c2 += miss.dot(covariance.inverse() * miss);
    }
    if (squares < best) {
      best = squares;
      chi = c2;
    }
  }
  const auto n = static_cast<double>(search.corners.size());
  if (std::sqrt(best / n) > 1) {
    ++score.wrong;
    return;
  }
  score.squares += best;
  score.chi += chi;
  score.corners += n;
}

/// px, between neighbours of the lattice.
double smallest_square(const test::TrueBoard& board, const std::vector<Eigen::Vector2d>& truth) {
  double least = 1e9;
  const auto columns = static_cast<std::size_t>(board.columns);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (i % columns != 0) least = std::min(least, (truth[i] - truth[i - 1]).norm());
    if (i >= columns) least = std::min(least, (truth[i] - truth[i - columns]).norm());
  }
  return least;
}

/// Views of all kinds: the board fills 25 to 90 % of the image width, tilts up to 45 deg; contrast, noise and blur
/// vary.
Score search_boards(int size, int count) {
  test::TrueLens lens;
  const double ratio = size / 204.0;
  lens.fx *= ratio;
  lens.fy *= ratio;
  lens.cx = size / 2.0 - 0.9;
  lens.cy = size / 2.0 + 0.3;
  const test::TrueBoard board;
  const std::vector<Eigen::Vector2d> rays = test::subpixel_rays(lens, size);
  const tofgraph::io::Pattern pattern{board.columns, board.rows, board.square};
  std::mt19937 random(11);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  Score score;
  while (score.views < count) {
    test::TruePose pose;
    const double tilt = uniform(0, 0.785), about = uniform(0, 2 * M_PI), fill = uniform(0.25, 0.9);
    const double distance = 7 * board.square * lens.fx / (fill * size);
    pose.turn = {tilt * std::cos(about), tilt * std::sin(about), uniform(-0.3, 0.3)};
    pose.place = {uniform(-0.25, 0.25) * distance, uniform(-0.25, 0.25) * distance, distance};
    std::vector<Eigen::Vector2d> truth;
    bool inside = true;
    for (const auto& p : board.points()) {
      truth.push_back(lens.image(pose.camera({p.x, p.y, 0})));
      inside &= truth.back().minCoeff() > 4 && truth.back().maxCoeff() < size - 5;
    }
    if (!inside) continue;
    test::Light light{.dark = uniform(0.05, 0.4), .blur = uniform(0.4, 0.8)};
    light.noise = uniform(0.01, 0.04) * light.scale * light.bright / (distance * distance);
    const Image image = test::rendered(rays, size, pose, chessboard(board, light), light, unsigned(score.views));
    const BoardSearch search = find_board(image, pattern);
    if (!search.found())
      std::printf("  fill %.2f tilt %.0f contrast %.2f: %s\n", fill, tilt * 57.3, light.dark, search.reason.c_str());
    compare(search, truth, score);
    if (smallest_square(board, truth) >= 4) {
      ++score.large;
      score.large_found += search.found() ? 1 : 0;
    }
  }
  std::printf("%d px: %d of %d found, %d wrong, error %.4f px rms a coordinate, over the stated one %.2f\n", size,
              score.found, score.views, score.wrong, std::sqrt(score.squares / score.corners / 2),
              std::sqrt(score.chi / score.corners / 2));
  return score;
}

TEST(Corners, BoardsAreFoundInNoisyImagesOfACamCube) {
  const Score score = search_boards(204, 30);
  EXPECT_GE(score.found, 29);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_NEAR(std::sqrt(score.chi / score.corners / 2), 1, 0.25);
}

TEST(Corners, BoardsAreFoundInImagesOf100Pixels) {
  const Score score = search_boards(100, 24);
  std::printf("squares of 4 px at least: %d of %d found\n", score.large_found, score.large);
  EXPECT_GE(score.large_found, 0.9 * score.large);
  EXPECT_EQ(score.wrong, 0);
}

TEST(Corners, TheUnitOfTheAmplitudeChangesNothing) {
  test::TrueLens lens;
  const test::TrueBoard board;
  const test::Light light;
  const test::TruePose pose{{0.4, -0.3, 0.1}, {0.02, -0.03, 0.7}};
  const Image image = test::rendered(test::subpixel_rays(lens, 204), 204, pose, chessboard(board, light), light, 5);
  const tofgraph::io::Pattern pattern{board.columns, board.rows, board.square};
  const BoardSearch search = find_board(image, pattern);
  ASSERT_EQ(search.corners.size(), 48U);
  for (const double unit : {1e-3, 1e3}) {
    Image scaled = image;
    for (double& value : scaled.values) value *= unit;
    const BoardSearch other = find_board(scaled, pattern);
    ASSERT_EQ(other.corners.size(), search.corners.size()) << other.reason;
    for (std::size_t i = 0; i < search.corners.size(); ++i) {
      EXPECT_NEAR(other.corners[i].u, search.corners[i].u, 1e-6);
      EXPECT_NEAR(other.corners[i].v, search.corners[i].v, 1e-6);
      EXPECT_NEAR(other.corners[i].covariance[0], search.corners[i].covariance[0], 1e-6);
    }
  }
}

}  // namespace
