// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Phase offsets of single pixels, over all conditions.
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

namespace tofgraph::diagnosis {

/// By how much the phase of each pixel differs from its superpixel's in all conditions alike. A pattern that is much
/// larger than the noise would leave traces in what is summed over a superpixel: which pixels fit their neighbours, and
/// what weight each has, is not the same in every condition, and a sum of phasors that do not agree loses amplitude.
class PixelPhases {
 public:
  PixelPhases() = default;
  explicit PixelPhases(std::size_t pixels) : sum_(pixels), information_(pixels, 0), seen_(pixels, 0) {}

  /// @param seen phasor of a pixel @param expected of its superpixel, there @param variance of a component of the first
  void add(std::size_t pixel, std::complex<double> seen, std::complex<double> expected, double variance);
  PixelPhases& operator+=(const PixelPhases& other);
  /// True if they differ by far more than the noise of one condition.
  bool stand_out() const;
  /// A phasor without what its pixel has of its own.
  std::complex<double> aligned(std::size_t pixel, std::complex<double> phasor) const;

 private:
  std::vector<std::complex<double>> sum_;
  std::vector<double> information_;  ///< of the phase, 1 / rad^2
  std::vector<std::uint32_t> seen_;  ///< conditions
};

}  // namespace tofgraph::diagnosis
