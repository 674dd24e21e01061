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

inline constexpr double usual_time_constant = 720;  ///< s; 5 to 20 min are reported for ToF cameras
inline constexpr std::array usual_time_constants = {300.0, 600.0, 900.0, 1200.0};  ///< s
inline constexpr double usual_settling_time = 3600;                                ///< s, section 3.2 of the reference
inline constexpr std::array tolerances = {10e-3, 5e-3, 2e-3, 1e-3};  ///< m, of the table of settling times

/// RMSE (3.1) of one frame in which every pixel has the same offset correction, and its contributions:
/// rmse^2 = bias^2 + noise^2 + pattern^2.
struct FrameError {
  double rmse = unknown, bias = unknown;  ///< m
  double noise = unknown;                 ///< m, of a pixel in one frame; NaN: unknown, not included in the RMSE
  double pattern = unknown;               ///< m, fixed differences between pixels
};

/// Series of one target, distance and integration time over the time since power-on.
struct Series {
  std::size_t target = 0;
  double distance = 0, integration_time = 0;  ///< m, s
  std::vector<const Board*> points;           ///< in ascending order of time since power-on
  std::vector<double> window_means;           ///< m, measured distance in the reported window; NaN: no pixel in it
  double corrected_at = unknown;              ///< s since power-on, of the point whose offset correction is used
  std::vector<FrameError> errors;             ///< per point

  double time(std::size_t i) const { return points[i]->condition.time_since_power_on; }
  double span() const { return time(points.size() - 1) - time(0); }  ///< s
  /// Mean and standard deviation over time (table 3.1) in the reported window: integrals by the trapezoidal rule, so
  /// that dense points at the start are weighted by the time they cover.
  Moments window_moments() const;
};
/// Sets the errors of a series whose offset is corrected with that of the point nearest to a time.
/// @param corrected_at s; beyond the series: its nearest end
void set_frame_errors(double corrected_at, Series& series);

/// Value with its standard deviation.
struct Estimate {
  double value = unknown, sd = unknown;
};

/// D(t) = start + drift (1 - e^(-t / time_constant)) + slow_drift (1 - e^(-t / slow_time_constant)), lengths in m of
/// the half path, times in s.
struct Drift {
  Estimate start, drift, time_constant;
  Estimate slow_drift, slow_time_constant;  ///< unknown: one time constant is sufficient
  Estimate droop;                           ///< loss of light: a(t) = a(0) (1 - droop (1 - e^(-t / time_constant)))
  double scatter = unknown;                 ///< m, root mean square of the residual
  double redundancy = 1;                    ///< number of points with the information of one independent point
  bool seen = false;                        ///< the drift is significant
  double upper_limit = unknown;             ///< m, 95 %, of an insignificant drift, with a usual time constant
  Interval held_out_before,
      held_out_after;  ///< m, inner fifths of the time held out: by a constant, by the fit

  double at(double time) const;
  bool has_slow() const { return slow_drift.value == slow_drift.value; }
};

/// @param slow_too allows a second time constant
Drift fit_drift(const std::vector<double>& times, const std::vector<double>& distances, bool slow_too = true);
/// Droop of the light, with the time constant of the drift.
Estimate fit_droop(const std::vector<double>& times, const std::vector<double>& amplitudes, double time_constant);
/// Recording time, at the same frame interval and noise, that determines the time constant to 10 %; s.
double sufficient_span(const Drift& drift, double interval);
/// Time after which the fit stays within a tolerance of its final distance; s; NaN: the drift is not significant or
/// does not determine its time constant.
/// @param end s, of the recording
double settled_after(const Drift& drift, double tolerance, double end);

/// Common model of all series: drift (t_int / reference_time)^exponent, one time constant.
struct WarmUpModel {
  Estimate drift, time_constant, exponent, slow_drift, slow_time_constant, droop;
  double reference_time = unknown;  ///< s
  double misfit = 0;                ///< m, largest deviation of a series' drift from it
  std::vector<std::string> notes;
};
WarmUpModel combine(const std::vector<Series>& series, const std::vector<Drift>& drifts);

/// Boards of a campaign by series. Long recordings are split into points of a few frames.
struct WarmUpData {
  Campaign campaign;
  std::vector<Series> series;
};
/// @throws config::ConfigurationError with all errors, e.g. a condition with unknown time since power-on
WarmUpData read_warm_up(const Request& request);

report::Page warm_up_report(const WarmUpData& data, const std::vector<Drift>& drifts, const WarmUpModel& model,
                            double tolerance, const std::string& verdict);

}  // namespace tofgraph::calibration
