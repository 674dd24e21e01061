// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Zhang's method as one least-squares problem: a lens, the poses of a board in all views, the board's warp, and
/// the distances that the camera measured of it. Knows nothing of images and files: corners in, a solution out.
#pragma once

#include "calibration/lens_model.hpp"

#include <tofgraph/physics/geometry.hpp>

#include <Eigen/Core>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// A place of the board: its own frame, x along the columns, y along the rows, z away from the camera. Metres.
struct BoardPoint {
  double x = 0, y = 0;
};

/// A corner that was seen.
struct Corner {
  std::size_t point = 0;               ///< in Observations::points
  double u = 0, v = 0;                 ///< px from 0, a pixel's centre at integers
  std::array<double, 3> covariance{};  ///< px^2: uu, uv, vv
};

/// A distance that was measured on the board, half path; the mean over some pixels about (u, v).
struct BoardDistance {
  double u = 0, v = 0;
  double distance = 0;  ///< m
  double sd = 0;        ///< m, of this mean, from the noise of pixels
};

struct View {
  std::string id;
  std::vector<Corner> corners;
  std::vector<BoardDistance> distances;  ///< may be empty
};

/// Light paths: sources with their weights; the lens' focal length in metres is that of fx, fy times pitch.
struct LightPaths {
  std::vector<physics::WeightedSource> sources;
  std::array<double, 2> pitch{};  ///< m
};

struct Observations {
  std::size_t width = 0, height = 0;  ///< px
  std::vector<BoardPoint> points;     ///< board's, about its centre
  double circle_radius = 0;    ///< m; the points are centres of filled circles, seen by their centroids; 0: corners
  bool quarter_turns = false;  ///< views may differ by quarter turns of the board, which looks the same then
  std::vector<View> views;
  std::optional<LightPaths> light;         ///< none: distances are not used
  bool fisheye = false;                    ///< the lens is fitted by the fisheye model
  std::optional<LensParameters> expected;  ///< a nominal lens to begin with
};

/// Free parameters beyond fx fy cx cy k1 k2 p1 p2; a fisheye has k1 to k4 instead of the last four.
struct LensOptions {
  bool k3 = false, skew = false, rational = false;
  bool warp = true;       ///< the board may be bent
  bool distances = true;  ///< used if there are any
};

struct Pose {
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< R_camera_board, row by row
  std::array<double, 3> translation{};                        ///< m, of the board's centre in the optical frame
};

/// Result for one view.
struct SolvedView {
  std::size_t view = 0;  ///< in Observations::views
  Pose pose;
  double range_shift = 0;                        ///< m, of this view's distances beside the common offset and scale
  std::vector<std::array<double, 2>> residuals;  ///< px, seen minus predicted, of each corner
  std::vector<bool> used;                        ///< per corner
  std::vector<double> distance_residuals;        ///< m, measured minus predicted
  double rms = 0;                                ///< px, over the corners that are used
};

struct LeftOut {
  std::size_t view = 0;
  std::string reason;
};

/// The free parameters in the order of the covariance: lens, warp, range, then seven of each view: a small rotation in
/// the camera's axes, the translation, the shift of the distances.
struct Layout {
  std::vector<std::size_t> lens;  ///< which of LensParameters
  std::size_t warp = 0;           ///< number
  std::size_t range = 0;          ///< 0 or 2
  std::size_t shared() const { return lens.size() + warp + range; }
  std::size_t pose(std::size_t solved_view) const { return shared() + 7 * solved_view; }
};

struct LensSolution {
  LensParameters lens{};
  std::array<double, 3> warp{};  ///< m: sag from the centre to the edge along x, along y; twist at the corners
  double range_offset = 0;       ///< m, measured minus true half path
  double range_scale = 0;        ///< relative
  bool with_distances = false;
  std::vector<SolvedView> views;
  std::vector<LeftOut> left_out;
  std::vector<LeftOut> doubtful;  ///< views that were kept, because without them too few would remain
  std::size_t corners_left_out = 0;
  Layout layout;
  Eigen::MatrixXd covariance;  ///< covariance of all free parameters, with the scatter of the residuals
  double variance_factor = 1;  ///< corners' residuals over their stated covariances
  double rms = 0;              ///< px, of all residuals, a coordinate
  double degrees_of_freedom = 0;
  double range_noise_factor = 1;  ///< standard deviation of distances over the stated one
  double range_shift_sd = 0;      ///< m, scatter of the views' shifts

  double sd(std::size_t parameter) const;  ///< lens parameter's; 0 where it was not free
};

inline constexpr std::size_t min_views = 4;
/// Prior of the scale of distances, sd: the local slope of a cyclic error of 3 mm at 20 MHz.
inline constexpr double range_scale_prior = 0.01;

/// The quadratic warps of a board at a point: along x, along y, twist; each 1 at the edge and 0 in the centre. Constant
/// and linear parts would be the pose's.
std::array<double, 3> warp_basis(const Observations& observations, const BoardPoint& point);

/// Solves. Views whose residuals do not belong to the others are left out and named, single corners too.
/// @throws std::runtime_error saying what is missing: views, tilt, convergence
LensSolution solve_lens(const Observations& observations, const LensOptions& options);

}  // namespace tofgraph::calibration
