// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// ChArUco boards: markers identify the corners, so that a part of the board suffices.
#include "calibration/corner_images.hpp"

#include <fmt/format.h>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace tofgraph::calibration {
namespace {

constexpr std::size_t min_corners = 8;       ///< per view: a pose has six unknowns
constexpr double min_marked_crossing = 0.3;  ///< relative to the contrast; see crossing()

cv::Ptr<cv::aruco::CharucoBoard> board_of(const io::Pattern& p) {
  const auto& names = io::marker_dictionaries();  // in the order of OpenCV, which begins with 4x4_50
  const auto index = static_cast<int>(std::ranges::find(names, p.dictionary) - names.begin());
  return cv::aruco::CharucoBoard::create(static_cast<int>(p.columns) + 1, static_cast<int>(p.rows) + 1,
                                         static_cast<float>(p.square), static_cast<float>(p.marker),
                                         cv::aruco::getPredefinedDictionary(index));
}

struct Marked {
  std::vector<int> ids;
  std::vector<cv::Point2d> at;
};

Marked detect(const Image& image, const io::Pattern& pattern, Tones tones) {
  const int scale = scale_for(image);
  const cv::Mat picture = enlarged(image, scale, tones);
  const auto board = board_of(pattern);
  std::vector<int> ids, corner_ids;
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<cv::Point2f> corners;
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->adaptiveThreshWinSizeMax = 75;  // px of the enlarged image
  parameters->adaptiveThreshWinSizeStep = 12;
  cv::aruco::detectMarkers(picture, board->dictionary, markers, ids, parameters);
  Marked result;
  if (ids.empty()) return result;
  cv::aruco::interpolateCornersCharuco(markers, ids, picture, board, corners, corner_ids);
  result.ids = corner_ids;
  for (const cv::Point2f& p : corners) result.at.push_back(to_image(p, scale));
  return result;
}

/// Curvature of the edge through a corner, 1/px, from three successive corners including it, preferably as the middle
/// one; 0 if there are none. @param next difference in column and row to the next corner
double curvature(const Marked& marked, int columns, std::size_t i, std::array<int, 2> next) {
  const int column = marked.ids[i] % columns, row = marked.ids[i] / columns;
  for (const int middle : {0, 1, -1}) {
    std::vector<std::array<double, 2>> places;
    for (const int k : {middle - 1, middle, middle + 1}) {
      const int c = column + k * next[0], id = (row + k * next[1]) * columns + c;
      const auto found = std::ranges::find(marked.ids, id);
      if (c < 0 || c >= columns || found == marked.ids.end()) continue;
      const cv::Point2d& p = marked.at[static_cast<std::size_t>(found - marked.ids.begin())];
      places.push_back({p.x, p.y});
    }
    if (places.size() == 3) return curvature_through(places[0], places[1], places[2]);
  }
  return 0;
}

/// Rough corners; a homography of the detected corners gives the lattice directions.
std::vector<RoughCorner> rough_of(const Marked& marked, const io::Pattern& pattern) {
  const auto columns = static_cast<int>(pattern.columns);
  std::vector<cv::Point2d> board;
  for (const int id : marked.ids) board.emplace_back(id % columns, id / columns);
  const cv::Mat homography = cv::findHomography(board, marked.at);
  std::vector<RoughCorner> rough;
  if (homography.empty()) return rough;
  for (std::size_t i = 0; i < board.size(); ++i) {
    std::vector<cv::Point2d> cross;
    for (const auto& [dx, dy] : {std::pair{-0.5, 0.0}, {0.5, 0.0}, {0.0, -0.5}, {0.0, 0.5}})
      cross.emplace_back(board[i].x + dx, board[i].y + dy);
    cv::perspectiveTransform(cross, cross, homography);
    const cv::Point2d a = cross[1] - cross[0], b = cross[3] - cross[2];
    rough.push_back({static_cast<std::size_t>(marked.ids[i]),
                     marked.at[i].x,
                     marked.at[i].y,
                     {a.x, a.y},
                     {b.x, b.y},
                     (1 - pattern.marker / pattern.square) / 2,
                     {curvature(marked, columns, i, {1, 0}), curvature(marked, columns, i, {0, 1})}});
  }
  return rough;
}

BoardSearch checked(const Image& image, const std::vector<RoughCorner>& rough, std::size_t columns) {
  BoardSearch result;
  std::vector<RefinedCorner> corners;
  double squares = 0, freedom = 0, sign = 0;
  for (const RoughCorner& r : rough) {
    RefinedCorner refined;
    std::array<double, 4> means{};
    if (!refine(image, r, refined) || std::hypot(refined.corner.u - r.u, refined.corner.v - r.v) > 1.5) continue;
    RoughCorner centred = r;
    centred.u = refined.corner.u;
    centred.v = refined.corner.v;
    if (!quadrants(image, centred, means) || crossing(means) < min_marked_crossing) continue;
    squares += refined.residual;
    freedom += refined.freedom;
    const bool turn = (r.point % columns + r.point / columns) % 2 == 1;
    sign += (refined.contrast > 0) != turn ? 1 : -1;
    corners.push_back(refined);
  }
  if (corners.size() < min_corners) {
    result.reason = fmt::format("{} of its corners are seen, at least {} are needed", corners.size(), min_corners);
    return result;
  }
  if (std::abs(sign) < static_cast<double>(corners.size())) {
    result.reason = "the colours of its squares do not alternate: is it another board?";
    return result;
  }
  result.pixel_noise = std::sqrt(squares / freedom);
  const double noise = std::isfinite(image.noise) ? std::max(image.noise, result.pixel_noise) : result.pixel_noise;
  set_noise(corners, noise, result.corners);
  return result;
}

}  // namespace

BoardSearch find_charuco(const Image& image, const io::Pattern& pattern) {
  BoardSearch best;
  best.reason = "no marker of the dictionary " + pattern.dictionary + " was found";
  for (const Tones tones : {Tones::linear, Tones::root, Tones::local}) {
    const Marked marked = detect(image, pattern, tones);
    if (marked.ids.size() < min_corners) {
      if (!marked.ids.empty() && !best.found())
        best.reason = fmt::format("{} of its corners are seen, at least {} are needed", marked.ids.size(), min_corners);
      continue;
    }
    BoardSearch found = checked(image, rough_of(marked, pattern), static_cast<std::size_t>(pattern.columns));
    if (found.corners.size() > best.corners.size() || !best.found()) best = std::move(found);
    if (best.corners.size() == static_cast<std::size_t>(pattern.columns * pattern.rows)) break;
  }
  return best;
}

}  // namespace tofgraph::calibration
