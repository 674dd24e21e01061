// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Contrast and gain of a camera: relation of its amplitude a to the mean I of its taps, I = dark + a / (2
/// contrast), and to the light, a = gain reflectivity t_int / D_t^2. SI, amplitudes in counts.
#pragma once

#include "calibration/calibrate.hpp"
#include "calibration/interval.hpp"
#include "io/campaign.hpp"

#include <array>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Mean images of one condition; NaN: the pixel was saturated, invalid, or bad in the profile's map.
struct ResponseCondition {
  std::size_t index = 0;              ///< index in the campaign
  double integration_time = unknown;  ///< s
  double level = 0;                   ///< level of the held-out axis: distance, or else integration time
  std::vector<float> amplitude;       ///< counts
  std::vector<float> intensity;       ///< counts, mean of the taps
  std::vector<float> light;           ///< reflectivity t_int / D_t^2, s/m^2; empty: reflectivity unknown
};

struct ResponseData {
  std::vector<ResponseCondition> conditions;
  std::string axis = "distance";                     ///< of the levels: distance, integration time or condition
  std::vector<double> angle;                         ///< per pixel, tan^2 to the axis
  std::size_t rows = 0, columns = 0, saturated = 0;  ///< saturated: number of excluded values
  std::string serial;
  std::vector<std::string> notes;
};

/// Reads every condition without ambient light that has taps, or intensity beside phases or amplitude.
/// @throws config::ConfigurationError with all errors, and if no condition is usable
ResponseData read_response(const io::Campaign& campaign, const std::function<void(double share)>& progress);

/// Parameter of the camera. The interval is that of the median over the pixels, by leaving out whole levels.
struct ResponseValue {
  double value = unknown, sd = unknown;
  double low = unknown, high = unknown;  ///< 95 %
  std::vector<double> map, map_sd;       ///< per pixel; NaN: unknown
};

struct ResponseFit {
  ResponseValue contrast;
  ResponseValue gain;          ///< counts m^2/s, on the axis; the map includes the falloff towards the corners
  ResponseValue dark;          ///< counts of a tap without light; unknown if amplitudes differ too little
  double dark_rate = unknown;  ///< counts/s, median of the pixels; unknown with a single integration time
  std::size_t levels = 0;
  double before = unknown;  ///< relative error of I in held-out conditions, with the profile's contrast
  double after = unknown;   ///< with the fit
  double gain_before = unknown, gain_after = unknown;  ///< relative error of the amplitude
  std::size_t unknown_pixels = 0, outlying_pixels = 0;
};

/// Fits each pixel over the conditions by weighted least squares; medians over the pixels are robust against bad ones.
/// @throws std::invalid_argument for too few conditions
ResponseFit fit_response(const ResponseData& data, const tofgraph_camera& camera);

report::Page response_report(const io::Campaign& campaign, const ResponseData& data, const ResponseFit& fit,
                             const std::string& verdict);

}  // namespace tofgraph::calibration
