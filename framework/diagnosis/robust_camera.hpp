// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A camera of a few numbers, fitted to the medians of all conditions so that wrong ones do not count.
#pragma once

#include "diagnosis/ingest.hpp"

#include <Eigen/Core>

#include <complex>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Of a condition, against an ideal camera or against what is expected of it.
struct Deviation {
  double length = 0;  ///< half path, m, within half an unambiguous range
  double light = 0;   ///< of ln amplitude
};

class RobustCamera {
 public:
  explicit RobustCamera(const Measurements& measurements);

  /// Robust standard deviations of rest() over the conditions.
  const Deviation& spread() const { return spread_; }
  /// Whether the condition has any superpixel; whether its amplitude can be judged: two others of its target fit.
  bool knows(std::size_t condition) const { return !seen_[condition].phasor.empty(); }
  bool tells_light(std::size_t condition) const;
  const std::vector<std::string>& targets() const { return targets_; }
  bool knows_target(std::size_t target) const { return support_[target] >= 2; }

  /// What a condition differs by from what the others make expect.
  Deviation rest(std::size_t condition) const { return rest_as(condition, condition); }
  /// The same for its data under the settings of another one; with another target; with another integration time, s.
  Deviation rest_as(std::size_t data, std::size_t settings) const;
  Deviation rest_on(std::size_t condition, std::size_t target) const;
  Deviation rest_with(std::size_t condition, double integration_time) const;
  /// The board's distance that the amplitude says, m: light goes with its square.
  double distance_by_light(std::size_t condition) const;
  /// The distance that the phase says in the period of `start`, m, and what is left there.
  std::pair<double, Deviation> at_distance(std::size_t condition, double start) const;

 private:
  struct Seen {
    std::vector<std::size_t> at;               ///< superpixels with a number
    std::vector<std::complex<double>> phasor;  ///< measured, counts
    std::complex<double> inverse;              ///< mean of 1 / phasor; 0 where no amplitude is known
    double light = 0;                          ///< ln of the median amplitude
  };
  Seen see(const Measurements& measurements, std::size_t condition) const;
  Deviation against(std::size_t condition, const std::vector<Signal>& ideal) const;
  Deviation rest_of(std::size_t condition, Deviation raw, double integration_time, std::size_t target) const;
  /// Rows of the fit: of the length, and of the light.
  Eigen::Matrix2Xd rows(std::size_t condition, double integration_time, std::size_t target) const;
  void fit();
  void update(const std::vector<Deviation>& raw);

  const Design& design_;
  double scale_;  ///< m per rad
  std::vector<Seen> seen_;
  std::vector<std::string> targets_;
  std::vector<std::size_t> target_;   ///< of each condition
  std::vector<std::size_t> support_;  ///< conditions that fit, of each target
  std::vector<double> weight_;
  Eigen::VectorXd value_;  ///< of the columns
  Deviation spread_;
};

}  // namespace tofgraph::diagnosis
