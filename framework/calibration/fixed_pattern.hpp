// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Fixed pattern of a camera's distances: an offset per pixel and its increase with the distance, from boards at
/// several distances and rolls, whose shape, tilts and positions are estimated too.
#pragma once

#include "calibration/campaign_inputs.hpp"
#include "calibration/interval.hpp"

#include <array>
#include <string>
#include <vector>

namespace tofgraph::calibration {

inline constexpr double slope_origin = 2;  ///< m: origin of the slope term of the effect fixed_pattern

/// Deviation of one condition from the model of its flat board, per pixel; NaN: the pixel was not used.
struct PatternView {
  std::size_t condition = 0;                ///< index in the campaign
  std::vector<float> residual;              ///< m, D_mes - D(T)
  std::vector<float> weight;                ///< 1/m^2, of the mean of its frames
  std::vector<float> distance;              ///< m, D(T)
  std::vector<float> along_z;               ///< dD/dT of a flat board
  std::vector<float> faintness;             ///< integration time / amplitude, relative to its mean over all views
  double board_distance = 0;                ///< m
  std::vector<std::array<float, 2>> place;  ///< m, point of the board seen by the pixel, in the board's axes
};

struct PatternData {
  Campaign campaign;
  std::vector<PatternView> views;
  std::size_t rows = 0, columns = 0;
  double extent = 1;             ///< m, half the size of the visible part of the board
  double metres_per_radian = 1;  ///< half path for a phase of 1 rad
  bool noise_known = true;       ///< every condition has several frames
};
/// @throws config::ConfigurationError with all errors
PatternData read_pattern(const Request& request);

/// Deviation of a board from its stated pose, and the effect on a view of a distance-dependent error: an offset common
/// to all pixels, a displacement, and a curvature.
struct ViewPose {
  double offset = 0;              ///< m of the half path, besides the waves: integration time etc.
  double z = 0;                   ///< m
  double tilt_x = 0, tilt_y = 0;  ///< rad about the board's own axes, small
  double bend = 0;                ///< 1/m: m per squared m of the half path beyond the board's distance
};

struct PatternFit {
  std::vector<double> map, map_sd, slope, slope_sd;  ///< m, m/m; unknown pixels: 0 with a standard deviation of NaN
  bool has_slope = false;
  double slope_evidence = unknown;  ///< mean square of the slopes over their standard deviations; 1: noise only
  std::vector<ViewPose> poses;      ///< per view
  std::vector<double> shape;        ///< of the board, m, one coefficient per shape_terms
  std::vector<double> shape_sd;
  std::vector<double> waves;            ///< m, distance-dependent error: cosine and sine of each harmonic
  double gradient = unknown;            ///< derivative of ln marginal likelihood by ln jitter, per pose
  bool settled = false;                 ///< the gradient vanished from both starts
  double restart_difference = unknown;  ///< m, root mean square difference of the maps from both starts
  double input_spread = unknown;        ///< m, robust standard deviation over the pixels of a view, median of the views
  ViewPose jitter;                      ///< estimated standard deviations of the poses; offset: not used
  double misfit = unknown;              ///< residual over noise, root mean square; 1: noise only
  double noise = unknown;               ///< m, of a pixel's mean in one view, root mean square
  Interval before, after;               ///< m, of held-out distances, without the boards' poses
  double noise_floor = unknown;         ///< m, contribution of the noise to these
  std::vector<std::string> notes;
};

/// Smooth shapes x^i y^j of a board in units of its half extent, without position and tilt.
inline constexpr std::array<std::array<int, 2>, 12> shape_terms = {
    {{2, 0}, {1, 1}, {0, 2}, {3, 0}, {2, 1}, {1, 2}, {0, 3}, {4, 0}, {3, 1}, {2, 2}, {1, 3}, {0, 4}}};
/// Values of the terms. @param x, y in units of the half extent
std::array<double, shape_terms.size()> shape_terms_at(double x, double y);
/// Distance of the board's surface behind its plane, m.
double shape_at(const std::vector<double>& shape, double x, double y);

/// Reason why a fit cannot be used: it diverged or did not converge; empty: it can be used.
std::string divergence_of(const PatternData& data, const PatternFit& fit);

PatternFit fit_pattern(const PatternData& data, const std::function<void(double share)>& progress);

report::Page fixed_pattern_report(const PatternData& data, const PatternFit& fit, const std::string& verdict);

}  // namespace tofgraph::calibration
