// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Bundle adjustment (Zhang's method as one least-squares problem): a lens, the poses of a board in all views,
/// the board's warp, and distances measured on it. Independent of images and files: corners in, solution out.
#pragma once

#include "calibration/lens_model.hpp"

#include <tofgraph/physics/geometry.hpp>

#include <Eigen/Core>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Point of the board in its own frame, x along the columns, y along the rows, z away from the camera. Metres.
struct BoardPoint {
  double x = 0, y = 0;
};

/// Detected corner.
struct Corner {
  std::size_t point = 0;               ///< index into Observations::points
  double u = 0, v = 0;                 ///< px, 0-based, pixel centres at integers
  std::array<double, 3> covariance{};  ///< px^2: uu, uv, vv
};

/// Distance measured on the board, half path; mean over some pixels around (u, v).
struct BoardDistance {
  double u = 0, v = 0;
  double distance = 0;  ///< m
  double sd = 0;        ///< m, of this mean, from the pixel noise
};

struct View {
  std::string id;
  std::vector<Corner> corners;
  std::vector<BoardDistance> distances;  ///< may be empty
};

/// Light paths: sources with their weights; the focal length in metres is that of fx, fy times pitch.
struct LightPaths {
  std::vector<physics::WeightedSource> sources;
  std::array<double, 2> pitch{};  ///< m
};

struct Observations {
  std::size_t width = 0, height = 0;  ///< px
  std::vector<BoardPoint> points;     ///< of the board, relative to its centre
  double circle_radius = 0;           ///< m; points are centres of circles, observed as centroids; 0: corners
  bool quarter_turns = false;         ///< views may differ by quarter turns, because the board is symmetric
  std::vector<View> views;
  std::optional<LightPaths> light;         ///< none: distances are not used
  bool fisheye = false;                    ///< fits the fisheye model
  std::optional<LensParameters> expected;  ///< nominal lens as starting point
};

/// Free parameters in addition to fx fy cx cy k1 k2 p1 p2; a fisheye has k1 to k4 instead of the last four.
struct LensOptions {
  bool k3 = false, skew = false, rational = false;
  bool warp = true;       ///< the board may be warped
  bool distances = true;  ///< use distances if there are any
};

struct Pose {
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< R_camera_board, row-major
  std::array<double, 3> translation{};                        ///< m, of the board's centre in the optical frame
};

/// Result for one view.
struct SolvedView {
  std::size_t view = 0;  ///< index into Observations::views
  Pose pose;
  double range_shift = 0;                        ///< m, of this view's distances, besides the common offset and scale
  std::vector<std::array<double, 2>> residuals;  ///< px, observed minus predicted, per corner
  std::vector<bool> used;                        ///< per corner
  std::vector<double> distance_residuals;        ///< m, measured minus predicted
  double rms = 0;                                ///< px, over the corners used
};

struct LeftOut {
  std::size_t view = 0;
  std::string reason;
};

/// Free parameters in the order of the covariance: lens, warp, range, then seven per view: a small rotation about the
/// camera's axes, the translation, the shift of the distances.
struct Layout {
  std::vector<std::size_t> lens;  ///< indices into LensParameters
  std::size_t warp = 0;           ///< number of warp parameters
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
  std::vector<LeftOut> doubtful;  ///< outlier views that were kept, because too few views would remain
  std::size_t corners_left_out = 0;
  Layout layout;
  Eigen::MatrixXd covariance;  ///< of all free parameters, scaled by the scatter of the residuals
  double variance_factor = 1;  ///< squared residuals of the corners relative to their stated covariances
  double rms = 0;              ///< px, of all residuals, per coordinate
  double degrees_of_freedom = 0;
  double range_noise_factor = 1;  ///< standard deviation of distances relative to the stated one
  double range_shift_sd = 0;      ///< m, scatter of the shifts of views

  double sd(std::size_t parameter) const;  ///< of a lens parameter; 0 if it was not free
};

inline constexpr std::size_t min_views = 4;
/// Prior standard deviation of the scale of distances: the local slope of a cyclic error of 3 mm at 20 MHz.
inline constexpr double range_scale_prior = 0.01;

/// Quadratic warps of a board at a point: along x, along y, twist; each 1 at the edge and 0 in the centre. Constant and
/// linear terms would be equivalent to a change of pose.
std::array<double, 3> warp_basis(const Observations& observations, const BoardPoint& point);

/// Solves the problem. Inconsistent views are excluded and reported, and so are single corners.
/// @throws std::runtime_error naming what is missing: views, tilt, convergence
LensSolution solve_lens(const Observations& observations, const LensOptions& options);

}  // namespace tofgraph::calibration
