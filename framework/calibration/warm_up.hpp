// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Drift of a camera since power-on: section 3.2 of the reference, figures 3.2 and 3.3, table 3.1.
#pragma once

#include "calibration/campaign_inputs.hpp"
#include "calibration/interval.hpp"

#include <array>
#include <string>
#include <vector>

namespace tofgraph::calibration {

inline constexpr double usual_time_constant = 720;  ///< s; 5 to 20 min are reported of ToF cameras
inline constexpr std::array usual_time_constants = {300.0, 600.0, 900.0, 1200.0};  ///< s
inline constexpr double usual_settling_time = 3600;                                ///< s, section 3.2 of the reference
inline constexpr std::array tolerances = {10e-3, 5e-3, 2e-3, 1e-3};  ///< m, of the table of settling times

/// RMSE (3.1) of one frame in which every pixel has the same offset correction, and its parts:
/// rmse^2 = bias^2 + noise^2 + pattern^2.
struct FrameError {
  double rmse = unknown, bias = unknown;  ///< m
  double noise = unknown;                 ///< m, of a pixel in one frame; NaN: not known, not in the RMSE
  double pattern = unknown;               ///< m, fixed differences between pixels
};

/// Series of one target, distance and integration time over the time since power-on.
struct Series {
  std::size_t target = 0;
  double distance = 0, integration_time = 0;  ///< m, s
  std::vector<const Board*> points;           ///< rising time since power-on
  std::vector<double> window_means;           ///< m, measured distance in the reported window; NaN: no pixel of it
  double corrected_at = unknown;              ///< s since power-on, of the point whose offset corrects all
  std::vector<FrameError> errors;             ///< per point

  double time(std::size_t i) const { return points[i]->condition.time_since_power_on; }
  double span() const { return time(points.size() - 1) - time(0); }  ///< s
  /// Mean and standard deviation over the time (table 3.1), of the reported window: integrals by the trapezoidal rule,
  /// so that points that are dense at the start count for no more time than they cover.
  Moments window_moments() const;
};
/// Errors of a series whose offset is corrected by that of the points about one time.
/// @param corrected_at s; beyond the series: its nearest end
void set_frame_errors(double corrected_at, Series& series);

/// A value with its standard deviation.
struct Estimate {
  double value = unknown, sd = unknown;
};

/// D(t) = start + drift (1 - e^(-t / time_constant)) + slow_drift (1 - e^(-t / slow_time_constant)), lengths in m of
/// the half path, times in s.
struct Drift {
  Estimate start, drift, time_constant;
  Estimate slow_drift, slow_time_constant;  ///< unknown: one time constant is enough
  Estimate droop;                           ///< loss of light: a(t) = a(0) (1 - droop (1 - e^(-t / time_constant)))
  double scatter = unknown;                 ///< m, root mean square of what the fit leaves
  double redundancy = 1;                    ///< points that say as much as one independent one
  bool seen = false;                        ///< the drift is significant
  double upper_limit = unknown;             ///< m, 95 %, of a drift that is not seen, with a usual time constant
  Interval held_out_before,
      held_out_after;  ///< m, inner fifths of the time left out and predicted: a constant, the fit

  double at(double time) const;
  bool has_slow() const { return slow_drift.value == slow_drift.value; }
};

/// @param slow_too whether a second time constant may be tried
Drift fit_drift(const std::vector<double>& times, const std::vector<double>& distances, bool slow_too = true);
/// The light's droop at the drift's time constant.
Estimate fit_droop(const std::vector<double>& times, const std::vector<double>& amplitudes, double time_constant);
/// Recording time, at the same pace and noise, that determines the time constant to a tenth; s.
double sufficient_span(const Drift& drift, double interval);
/// From when on the fit stays within a tolerance of the distance that it comes to; s. @param end s, of the recording
double settled_after(const Drift& drift, double tolerance, double end);

/// All series as one effect: drift (t_int / reference_time)^exponent, one time constant.
struct WarmUpModel {
  Estimate drift, time_constant, exponent, slow_drift, slow_time_constant, droop;
  double reference_time = unknown;  ///< s
  double misfit = 0;                ///< m, the largest difference of a series' drift to it
  std::vector<std::string> notes;
};
WarmUpModel combine(const std::vector<Series>& series, const std::vector<Drift>& drifts);

/// The boards of a campaign by series. Long recordings are split: each point is a few frames.
struct WarmUpData {
  Campaign campaign;
  std::vector<Series> series;
};
/// @throws config::ConfigurationError with every mistake: a condition whose time since power-on nobody knows
WarmUpData read_warm_up(const Request& request);

report::Page warm_up_report(const WarmUpData& data, const std::vector<Drift>& drifts, const WarmUpModel& model,
                            double tolerance, const std::string& verdict);

}  // namespace tofgraph::calibration
