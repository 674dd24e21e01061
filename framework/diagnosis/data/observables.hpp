// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Observables of a superpixel in one condition, as differences from the ideal camera: distance (m), ln amplitude, ln
/// intensity, and the null channels N1 / 2I and N2 / a, which are zero in an ideal camera.
#pragma once

#include <tofgraph/physics/exposures.hpp>

#include <array>
#include <complex>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

namespace tofgraph::diagnosis {

inline constexpr std::size_t distance = 0, amplitude = 1, intensity = 2, null1 = 3, null2 = 4, observables = 5;
inline constexpr std::array<std::string_view, observables> observable_names = {"distance", "amplitude", "intensity",
                                                                               "null1", "null2"};
/// Labels in reports.
inline constexpr std::array<const char*, observables> observable_labels = {"distance", "amplitude", "intensity",
                                                                           "N1 / 2I", "N2 / a"};
/// SI units of the differences; quantities other than lengths are relative.
inline constexpr std::array<std::string_view, observables> observable_units = {"m", "", "", "", ""};

/// Values and variances, observables x superpixels. Unknown values are 0, with infinite variance.
struct Observations {
  std::vector<double> value, variance;
};

/// Row or column of the grid that contains a pixel, or one of `size` equally spaced points.
constexpr std::size_t superpixel_of(std::size_t place, std::size_t size, std::size_t count) {
  return place * count / size;
}
/// Superpixel of a pixel, in a grid of count x count.
constexpr std::size_t superpixel_of(std::size_t pixel, std::size_t rows, std::size_t columns, std::size_t count) {
  return superpixel_of(pixel / columns, rows, count) * count + superpixel_of(pixel % columns, columns, count);
}
/// First pixel of a superpixel's row or column.
constexpr std::size_t first_of(std::size_t superpixel, std::size_t size, std::size_t count) {
  return (superpixel * size + count - 1) / count;
}

/// Signal of a pixel, or a sum of signals.
struct Signal {
  std::complex<double> phasor;  ///< a e^(j Psi), counts
  double intensity = 0;         ///< mean of the taps, counts
  double null1 = 0, null2 = 0;  ///< N1 and N2, counts

  Signal& operator+=(const Signal& other) {
    phasor += other.phasor;
    intensity += other.intensity;
    null1 += other.null1;
    null2 += other.null2;
    return *this;
  }
};

// ---- From the images of a frame to its signal: least squares of the phase, and the residuals ----

/// Demodulation with three or more steps of one frequency, in any order. For four steps of 90 degrees null1 and null2
/// are N1 and N2 of equations.md. Three steps leave no residual, hence no null2; more than four leave several, of which
/// only the residual of the first image is used, as null2.
class Demodulation {
 public:
  /// @throws std::invalid_argument if the exposures are of several frequencies or do not determine the phase
  explicit Demodulation(const physics::Exposures& exposures);

  std::size_t exposures() const { return cosine_.size(); }
  bool has_null2() const { return !rest_.empty(); }

  /// @param samples c_k = A_k - B_k, one per exposure, counts @param intensity mean of the taps, counts
  Signal of_samples(std::span<const double> samples, double intensity) const;
  /// @param taps A_k, B_k (counts); those of image k start at taps[2 k stride]
  Signal of_taps(const double* taps, std::size_t stride) const;

  /// Variances of the phasor's components for samples of variance 1.
  struct Variance {
    double along, across;  ///< component in the phasor's direction, and at right angles to it
  };
  Variance variance(std::complex<double> phasor) const;
  double null1_variance() const { return null1_variance_; }
  double null2_variance() const { return 1 / static_cast<double>(exposures()); }

 private:
  std::vector<double> cosine_, sine_, offset_, rest_;  ///< weights of the samples
  double xx_, xy_, yy_, null1_variance_ = 0;
};

/// Demodulation with four steps of 90 degrees.
inline Demodulation four_steps() {
  return Demodulation({physics::four_exposures.begin(), physics::four_exposures.end()});
}

}  // namespace tofgraph::diagnosis
