// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Patterns.AnotherSizeIsNotTakenForTheBoard:Patterns.NothingIsFoundInNoise
// Rooms: calibration
// Patterns with coded markers, circles, and images that must not be mistaken for the pattern.
#include <gtest/gtest.h>

#include "calibration/corners.hpp"
#include "tests/unit/lens_images.hpp"

#include <opencv2/aruco/charuco.hpp>

#include <cmath>

using namespace tofgraph::calibration;
using Type = tofgraph::io::Pattern::Type;

namespace {

constexpr int size = 204;

const std::vector<Eigen::Vector2d>& rays() {
  static const std::vector<Eigen::Vector2d> table = test::subpixel_rays({}, size);
  return table;
}

/// Poses in which the board fills the given part of the image; its centre may be off the image centre.
test::TruePose pose_of(double distance, double tilt_x, double tilt_y, double x = 0, double y = 0) {
  return {{tilt_x, tilt_y, 0.05}, {x, y, distance}};
}

/// Root mean square error of the points, px, relative to the true points of the pattern's own numbers.
double error_of(const std::vector<Corner>& corners, const std::vector<BoardPoint>& points, const test::TruePose& pose) {
  const test::TrueLens lens;
  double squares = 0;
  for (const Corner& c : corners) {
    const BoardPoint& p = points[c.point];
    squares += (lens.image(pose.camera({p.x, p.y, 0})) - Eigen::Vector2d(c.u, c.v)).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(corners.size()));
}

TEST(Patterns, CharucoCornersAreKnownAlsoWhereABoardIsCutOff) {
  const tofgraph::io::Pattern pattern{
      .columns = 5, .rows = 4, .square = 0.04, .type = Type::charuco, .marker = 0.03, .dictionary = "4x4_50"};
  const auto board =
      cv::aruco::CharucoBoard::create(6, 5, 0.04F, 0.03F, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50));
  constexpr int per_square = 160;
  cv::Mat picture;
  board->draw(cv::Size(6 * per_square, 5 * per_square), picture);
  const test::Texture texture = [&](double x, double y) {
    const double a = (x / 0.04 + 3) * per_square, b = (y / 0.04 + 2.5) * per_square;
    if (a < -40 || b < -40 || a >= picture.cols + 40 || b >= picture.rows + 40) return std::nan("");
    if (a < 0 || b < 0 || a >= picture.cols || b >= picture.rows) return 0.85;
    return picture.at<std::uint8_t>(int(b), int(a)) > 127 ? 0.85 : 0.1;
  };
  const auto points = board_points(pattern);
  const std::pair<test::TruePose, std::size_t> views[] = {
      {pose_of(0.5, 0, 0), 20}, {pose_of(0.55, 0.5, 0.2), 18}, {pose_of(0.5, 0.2, -0.4, 0.1, 0.02), 8}};
  for (const auto& [pose, wanted] : views) {
    const Image image = test::rendered(rays(), size, pose, texture, {.noise = 12}, 5);
    const BoardSearch search = find_board(image, pattern);
    ASSERT_TRUE(search.found()) << search.reason;
    EXPECT_GE(search.corners.size(), wanted);
    // the corner numbers are those of the board: absolute positions, not only a lattice
    double best = error_of(search.corners, points, pose);
    std::printf("charuco: %zu corners, %.3f px\n", search.corners.size(), best);
    EXPECT_LT(best, 0.15);
  }
}

test::Texture circles(const std::vector<BoardPoint>& points, double diameter, double margin) {
  return [points, diameter, margin](double x, double y) {
    double hx = 0, hy = 0;
    bool inside = false;
    for (const BoardPoint& p : points) {
      hx = std::max(hx, std::abs(p.x));
      hy = std::max(hy, std::abs(p.y));
      inside |= std::hypot(x - p.x, y - p.y) < diameter / 2;
    }
    if (std::abs(x) > hx + margin || std::abs(y) > hy + margin) return std::nan("");
    return inside ? 0.1 : 0.85;
  };
}

TEST(Patterns, GridsOfCirclesAreFound) {
  for (const Type type : {Type::circles, Type::asymmetric_circles}) {
    const bool asymmetric = type == Type::asymmetric_circles;
    const tofgraph::io::Pattern pattern{.columns = asymmetric ? 4 : 7,
                                        .rows = asymmetric ? 9 : 5,
                                        .square = asymmetric ? 0.022 : 0.032,
                                        .type = type,
                                        .diameter = 0.02};
    const auto points = board_points(pattern);
    for (const test::TruePose& pose : {pose_of(0.45, 0.05, 0.05), pose_of(0.5, 0.4, -0.3)}) {
      const Image image = test::rendered(rays(), size, pose, circles(points, 0.02, 0.03), {.noise = 12}, 9);
      const BoardSearch search = find_board(image, pattern);
      ASSERT_TRUE(search.found()) << search.reason;
      double best = 1e9;
      std::vector<Corner> turned = search.corners;
      for (Corner& c : turned) c.point = points.size() - 1 - c.point;
      best = std::min(error_of(search.corners, points, pose), error_of(turned, points, pose));
      std::printf("circles: %.3f px to the image of their centres\n", best);
      EXPECT_LT(best, 0.25) << "an ellipse's centre is not quite the image of the circle's";
    }
  }
}

/// A board other than the campaign's is rejected and reported.
TEST(Patterns, AnotherSizeIsNotTakenForTheBoard) {
  test::TrueBoard larger;
  larger.columns = 9;
  larger.rows = 7;
  const tofgraph::io::Pattern pattern{.columns = 8, .rows = 6, .square = 0.03};
  for (const double tilt : {0.0, 0.4}) {
    const Image image = test::rendered(rays(), size, pose_of(0.6, tilt, -tilt), test::chessboard(larger, {}), {}, 3);
    const BoardSearch search = find_board(image, pattern);
    EXPECT_FALSE(search.found());
    EXPECT_EQ(search.other_size, (std::array<int, 2>{9, 7}))
        << search.other_size[0] << " x " << search.other_size[1] << ": " << search.reason;
  }
}

TEST(Patterns, APartOfAChessboardHasNoIdentity) {
  const tofgraph::io::Pattern pattern{.columns = 8, .rows = 6, .square = 0.03};
  const Image image =
      test::rendered(rays(), size, pose_of(0.6, 0.2, 0.1, 0.12, 0), test::chessboard(test::TrueBoard{}, {}), {}, 3);
  const BoardSearch search = find_board(image, pattern);
  EXPECT_FALSE(search.found());
  EXPECT_NE(search.reason.find("cannot be known"), std::string::npos) << search.reason;
}

TEST(Patterns, NothingIsFoundInNoise) {
  const tofgraph::io::Pattern pattern{.columns = 4, .rows = 3, .square = 0.03};
  std::mt19937 random(1);
  std::normal_distribution<double> normal(100, 20);
  for (int i = 0; i < 2; ++i) {
    Image image{size, size, std::vector<double>(size * size)};
    for (double& value : image.values) value = normal(random);
    EXPECT_FALSE(find_board(image, pattern).found());
  }
}

}  // namespace
