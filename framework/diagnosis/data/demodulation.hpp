// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file From the images of a frame to what a search looks at: least squares of the phase, and what they leave.
#pragma once

#include "diagnosis/data/observables.hpp"

#include <tofgraph/physics/exposures.hpp>

#include <span>

namespace tofgraph::diagnosis {

/// Any three steps or more of one frequency, in any order. Of four steps of 90 degrees null1 and null2 are N1 and N2
/// of equations.md. Three steps leave nothing, so they have no null2; more than four leave several numbers, of which
/// null2 is what the first image differs by from its fit, and the others are not used.
class Demodulation {
 public:
  /// @throws std::invalid_argument where they are of several frequencies, or no phase can be told from them
  explicit Demodulation(const physics::Exposures& exposures);

  std::size_t exposures() const { return cosine_.size(); }
  bool has_null2() const { return !rest_.empty(); }

  /// @param samples c_k = A_k - B_k, one an exposure, counts @param intensity mean of the taps, counts
  Signal of_samples(std::span<const double> samples, double intensity) const;
  /// @param taps A_k, B_k (counts), that of image k being at taps[2 k stride]
  Signal of_taps(const double* taps, std::size_t stride) const;

  /// For samples of variance 1.
  struct Variance {
    double along, across;  ///< of the phasor's component in its own direction, and at right angles to it
  };
  Variance variance(std::complex<double> phasor) const;
  double null1_variance() const { return null1_variance_; }
  double null2_variance() const { return 1 / static_cast<double>(exposures()); }

 private:
  std::vector<double> cosine_, sine_, offset_, rest_;  ///< weights of the samples
  double xx_, xy_, yy_, null1_variance_ = 0;
};

/// Steps of 90 degrees.
inline Demodulation four_steps() {
  return Demodulation({physics::four_exposures.begin(), physics::four_exposures.end()});
}

}  // namespace tofgraph::diagnosis
