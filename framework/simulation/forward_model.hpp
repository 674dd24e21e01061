// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Forward model: expected taps of a scene by geometry, phasors, samples and taps, with the effects of a model at their
/// levels. Equations (5.9)-(5.13), (5.61), (5.92) of the reference. The same code computes whole images and, on a
/// coarse grid of pixels, the thousands of evaluations of a search for effects.
#pragma once

#include "io/unknown.hpp"
#include "simulation/files/effect.hpp"
#include "simulation/hit.hpp"

#include <complex>
#include <string>
#include <vector>

namespace tofgraph::simulation {

/// Evaluated pixels: a whole image, or the centres of equal blocks.
struct Pixels {
  std::size_t rows = 0, columns = 0;
  double spacing = 1;         ///< px between neighbours
  std::vector<double> at;     ///< column and row of each, px
  std::vector<Vector3> rays;  ///< from the profile's lens; NaN outside its model
  std::size_t size() const { return rows * columns; }
};
Pixels whole_image(const tofgraph_camera& camera);
/// @param rows, columns of blocks; the image size need not be a multiple
Pixels superpixels(const tofgraph_camera& camera, std::size_t rows, std::size_t columns);

/// Condition with the active sources of the camera (empty: all).
struct Acquisition {
  tofgraph_condition condition{};
  std::vector<bool> on;
  bool moving = false;  ///< the scene differs between the exposures, even without effects
};
/// Acquisition with unknown conditions except the times, and all sources on.
Acquisition acquisition_of(const tofgraph_camera& camera, double integration_time);

/// Expected taps before noise and readout.
struct Expectation {
  std::vector<double> taps;     ///< P x (A, B) x pixels, counts; NaN outside the lens model
  std::vector<double> removed;  ///< P x pixels, counts taken from each tap whose shot noise remains; empty: none
  double noise_factor = 1;      ///< factor of the noise's standard deviation
  std::vector<Hit> hits;        ///< at the pixel centres
};

class ForwardModel {
 public:
  /// @param camera must outlive the model; it needs gain, contrast, modulation frequency and lengths in metres
  /// @param edge_samples number of rays in each direction that are averaged for pixels at edges of the scene
  /// @throws std::invalid_argument naming the values missing in the profile
  ForwardModel(const tofgraph_camera& camera, bool physical, std::vector<EffectPtr> effects,
               std::size_t edge_samples = 4);

  /// @throws EffectError @throws std::invalid_argument for a moving scene if the profile has no frame rate
  Expectation expect(const Tracer& tracer, const Acquisition& acquisition, const Pixels& pixels) const;

  /// True if an effect acts on the noisy taps.
  bool has_readout() const { return first_readout_ < effects_.size(); }
  /// Applies the effects on noisy taps. @param taps P x (A, B) x pixels, counts
  void read_out(const Acquisition& acquisition, const Pixels& pixels, std::span<double> taps) const;

  const tofgraph_camera& camera() const { return camera_; }
  const std::vector<EffectPtr>& effects() const { return effects_; }
  bool physical() const { return physical_; }
  /// P: number of raw images of a frame.
  std::size_t exposures() const { return exposures_; }
  std::size_t edge_samples() const { return edge_samples_; }
  /// Index of the first effect that acts on the noisy taps.
  std::size_t first_readout() const { return first_readout_; }

 private:
  const tofgraph_camera& camera_;
  bool physical_;
  std::size_t exposures_;
  std::vector<EffectPtr> effects_;  ///< by level, within a level in the model's order, late effects last
  std::size_t first_readout_ = 0;   ///< effects from this index act on the noisy taps
  std::size_t edge_samples_;
};

}  // namespace tofgraph::simulation
