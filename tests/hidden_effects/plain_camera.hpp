// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A slow and simple model of a PMD CamCube 2.0 in front of a board, implemented only from the formulas of the
/// reference: it shares no code with the simulator, so that the gap search is not evaluated with its own physics. SI,
/// double, images row by row. plain_camera.md lists the decisions where the reference leaves a choice.
#pragma once

#include "tests/hidden_effects/clutter.hpp"
#include "tests/hidden_effects/effects.hpp"
#include "tests/hidden_effects/patterns.hpp"

#include <array>
#include <complex>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace tofgraph::hidden {

using Image = std::vector<double>;
using PhasorImage = std::vector<std::complex<double>>;

inline constexpr double speed_of_light = 299792458.0;  // m/s

/// The nominal camera (published values; gain, contrast and noise as assumed by the profile).
struct Camera {
  int width = 204, height = 204;
  double pitch = 40e-6, focal_length = 12.8e-3;  ///< m
  double center_x = 101.5, center_y = 101.5;     ///< px, 0-based
  double modulation_frequency = 20e6;            ///< Hz
  double source_x = 50e-3;                       ///< m; the arrays are at -x (left) and +x (right) in the sensor plane
  double frame_rate = 80;                        ///< Hz
  double gain = 7.0e6;                           ///< counts m^2/s
  double contrast = 0.5;
  double read_noise = 3, shot_noise = 0.012;                      ///< counts (sd of a tap); counts (variance per count)
  std::vector<double> steps = {0, M_PI / 2, M_PI, 3 * M_PI / 2};  ///< rad, of the images of a frame

  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  double metres_per_radian() const { return speed_of_light / (4 * M_PI * modulation_frequency); }
};

/// True state of camera and scene in one condition.
struct View {
  double distance = 1;                 ///< m, sensor plane to board on the axis, as stated by the rail or the laser
  double tilt_x = 0, tilt_y = 0;       ///< rad, normal = R_y R_x e_z
  double reflectivity = 0.85;          ///< 0..1
  double integration_time = 1e-3;      ///< s
  std::array<bool, 2> on{true, true};  ///< left, right
  bool ambient = false;
  double time_since_power_on = std::numeric_limits<double>::infinity();  ///< s
  double roll = 0;                                                       ///< rad
  double velocity = std::numeric_limits<double>::quiet_NaN();            ///< m/s; NaN: not stated
  bool laser = false, capped = false, covered = false;  ///< reference: laser, lens: capped, rail: covered
  double drift_distance = 0, drift_amplitude = 1;       ///< the camera's own drift at this time
  Smooth warp;     ///< m, displacement of the board away from the camera, over its own x and y in m from its point
                   ///< on the axis
  Smooth residue;  ///< m, distance error over column and row
  Image paint;     ///< factor on the reflectivity of each pixel's part of the board; empty: 1
  std::size_t order = 0;        ///< position in the order measured
  double earlier_distance = 1;  ///< m, of the previously measured condition
};

enum class Light { reference, physical };

/// Maps of an individual camera; empty ones act as zeros.
struct PixelMaps {
  Image fixed_pattern, fixed_pattern_slope;  ///< m, m/m relative to 2 m
  Image response, dark, dark_rate;           ///< relative, counts, counts/s
};

struct Physics {
  Camera camera;
  Light light = Light::reference;
  Effects effects;
  PixelMaps maps;
  std::vector<Pattern> patterns;
};

/// Light on the sensor: its phasor, and the total light that contributes to I. Amplitudes in counts.
struct SensorLight {
  PhasorImage phasor;
  Image total;
};

/// All levels up to the end of the phasor level.
/// @param displacement m, by which the board has moved away since the first phase image
SensorLight light_on_sensor(const Physics& physics, const View& view, double displacement);

/// Mean taps of each pixel, in counts, before the readout, one image of each per step.
struct Taps {
  std::vector<Image> a, b;
};
/// Samples and taps level, up to the expected counts; noise, converter and full well are added by Readout.
Taps expected_taps(const Physics& physics, const View& view);

enum class NoiseKind { none, gaussian, heavy, drift };

/// Conversion of a tap: noise (read and shot, `temporal_noise`), `adc_nonlinearity`, `saturation`. Returns real
/// numbers; the capture rounds them.
class Readout {
 public:
  Readout(const Physics& physics, NoiseKind kind);
  double operator()(double expected, std::mt19937_64& random);

 private:
  NoiseKind kind_;
  double read_variance_, shot_noise_, factor_, quadratic_, cubic_, full_scale_, full_well_;
  std::normal_distribution<double> normal_;
  std::student_t_distribution<double> heavy_{3};
};

}  // namespace tofgraph::hidden
