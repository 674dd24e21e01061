// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Noisy frames from expected taps, as delivered by a camera.
#pragma once

#include "simulation/forward_model.hpp"
#include "simulation/noise.hpp"

#include <tofgraph/physics/four_phase.hpp>
#include <tofgraph/physics/unwrapping.hpp>

namespace tofgraph::simulation {

/// Seed of the noise, and the number of the condition, which has independent noise.
struct NoiseSeed {
  std::uint64_t seed = 1;
  std::uint32_t condition = 0;
};

/// Frames of one condition. Several frames may be computed concurrently.
class Frames {
 public:
  /// @param model, pixels must outlive this object
  /// @param noise not known(): no noise
  /// @param with_taps taps are output too, and phases and distance are computed from them; otherwise the noise of the
  ///        samples is drawn directly, which is faster and has the same distribution
  Frames(const ForwardModel& model, const Tracer& tracer, const Acquisition& acquisition, const Pixels& pixels,
         const physics::TapNoise& noise, NoiseSeed seed, bool with_taps = false);

  /// P x (A, B) x pixels, integer counts within 0 .. 65535. Pixels outside the lens model are 0.
  void taps(std::uint64_t frame, std::uint16_t* out) const;
  /// P x pixels: A_k - B_k, counts, not rounded. Pixels outside the lens model are NaN.
  void phases(std::uint64_t frame, float* out) const;
  /// Decoded phases, pixels: m, counts.
  void distance(std::uint64_t frame, float* distance, float* amplitude) const;

  bool noisy() const { return noisy_; }
  /// P: number of raw images of a frame.
  std::size_t exposures() const { return exposures_.size(); }
  /// Points seen by the centres of the pixels.
  const std::vector<Hit>& hits() const { return hits_; }

 private:
  /// Taps of one frame after noise and readout.
  std::vector<float> read_out(std::uint64_t frame) const;
  void draw(std::uint64_t frame, const std::vector<float>& mean, const std::vector<float>& deviation, bool second,
            std::size_t plane, float* out) const;
  /// Decodes any exposures, in double, like phase_decoder.
  void decode_any(const std::vector<float>& samples, float* distance, float* amplitude) const;

  const ForwardModel& model_;
  const Pixels& pixels_;
  Acquisition acquisition_;
  NoiseSeed seed_;
  bool noisy_, from_taps_;
  physics::Exposures exposures_;
  std::vector<float> mean_, deviation_;                ///< P x (A, B) x pixels
  std::vector<float> sample_mean_, sample_deviation_;  ///< P x pixels, if not computed from the taps
  std::vector<Hit> hits_;
};

}  // namespace tofgraph::simulation
