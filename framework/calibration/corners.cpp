// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/corners.hpp"

#include "calibration/corner_images.hpp"

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tofgraph::calibration {
namespace {

constexpr double min_spacing = 4;       ///< px between corners; below it, the two blurred edges of a square merge
constexpr double min_crossing = 0.3;    ///< relative to the contrast; see crossing()
constexpr double min_contrast = 1;      ///< half of bright minus dark over pixel noise; a fit uses dozens of pixels
constexpr double max_roughness = 0.35;  ///< px rms, deviation from a homography with smooth distortion

struct Lattice {
  std::size_t columns, rows;
  std::vector<cv::Point2d> at;  ///< row by row

  const cv::Point2d& operator()(std::size_t column, std::size_t row) const { return at[row * columns + column]; }
};

cv::Point2d step(const Lattice& l, std::size_t column, std::size_t row, bool along_row) {
  if (along_row) {
    const std::size_t next = std::min(column + 1, l.columns - 1), last = column == 0 ? 0 : column - 1;
    return (l(next, row) - l(last, row)) / static_cast<double>(next - last);
  }
  const std::size_t next = std::min(row + 1, l.rows - 1), last = row == 0 ? 0 : row - 1;
  return (l(column, next) - l(column, last)) / static_cast<double>(next - last);
}

/// Curvature of the edge through a corner and its two neighbours, 1/px; at the end of a line, that of the next corner.
double curvature(const Lattice& l, std::size_t column, std::size_t row, bool along_row) {
  const std::size_t count = along_row ? l.columns : l.rows;
  if (count < 3) return 0;
  const std::size_t middle = std::clamp<std::size_t>(along_row ? column : row, 1, count - 2);
  const auto at = [&](std::size_t i) {
    const cv::Point2d& p = along_row ? l(i, row) : l(column, i);
    return std::array{p.x, p.y};
  };
  return curvature_through(at(middle - 1), at(middle), at(middle + 1));
}

RoughCorner rough_of(const Lattice& l, std::size_t column, std::size_t row) {
  const cv::Point2d& p = l(column, row);
  const cv::Point2d a = step(l, column, row, true), b = step(l, column, row, false);
  return {.point = row * l.columns + column,
          .u = p.x,
          .v = p.y,
          .along_row = {a.x, a.y},
          .along_column = {b.x, b.y},
          .curvature = {curvature(l, column, row, true), curvature(l, column, row, false)}};
}

/// Reorders a lattice to right-handed rows and columns, as on the front of a board; OpenCV may begin at any corner.
void make_right_handed(Lattice& l) {
  const cv::Point2d a = l(l.columns - 1, 0) - l(0, 0), b = l(0, l.rows - 1) - l(0, 0);
  if (a.x * b.y - a.y * b.x > 0) return;
  for (std::size_t row = 0; row < l.rows; ++row)
    std::reverse(l.at.begin() + static_cast<std::ptrdiff_t>(row * l.columns),
                 l.at.begin() + static_cast<std::ptrdiff_t>((row + 1) * l.columns));
}

/// Deviation of the lattice from a homography with smooth distortion, px rms. The distortion is a polynomial of the
/// position on the board, of third order, or second for less than 5 columns or rows.
double roughness(const Lattice& l) {
  std::vector<cv::Point2d> ideal;
  for (std::size_t row = 0; row < l.rows; ++row)
    for (std::size_t column = 0; column < l.columns; ++column)
      ideal.emplace_back(2.0 * static_cast<double>(column) / static_cast<double>(l.columns - 1) - 1,
                         2.0 * static_cast<double>(row) / static_cast<double>(l.rows - 1) - 1);
  const cv::Mat homography = cv::findHomography(ideal, l.at);
  if (homography.empty()) return 1e9;
  std::vector<cv::Point2d> flat;
  cv::perspectiveTransform(ideal, flat, homography);
  const int order = l.columns < 5 || l.rows < 5 ? 2 : 3;
  std::vector<std::array<int, 2>> powers;
  for (int i = 0; i <= order; ++i)
    for (int k = 0; i + k <= order; ++k) powers.push_back({i, k});
  const auto n = static_cast<int>(ideal.size()), terms = static_cast<int>(powers.size());
  if (n <= terms) return 0;
  cv::Mat_<double> basis(n, terms), miss(n, 2), fit;
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (int t = 0; t < terms; ++t)
      basis(i, t) = std::pow(ideal[at].x, powers[static_cast<std::size_t>(t)][0]) *
                    std::pow(ideal[at].y, powers[static_cast<std::size_t>(t)][1]);
    miss(i, 0) = l.at[at].x - flat[at].x;
    miss(i, 1) = l.at[at].y - flat[at].y;
  }
  cv::solve(basis, miss, fit, cv::DECOMP_QR);
  return cv::norm(miss - basis * fit) / std::sqrt(static_cast<double>(2 * (n - terms)));
}

/// Returns true if the squares continue beyond a side, i.e. if there are crossings at the next corner positions.
bool goes_on(const Image& image, const Lattice& l, bool columns, bool at_end) {
  const std::size_t count = columns ? l.rows : l.columns, last = (columns ? l.columns : l.rows) - 1;
  std::size_t looked = 0, crossings = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = [&](std::size_t k) {
      const std::size_t from_side = at_end ? last - k : k;
      return columns ? rough_of(l, from_side, i) : rough_of(l, i, from_side);
    };
    RoughCorner beyond = at(0);
    const RoughCorner inside = at(1);
    beyond.u += beyond.u - inside.u;
    beyond.v += beyond.v - inside.v;
    std::array<double, 4> means{}, own{};
    if (!quadrants(image, beyond, means) || !quadrants(image, at(0), own)) continue;
    ++looked;
    const double contrast = std::abs(own[0] + own[2] - own[1] - own[3]);
    const bool strong = std::abs(means[0] + means[2] - means[1] - means[3]) > 0.4 * contrast;
    crossings += strong && crossing(means) > 0.5 ? 1 : 0;
  }
  return looked >= 3 && 10 * crossings >= 7 * looked;
}

/// Reason why a lattice with refined corners is not this chessboard; empty: none.
std::string problem_of(const Image& image, const Lattice& l, const std::vector<RefinedCorner>& refined, double noise) {
  for (std::size_t i = 0; i < refined.size(); ++i) {
    const bool turn = ((i % l.columns) + (i / l.columns)) % 2 == 1;
    const double contrast = (turn ? -1 : 1) * refined[i].contrast * (refined[0].contrast > 0 ? 1 : -1);
    if (!(contrast > min_contrast * noise)) return "the colours of its squares do not alternate clearly";
    std::array<double, 4> means{};
    if (!quadrants(image, rough_of(l, i % l.columns, i / l.columns), means) || crossing(means) < min_crossing)
      return "a corner is not the crossing of two edges";
  }
  double variance = 0;  // of the least certain coordinate, for noise 1
  for (const RefinedCorner& r : refined)
    variance = std::max({variance, r.corner.covariance[0], r.corner.covariance[2]});
  if (const double rough = roughness(l); rough > std::max(max_roughness, 6 * noise * std::sqrt(variance)))
    return fmt::format("the lattice is not smooth ({:.2f} px)", rough);
  for (const bool columns : {true, false})
    for (const bool at_end : {true, false})
      if (goes_on(image, l, columns, at_end)) return "the squares go on beyond the pattern: a larger chessboard";
  return {};
}

/// Refines the corners of a detected lattice and checks them.
BoardSearch checked(const Image& image, Lattice lattice) {
  BoardSearch result;
  make_right_handed(lattice);
  std::vector<RefinedCorner> refined(lattice.at.size());
  const Lattice detected = lattice;
  double squares = 0, freedom = 0;
  for (int round = 0; round < 2; ++round) {  // the second starts from the corners of the first
    squares = freedom = 0;
    const Lattice before = lattice;
    for (std::size_t i = 0; i < refined.size(); ++i) {
      const RoughCorner rough = rough_of(before, i % before.columns, i / before.columns);
      const double spacing = std::min(std::hypot(rough.along_row[0], rough.along_row[1]),
                                      std::hypot(rough.along_column[0], rough.along_column[1]));
      if (spacing < min_spacing) {
        result.reason =
            fmt::format("its squares are {:.1f} px small, at least {:.0f} are needed", spacing, min_spacing);
        return result;
      }
      if (!refine(image, rough, refined[i]) ||
          std::hypot(refined[i].corner.u - detected.at[i].x, refined[i].corner.v - detected.at[i].y) >
              std::min(0.35 * spacing, 2.5)) {
        result.reason = "a corner could not be located";
        return result;
      }
      lattice.at[i] = {refined[i].corner.u, refined[i].corner.v};
      squares += refined[i].residual;
      freedom += refined[i].freedom;
    }
  }
  result.pixel_noise = std::sqrt(squares / freedom);
  result.reason = problem_of(image, lattice, refined, result.pixel_noise);
  if (!result.reason.empty()) return result;
  // The scatter about the fit includes errors of the edge model; the noise between frames does not.
  const double noise = std::isfinite(image.noise) ? std::max(image.noise, result.pixel_noise) : result.pixel_noise;
  set_noise(refined, noise, result.corners);
  return result;
}

Lattice lattice_of(const std::vector<cv::Point2f>& points, std::size_t columns, std::size_t rows, int scale) {
  Lattice lattice{columns, rows, {}};
  for (const cv::Point2f& p : points) lattice.at.push_back(to_image(p, scale));
  return lattice;
}

bool detect(const cv::Mat& image, bool sector, cv::Size size, std::vector<cv::Point2f>& points) {
  if (sector)
    return cv::findChessboardCornersSB(image, size, points, cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE);
  return cv::findChessboardCorners(image, size, points, cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE);
}

/// Finds the largest chessboard in the image. @returns columns and rows of inner corners; zeros: none
std::array<int, 2> any_chessboard(const Image& image) {
  const int scale = scale_for(image);
  std::array<int, 2> best{};
  for (const Tones tones : {Tones::linear, Tones::root}) {
    std::vector<cv::Point2f> points;
    cv::Mat meta;
    if (!cv::findChessboardCornersSB(enlarged(image, scale, tones), cv::Size(3, 3), points,
                                     cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_LARGER, meta))
      continue;
    const Lattice lattice =
        lattice_of(points, static_cast<std::size_t>(meta.cols), static_cast<std::size_t>(meta.rows), scale);
    if (meta.cols * meta.rows > best[0] * best[1] && roughness(lattice) < 1) best = {meta.cols, meta.rows};
  }
  if (best[0] < best[1]) std::swap(best[0], best[1]);
  return best;
}

BoardSearch find_chessboard(const Image& image, const io::Pattern& pattern) {
  BoardSearch result;
  result.reason = "not found";
  const cv::Size size(static_cast<int>(pattern.columns), static_cast<int>(pattern.rows));
  const int scale = scale_for(image);
  for (const Tones tones : {Tones::linear, Tones::root, Tones::local}) {
    const cv::Mat picture = enlarged(image, scale, tones);
    for (const bool sector : {true, false}) {
      std::vector<cv::Point2f> points;
      if (!detect(picture, sector, size, points)) continue;
      result = checked(image, lattice_of(points, static_cast<std::size_t>(size.width),
                                         static_cast<std::size_t>(size.height), scale));
      if (result.found()) return result;
    }
  }
  result.other_size = any_chessboard(image);
  const auto [columns, rows] = result.other_size;
  if (columns * rows == 0 || columns * rows == size.area()) {
    result.other_size = {};
    return result;
  }
  if (columns * rows < size.area())
    result.reason =
        fmt::format("only {} x {} corners are seen: which part of the board that is cannot be known", columns, rows);
  else
    result.reason = fmt::format("a chessboard of {} x {} inner corners is seen", columns, rows);
  return result;
}

}  // namespace

std::vector<BoardPoint> board_points(const io::Pattern& p) {
  std::vector<BoardPoint> points;
  const bool shifted = p.type == io::Pattern::Type::asymmetric_circles;
  for (std::int64_t row = 0; row < p.rows; ++row)
    for (std::int64_t column = 0; column < p.columns; ++column)
      points.push_back({static_cast<double>(shifted ? 2 * column + row % 2 : column) * p.square,
                        static_cast<double>(row) * p.square});
  BoardPoint middle;
  for (const BoardPoint& point : points) middle = {std::max(middle.x, point.x), std::max(middle.y, point.y)};
  for (BoardPoint& point : points) point = {point.x - middle.x / 2, point.y - middle.y / 2};
  return points;
}

bool looks_the_same_turned(const io::Pattern& p) {
  return p.columns == p.rows && (p.type == io::Pattern::Type::chessboard || p.type == io::Pattern::Type::circles);
}

bool looks_the_same_upside_down(const io::Pattern& p) {
  if (p.type == io::Pattern::Type::chessboard) return (p.columns + p.rows) % 2 == 0;
  return p.type == io::Pattern::Type::circles;
}

namespace {

/// Renumbers the points of a pattern with half-turn symmetry so that its rows run to the right.
void orient(const io::Pattern& pattern, std::vector<Corner>& corners) {
  const auto columns = static_cast<std::size_t>(pattern.columns),
             points = columns * static_cast<std::size_t>(pattern.rows);
  if (corners.size() != points || !looks_the_same_upside_down(pattern)) return;
  double right = 0, down = 0;
  for (const Corner& c : corners) {
    const double along = static_cast<double>(c.point % columns) - static_cast<double>(columns - 1) / 2;
    right += along * c.u;
    down += along * c.v;
  }
  if (right > 0 || (right == 0 && down > 0)) return;
  for (Corner& c : corners) c.point = points - 1 - c.point;
  std::ranges::reverse(corners);
}

BoardSearch search(const Image& image, const io::Pattern& pattern) {
  switch (pattern.type) {
    case io::Pattern::Type::chessboard:
      return find_chessboard(image, pattern);
    case io::Pattern::Type::charuco:
      return find_charuco(image, pattern);
    default:
      return find_circles(image, pattern);
  }
}

}  // namespace

BoardSearch find_board(const Image& image, const io::Pattern& pattern) {
  try {
    BoardSearch result = search(image, pattern);
    orient(pattern, result.corners);
    return result;
  } catch (const cv::Exception&) {
    throw std::runtime_error("cannot be searched for the pattern");
  }
}

}  // namespace tofgraph::calibration
