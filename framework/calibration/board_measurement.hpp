// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Measurement of one board at a known place, compared with the ideal camera: chapter 6 of the reference for one
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

/// Over the pixels of a window; deviation with n - 1. NaN: not known.
struct Moments {
  double mean = unknown, sd = unknown;
};

/// Pixels of a window that are left out, each under one reason.
struct UnusablePixels {
  std::size_t pixels = 0;     ///< pixels in the window
  std::size_t map = 0;        ///< bad in the map of the camera's profile
  std::size_t invalid = 0;    ///< not a number, or not a positive amplitude, in some frame
  std::size_t saturated = 0;  ///< in some frame
  std::size_t amplitude = 0;  ///< unlike the neighbours' amplitude: dead, stuck or without modulation
  std::size_t noisy = 0;      ///< noisier than the neighbours
  std::size_t distance = 0;   ///< unlike the neighbours' distance
  std::size_t wrapped = 0;    ///< a whole turn away from the others

  std::size_t total() const { return map + invalid + saturated + amplitude + noisy + distance + wrapped; }
  UnusablePixels& operator+=(const UnusablePixels& other);
  /// Counts with their reasons, for a message: `35 bad in the profile's map, 2 noisier than their neighbours`.
  std::string described() const;
};

/// The images of one condition, averaged over its frames. The pixels are those that are used.
struct MeanImages {
  std::vector<std::size_t> pixels;
  std::vector<double> distance;   ///< m, half path
  std::vector<double> amplitude;  ///< counts; empty: not known
  double noise = unknown;         ///< m, standard deviation of a pixel's distance in one frame; NaN: one frame only
  std::size_t frames = 0;
  double saturated = 0;           ///< share of the window's pixels, which are left out
  bool shows_saturation = false;  ///< taps do
  UnusablePixels left_out;
};

/// Falloff of the light over the image: sums of one condition, about its own means, for a fit of ln response = b1 q +
/// b2 q^2. q = tan^2 of the ray's angle to the axis.
struct FalloffSums {
  double count = 0, q = 0, q2 = 0, level = 0;  ///< means of q, q^2 and ln(amplitude D_t^2 / (gain t))
  std::array<double, 3> square{};              ///< sums of (q, q), (q, q^2), (q^2, q^2)
  std::array<double, 2> product{};             ///< sums of (q, level), (q^2, level)
};

/// Measurement of a condition. Lengths that a table's statistics do not contain are NaN.
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
  double distance = 0;            ///< m, T: mean true depth of the window; of an untilted board its distance
  double depth_sd = 0;            ///< m, of the mean z: from the pixels' spread, or the scatter of repeated conditions
  double rmse = unknown;          ///< m, of offset-corrected against modelled distance, (6.7)
  double noise = unknown;         ///< m, of the distance in one frame
  double amplitude = unknown;     ///< counts, mean
  double reflectivity = unknown;  ///< amplitude D_t^2 / (gain t_int), geometric mean, falloff taken out
  double saturated = 0;           ///< share of pixels
  bool shows_saturation = true;   ///< false: of phases and decoded frames nobody can tell
  FalloffSums falloff;

  double error() const { return distance - corrected.mean; }  ///< m, T - z
};

/// The board in the sensor frame, as the rolled camera sees it.
physics::Plane plane_of(const io::Condition& condition);
/// A point of the sensor frame in the axes of the untilted, unrolled board: R^T (R_z(roll) P - centre), m.
/// R = R_y(tilt_y) R_x(tilt_x).
std::array<double, 2> on_board(const io::Condition& condition, physics::Vector3 point);

/// Computes boards of one camera.
class BoardModel {
 public:
  /// @param sources those that are on, by name; empty: all
  /// @throws std::invalid_argument when the camera's geometry is not known in metres
  BoardModel(const tofgraph_camera& camera, io::OffsetVariant variant, const std::vector<std::string>& sources = {});

  /// The window's pixels that see the board: inside its size, with a ray. Row by row.
  std::vector<std::size_t> window(const io::Condition& condition) const;
  /// D(T) of these pixels.
  std::vector<double> modelled(const io::Condition& condition, const std::vector<std::size_t>& pixels) const;
  /// From a capture. @param images at least one pixel
  Board measure(const io::Condition& condition, const MeanImages& images) const;
  /// From a row of a table that has the measured depth or distance. @throws std::invalid_argument what cannot be
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

/// The models of all conditions of a campaign, by the sources that are on.
class BoardModels {
 public:
  /// @throws std::invalid_argument as BoardModel's
  BoardModels(const tofgraph_camera& camera, io::OffsetVariant variant, const std::vector<io::Condition>& conditions);
  const BoardModel& of(const io::Condition& condition) const { return models_.at(condition.sources); }

 private:
  std::map<std::vector<std::string>, BoardModel> models_;
};

/// Moments of values. None: NaN.
Moments moments_of(const std::vector<double>& values);

/// b1, b2 that fit all boards best; zeros where their windows are too narrow to tell.
std::array<double, 2> fit_falloff(const std::vector<Board>& boards);

}  // namespace tofgraph::calibration
