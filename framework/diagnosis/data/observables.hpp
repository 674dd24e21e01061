// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Observables of a superpixel of one condition, as differences to the ideal camera: distance (m), ln amplitude,
/// ln intensity, and the null channels N1 / 2I and N2 / a, which are zero in an ideal camera.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <limits>
#include <string_view>
#include <vector>

namespace tofgraph::diagnosis {

inline constexpr std::size_t distance = 0, amplitude = 1, intensity = 2, null1 = 3, null2 = 4, observables = 5;
inline constexpr std::array<std::string_view, observables> observable_names = {"distance", "amplitude", "intensity",
                                                                               "null1", "null2"};
/// For readers.
inline constexpr std::array<const char*, observables> observable_labels = {"distance", "amplitude", "intensity",
                                                                           "N1 / 2I", "N2 / a"};
/// Lengths in mm, what is relative in percent.
constexpr double shown_factor(std::size_t observable) { return observable == distance ? 1e3 : 100; }
constexpr const char* shown_unit(std::size_t observable) { return observable == distance ? "mm" : "%"; }
/// Units of the differences; what is not a length is relative.
inline constexpr std::array<std::string_view, observables> observable_units = {"m", "", "", "", ""};

/// Observables x superpixels. Where nothing is known the variance is infinite and the value 0.
struct Observations {
  std::vector<double> value, variance;
};

/// Which of the grid's rows or columns a pixel, or another point of `size` equal ones, belongs to.
constexpr std::size_t superpixel_of(std::size_t place, std::size_t size, std::size_t count) {
  return place * count / size;
}
/// The superpixel of a pixel of an image, of count x count.
constexpr std::size_t superpixel_of(std::size_t pixel, std::size_t rows, std::size_t columns, std::size_t count) {
  return superpixel_of(pixel / columns, rows, count) * count + superpixel_of(pixel % columns, columns, count);
}
/// The first that belongs to it.
constexpr std::size_t first_of(std::size_t superpixel, std::size_t size, std::size_t count) {
  return (superpixel * size + count - 1) / count;
}

/// Signal of a pixel, or of the sum over some.
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

}  // namespace tofgraph::diagnosis
