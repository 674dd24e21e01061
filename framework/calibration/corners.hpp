// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The corners of a calibration pattern in one image of a low-resolution camera, to some hundredths of a pixel,
/// each with its covariance.
#pragma once

#include "calibration/bundle.hpp"
#include "io/campaign.hpp"

#include <array>
#include <limits>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Amplitude or intensity, row by row; NaN: an invalid pixel.
struct Image {
  std::size_t width = 0, height = 0;
  std::vector<double> values;
  double noise = std::numeric_limits<double>::quiet_NaN();  ///< a pixel's, if frames were compared

  double at(long column, long row) const {
    return values[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column)];
  }
};

/// Result of the search for the pattern.
struct BoardSearch {
  std::vector<Corner> corners;      ///< empty: not found
  std::string reason;               ///< why not
  std::array<int, 2> other_size{};  ///< columns, rows of another chessboard that was seen instead; 0: none
  double pixel_noise = 0;           ///< image noise about the corners, counts

  bool found() const { return !corners.empty(); }
};

/// The places of the pattern's points about their middle, m: row by row, of a ChArUco board its inner corners.
std::vector<BoardPoint> board_points(const io::Pattern& pattern);
/// Returns whether the pattern looks the same after a quarter turn.
bool looks_the_same_turned(const io::Pattern& pattern);
/// True if the pattern looks the same after a half turn: a chessboard of 8 x 6 inner corners does, of 9 x 6 does not.
bool looks_the_same_upside_down(const io::Pattern& pattern);

/// Finds the whole chessboard or grid, of a ChArUco board what is seen of it. What is returned was checked: every
/// corner is a crossing of two edges with the colours in turn, the lattice is smooth, and does not go on beyond the
/// pattern. The rows of one that looks the same after a half turn run to the right in the image.
/// @throws std::runtime_error what OpenCV does not take, as the end of a sentence about the image
BoardSearch find_board(const Image& image, const io::Pattern& pattern);

/// Approximate corners with the directions to their neighbours, px.
struct RoughCorner {
  std::size_t point = 0;
  double u = 0, v = 0;
  std::array<double, 2> along_row{}, along_column{};  ///< to the next corner
  double plain = 1;                                   ///< share of the way to the next corner without anything else
  std::array<double, 2> curvature{};                  ///< of the two edges, 1/px: see curvature_through()
};

/// Curvature of the circle through three places, 1/px; positive where it turns from u to v.
double curvature_through(const std::array<double, 2>& a, const std::array<double, 2>& b,
                         const std::array<double, 2>& c);

/// Corner after refine().
struct RefinedCorner {
  Corner corner;        ///< covariance for noise 1
  double contrast = 0;  ///< half the difference of bright and dark; its sign: which quadrants are bright
  double residual = 0;  ///< sum of squares
  double freedom = 0;   ///< pixels minus parameters
};

/// Standard deviation that the model of an edge adds to the noise, px.
inline constexpr double model_sd = 0.01;
/// Sets the covariances of fits with noise 1 for this noise of a pixel.
void set_noise(const std::vector<RefinedCorner>& refined, double noise, std::vector<Corner>& corners);

/// Fits two crossing edges, blurred, under a slope of brightness to the pixels about the corner:
/// I = (m + c E(s1) E(s2)) (1 + h d), d from the corner, s1, s2 across the edges, E a blurred step averaged over a
/// pixel. The edges have the curvature of the lattice, which a lens with distortion bends: a straight line fitted to an
/// edge of curvature k within +-L would be off by k L^2 / 6.
/// @returns false where no such crossing is
bool refine(const Image& image, const RoughCorner& rough, RefinedCorner& refined);
/// Means of the four quadrants between the edges about a place, in turn. False: outside the image.
bool quadrants(const Image& image, const RoughCorner& rough, std::array<double, 4>& means);
/// Contrast of the darker pair of opposite quadrants, by the brighter of its pixels' means, over the whole contrast: 1
/// for a crossing, at most 0 for the end of an edge or the corner of a square.
double crossing(const std::array<double, 4>& means);

}  // namespace tofgraph::calibration
