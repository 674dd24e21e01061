// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Unwrapping: one distance from the wrapped phases of several modulation frequencies, in double. Reference
/// implementation of phase_decoder.
#pragma once

#include <tofgraph/physics/exposures.hpp>
#include <tofgraph/physics/to_integer.hpp>

#include <limits>
#include <span>
#include <stdexcept>

namespace tofgraph::physics {

/// Greatest common divisor of the frequencies, within 1 ppm of the highest, Hz; 0 if none is greater than a thousandth
/// of the highest. Distances repeat after c / (2 f).
inline double common_frequency(const std::vector<double>& frequencies) {
  const double highest = *std::ranges::max_element(frequencies);
  double common = 0;
  for (double frequency : frequencies) {
    while (frequency > highest * 1e-6) {
      const double rest = std::abs(std::remainder(common, frequency));
      common = frequency;
      frequency = rest;
    }
  }
  return common >= highest * 1e-3 ? common : 0;
}

/// Selects the most likely of the distances that are consistent with the wrapped phases.
class Unwrapping {
 public:
  /// @param frequencies in ascending order, Hz
  /// @param max_range upper limit of the distances, m; infinity: the common period of the frequencies
  /// @throws std::invalid_argument if neither is known
  explicit Unwrapping(const std::vector<double>& frequencies,
                      double max_range = std::numeric_limits<double>::infinity()) {
    for (const double frequency : frequencies) ranges_.push_back(unambiguous_range(frequency));
    const double common = common_frequency(frequencies), step = ranges_.back();
    // An integer number of wraps of the highest frequency, however the frequencies are rounded.
    if (common > 0) repeat_ = std::round(frequencies.back() / common) * step;
    if (!(max_range < repeat_)) {
      if (repeat_ == std::numeric_limits<double>::infinity())
        throw std::invalid_argument("the modulation frequencies have no common range");
      last_ = to_integer(repeat_ / step, 1L) - 1;
      return;
    }
    // One more at each end: noise moves distances beyond the ends.
    max_range_ = max_range;
    first_ = -1;
    last_ = to_integer(std::ceil(max_range / step), 0L);
  }

  struct Result {
    double distance;      ///< m; NaN if a phase is NaN
    double cost, second;  ///< chi-square of the best and of the second-best wraps
  };

  /// Maximum likelihood over the wraps: for each wrap of the highest frequency the nearest wraps of the others.
  /// @param distances each within its unambiguous range, m @param weights 1 / variance, 1/m^2
  Result operator()(std::span<const double> distances, std::span<const double> weights) const {
    constexpr double never = std::numeric_limits<double>::infinity();
    const std::size_t last = ranges_.size() - 1;
    double all = 0;
    for (const double weight : weights) all += weight;
    Result result{std::numeric_limits<double>::quiet_NaN(), never, never};
    for (long wrap = first_; wrap <= last_; ++wrap) {
      const double reference = distances[last] + static_cast<double>(wrap) * ranges_[last];
      double first = 0, square = 0;
      for (std::size_t b = 0; b < last; ++b) {
        const double rest = std::remainder(distances[b] - reference, ranges_[b]);
        first += weights[b] * rest;
        square += weights[b] * rest * rest;
      }
      const double cost = square - first * first / all;
      if (cost < result.cost)
        result = {reference + first / all, cost, result.cost};
      else
        result.second = std::min(result.second, cost);
    }
    if (cyclic() && result.distance < 0) result.distance += repeat_;
    if (cyclic() && result.distance >= repeat_) result.distance -= repeat_;
    return result;
  }

  const std::vector<double>& ranges() const { return ranges_; }  ///< per frequency, m
  /// Returns true if the full common range is used cyclically; otherwise it ends at max_range.
  bool cyclic() const { return max_range_ == std::numeric_limits<double>::infinity(); }
  double range() const { return std::min(repeat_, max_range_); }  ///< m
  double repeat() const { return repeat_; }                       ///< m; infinity: never
  /// Number of wraps of the highest frequency that are tried.
  long first() const { return first_; }
  long last() const { return last_; }

 private:
  std::vector<double> ranges_;
  double repeat_ = std::numeric_limits<double>::infinity(), max_range_ = std::numeric_limits<double>::infinity();
  long first_ = 0, last_ = 0;
};

/// Distance after which decoded distances repeat, m; 0: never, or unknown.
/// @param stated modulation frequency of the frame, Hz: that of the distances if there is only one; NaN: unknown
/// @param nominal that of the camera, Hz, for frames that state none; NaN: unknown
inline double repeat_of(const Exposures& exposures, double stated, double nominal) {
  const double own = stated > 0 ? stated : nominal;
  if (exposures[0].frequency == 0 && !(own > 0)) return 0;
  const std::vector<double> frequencies = each_once(frequencies_of(exposures, own));
  if (frequencies.size() == 1) return unambiguous_range(stated > 0 ? stated : frequencies[0]);
  return common_frequency(frequencies) > 0 ? Unwrapping(frequencies).repeat() : 0;
}

/// Distance and amplitude of one pixel from any exposures: the reference implementation of phase_decoder, for samples
/// of equal variance.
class PhaseDecoding {
 public:
  /// @param own the frame's modulation frequency, Hz, used for exposures that state none
  /// @throws std::invalid_argument if the frequencies have no common range
  PhaseDecoding(const Exposures& exposures, double own)
      : fits_(phase_fits(exposures)), unwrapping_(each_once(frequencies_of(exposures, own))) {}

  struct Decoded {
    double distance, amplitude;  ///< m; counts, mean over the frequencies
    double disagreement;         ///< chi of the best wraps, for samples with the amplitude's standard deviation
  };
  Decoded operator()(const std::vector<double>& samples) const {
    std::array<double, max_exposures / min_exposures> distances{}, weights{};
    double amplitude = 0;
    for (std::size_t b = 0; b < fits_.size(); ++b) {
      const PhaseFit& fit = fits_[b];
      double x = 0, y = 0;
      for (std::size_t j = 0; j < fit.image.size(); ++j) {
        x += fit.cosine[j] * samples[fit.image[j]];
        y += fit.sine[j] * samples[fit.image[j]];
      }
      const double scale = unwrapping_.ranges()[b] / two_pi, square = x * x + y * y;
      double distance = scale * std::atan2(y, x);
      if (distance < 0) distance += unwrapping_.ranges()[b];
      if (distance >= unwrapping_.ranges()[b]) distance = 0;  // a tiny negative one rounds up to the range
      distances[b] = distance;
      weights[b] = square * square / (scale * scale * (x * x * fit.yy - 2 * x * y * fit.xy + y * y * fit.xx));
      amplitude += std::sqrt(square) / static_cast<double>(fits_.size());
    }
    if (fits_.size() == 1) return {distances[0], amplitude, 0};
    const Unwrapping::Result best = unwrapping_({distances.data(), fits_.size()}, {weights.data(), fits_.size()});
    return {best.distance, amplitude, std::sqrt(std::max(best.cost, 0.0)) / amplitude};
  }
  const std::vector<PhaseFit>& fits() const { return fits_; }
  /// Distance after which distances repeat, m.
  double range() const { return unwrapping_.range(); }

 private:
  std::vector<PhaseFit> fits_;
  Unwrapping unwrapping_;
};

}  // namespace tofgraph::physics
