// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Measurement of a board at a known position, compared with the ideal camera: chapter 6 of the reference for one
/// condition. SI.
#pragma once

#include "io/condition.hpp"
#include "io/offset_calibration.hpp"

#include <tofgraph/physics/geometry.hpp>

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace tofgraph::calibration {

inline constexpr double unknown = io::unknown;

/// Mean and standard deviation (n - 1) over the pixels of a window. NaN: unknown.
struct Moments {
  double mean = unknown, sd = unknown;
};

/// Numbers of excluded pixels of a window, each counted under one reason.
struct UnusablePixels {
  std::size_t pixels = 0;     ///< pixels in the window
  std::size_t map = 0;        ///< bad in the map of the camera's profile
  std::size_t invalid = 0;    ///< not a number, or no positive amplitude, in some frame
  std::size_t saturated = 0;  ///< in some frame
  std::size_t amplitude = 0;  ///< amplitude differs from the neighbours': dead, stuck or without modulation
  std::size_t noisy = 0;      ///< noisier than the neighbours
  std::size_t distance = 0;   ///< distance differs from the neighbours'
  std::size_t wrapped = 0;    ///< differs from the others by a full unambiguous range

  std::size_t total() const { return map + invalid + saturated + amplitude + noisy + distance + wrapped; }
  UnusablePixels& operator+=(const UnusablePixels& other);
  /// Counts with their reasons, for messages: `35 bad in the profile's map, 2 noisier than their neighbours`.
  std::string described() const;
};

/// Images of one condition, averaged over its frames, at the pixels that are used.
struct MeanImages {
  std::vector<std::size_t> pixels;
  std::vector<double> distance;   ///< m, half path
  std::vector<double> amplitude;  ///< counts; empty: unknown
  std::vector<double> variance;   ///< m^2, of a pixel's distance in one frame; empty: one frame only
  double noise = unknown;         ///< m, standard deviation of a pixel's distance in one frame; NaN: one frame only
  std::size_t frames = 0;
  double saturated = 0;           ///< fraction of the window's pixels, which are excluded
  bool shows_saturation = false;  ///< true for taps
  UnusablePixels left_out;
};

/// Falloff of the light over the image: sums of one condition, about its own means, for a fit of ln response = b1 q +
/// b2 q^2. q = tan^2 of the ray's angle to the axis.
struct FalloffSums {
  double count = 0, q = 0, q2 = 0, level = 0;  ///< means of q, q^2 and ln(amplitude D_t^2 / (gain t))
  std::array<double, 3> square{};              ///< sums of (q, q), (q, q^2), (q^2, q^2)
  std::array<double, 2> product{};             ///< sums of (q, level), (q^2, level)
};

/// Measurement of a condition. Lengths that are not contained in a table's statistics are NaN.
struct Board {
  io::Condition condition;
  std::size_t frames = 0;
  double pixels = 0;
  Moments modelled;               ///< D_model = D(T), (6.1)
  Moments measured;               ///< D_mes
  Moments corrected;              ///< z: depth after the non-linearity model; its mean is D_avg, (6.3)
  Moments remodelled;             ///< D_model1 = D(D_avg), (6.4)
  Moments offset;                 ///< O = D_model - D_model1, (6.5)
  Moments offset_corrected;       ///< D_mes + O, (6.6)
  Moments final;                  ///< its depth
  double distance = 0;            ///< m, T: mean true depth of the window; for an untilted board its distance
  double depth_sd = unknown;      ///< m, of the mean z: from the spread of the pixels or the scatter of repetitions
  double rmse = unknown;          ///< m, of offset-corrected against modelled distance, (6.7)
  double noise = unknown;         ///< m, of the distance in one frame
  double amplitude = unknown;     ///< counts, mean
  double reflectivity = unknown;  ///< amplitude D_t^2 / (gain t_int), geometric mean, corrected for the falloff
  double saturated = 0;           ///< fraction of pixels
  bool shows_saturation = true;   ///< false: unknown, for phases and decoded frames
  FalloffSums falloff;

  double error() const { return distance - corrected.mean; }  ///< m, T - z
};

/// Plane of the board in the sensor frame, as seen by the rolled camera.
physics::Plane plane_of(const io::Condition& condition);
/// Converts a point of the sensor frame to the axes of the untilted, unrolled board: R^T (R_z(roll) P - centre), m.
/// R = R_y(tilt_y) R_x(tilt_x).
std::array<double, 2> on_board(const io::Condition& condition, physics::Vector3 point);

/// Measures boards of one camera.
class BoardModel {
 public:
  /// @param sources names of the active ones; empty: all
  /// @throws std::invalid_argument if the camera's geometry is not known in metres
  BoardModel(const tofgraph_camera& camera, io::OffsetVariant variant, const std::vector<std::string>& sources = {});

  /// Pixels of the window that see the board: within its size and with a ray, row-major.
  std::vector<std::size_t> window(const io::Condition& condition) const;
  /// D(T) of these pixels.
  std::vector<double> modelled(const io::Condition& condition, const std::vector<std::size_t>& pixels) const;
  /// Measurement from a capture. @param images at least one pixel
  Board measure(const io::Condition& condition, const MeanImages& images) const;
  /// Measurement from a table row with measured depth or distance. @throws std::invalid_argument if it is impossible
  Board measure(const io::Condition& condition) const;
  /// tan^2 of a pixel's angle to the axis.
  double angle(std::size_t pixel) const;
  const physics::Geometry& geometry() const { return geometry_; }
  physics::Vector3 ray(std::size_t pixel) const { return rays_[pixel]; }

 private:
  struct Places;
  Places places(const io::Condition& condition, const std::vector<std::size_t>& pixels) const;
  void remodel(Board& board, const Places& places, const std::vector<double>& measured) const;
  double depth_of_mean(const std::vector<std::size_t>& pixels, double distance, double start) const;

  const tofgraph_camera& camera_;
  physics::Geometry geometry_;
  std::vector<physics::Vector3> rays_;
  io::OffsetVariant variant_;
};

/// Models of all conditions of a campaign, by their active sources.
class BoardModels {
 public:
  /// @throws std::invalid_argument as BoardModel
  BoardModels(const tofgraph_camera& camera, io::OffsetVariant variant, const std::vector<io::Condition>& conditions);
  const BoardModel& of(const io::Condition& condition) const { return models_.at(condition.sources); }

 private:
  std::map<std::vector<std::string>, BoardModel> models_;
};

/// Moments of values; NaN if there are none.
Moments moments_of(const std::vector<double>& values);

/// Best common fit of b1, b2 to all boards; zeros if their windows are too narrow to determine them.
std::array<double, 2> fit_falloff(const std::vector<Board>& boards);

}  // namespace tofgraph::calibration
