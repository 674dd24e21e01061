// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Corners of a calibration pattern in one image of a low-resolution camera, accurate to a few hundredths of a
/// pixel, each with its covariance.
#pragma once

#include "calibration/bundle.hpp"
#include "io/campaign.hpp"

#include <array>
#include <limits>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Image of amplitude or intensity, row by row; NaN: invalid pixel.
struct Image {
  std::size_t width = 0, height = 0;
  std::vector<double> values;
  double noise = std::numeric_limits<double>::quiet_NaN();  ///< of a pixel, if frames were compared

  double at(long column, long row) const {
    return values[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column)];
  }
};

/// Result of the search for the pattern.
struct BoardSearch {
  std::vector<Corner> corners;      ///< empty: not found
  std::string reason;               ///< reason why not found
  std::array<int, 2> other_size{};  ///< columns, rows of another chessboard found instead; 0: none
  double pixel_noise = 0;           ///< residual noise around the corners, counts

  bool found() const { return !corners.empty(); }
};

/// Positions of the pattern points relative to their centre, m, row by row; inner corners of a ChArUco board.
std::vector<BoardPoint> board_points(const io::Pattern& pattern);
/// Returns true if the pattern looks the same after a quarter turn.
bool looks_the_same_turned(const io::Pattern& pattern);
/// Returns true if the pattern looks the same after a half turn: with 8 x 6 inner corners it does, with 9 x 6 not.
bool looks_the_same_upside_down(const io::Pattern& pattern);

/// Finds the whole chessboard or grid, or the visible part of a ChArUco board. Results are checked: each corner is
/// a crossing of two edges with alternating colours; a chessboard is smooth and ends with the pattern. If the pattern
/// looks the same after a half turn, its rows run to the right in the image.
/// @throws std::runtime_error if OpenCV rejects the image; the message ends a sentence about the image
BoardSearch find_board(const Image& image, const io::Pattern& pattern);

/// Approximate corner with the directions to its neighbours, px.
struct RoughCorner {
  std::size_t point = 0;
  double u = 0, v = 0;
  std::array<double, 2> along_row{}, along_column{};  ///< vector to the next corner
  double plain = 1;                                   ///< share of that way without other content, 0 to 1
  std::array<double, 2> curvature{};                  ///< of the two edges, 1/px; see curvature_through()
};

/// Curvature of the circle through three points, 1/px; positive if it turns from u to v.
double curvature_through(const std::array<double, 2>& a, const std::array<double, 2>& b,
                         const std::array<double, 2>& c);

/// Corner refined by refine().
struct RefinedCorner {
  Corner corner;        ///< covariance for noise 1
  double contrast = 0;  ///< half of bright minus dark; sign: which quadrants are bright
  double residual = 0;  ///< sum of squared residuals
  double freedom = 0;   ///< number of pixels minus number of parameters
};

/// Standard deviation due to the edge model, in addition to noise, px.
inline constexpr double model_sd = 0.01;
/// Scales covariances for noise 1 to this pixel noise.
void set_noise(const std::vector<RefinedCorner>& refined, double noise, std::vector<Corner>& corners);

/// Fits two blurred crossing edges with a brightness gradient to the pixels around a corner:
/// I = (m + c E(s1) E(s2)) (1 + h d), with the offset d from the corner, the distances s1, s2 from the edges and a
/// blurred step E averaged over a pixel. The edges have the curvature of the lattice, which lens distortion bends: a
/// straight line fitted to an edge of curvature k within +-L would be off by k L^2 / 6.
/// @returns false if there is no such crossing
bool refine(const Image& image, const RoughCorner& rough, RefinedCorner& refined);
/// Means of the four quadrants between the edges around a corner, in cyclic order. @returns false outside the image
bool quadrants(const Image& image, const RoughCorner& rough, std::array<double, 4>& means);
/// Gap between the means of the two bright and the two dark quadrants (darker bright one minus brighter dark one),
/// relative to the contrast: 1 for a crossing, at most 0 for the end of an edge or the corner of a square.
double crossing(const std::array<double, 4>& means);

}  // namespace tofgraph::calibration
