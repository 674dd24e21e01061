// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Evaluation of one acquisition. For forward_model.cpp and evaluation*.cpp only.
#pragma once

#include "simulation/forward_model.hpp"
#include "simulation/points.hpp"

#include <tofgraph/physics/lens.hpp>

#include <map>

namespace tofgraph::simulation {

/// Derived from the state of the plugin interface, so that callbacks from an effect can be cast back.
class Evaluation : public tofgraph_light_state {
 public:
  /// @param modulation frequency of the light, Hz; 0: the exposures' frequency
  Evaluation(const ForwardModel& model, const Tracer& tracer, const Acquisition& acquisition, const Pixels& pixels,
             const BoardChange& moved, double modulation = 0);

  /// Geometry and phasor level: light_ and strength_ of each pixel.
  void illuminate();

  /// Samples and taps, without the noise.
  Expectation integrate();

  /// Prepares only the state needed by effects on the taps.
  void use_taps(std::span<double> values);

 private:
  void apply_level(std::uint32_t level);
  void place_sources();
  Vector3 ray_at(const physics::Lens& lens, double u, double v) const;
  void trace_rays(const std::vector<Vector3>& rays, std::vector<Hit>& hits) const;
  void trace();
  void add_edges(const physics::Lens& lens);

  /// Light of every source at every point: equations of `light: reference` and `light: physical`.
  void emit();
  void emit_at(std::size_t i, double all);
  Vector3 to_source(std::size_t s, std::size_t i) const;
  /// cos(theta_i); 0 for light from behind.
  double incidence(std::size_t s, std::size_t i) const;

  /// Factor of a non-Lambertian surface, and its specular part, which does not depend on the reflectivity.
  double finish_of(std::size_t s, std::size_t i, double strength) const;

  /// Path from the source through point i to the pixel, m.
  double whole_path(const SourceArrays& source, std::size_t i) const {
    return source.path[i] + points_.return_path[i] + points_.sensor_path[i];
  }

  /// Replaces each edge pixel by the mean of its rays; from then on the points are the pixels.
  void merge_edges();

  /// Total light, the input of late effects.
  void sum();

  /// Recomputes the light for exposure k with changes_[k]; the relative changes by earlier effects are kept.
  void reilluminate(std::size_t k);
  /// Computes the light for another frequency.
  void illuminate_at(double other_frequency);
  int move_exposure(std::uint32_t k, double displacement) noexcept;
  void expose(Expectation& result);

  const ForwardModel& model_;
  const Tracer& tracer_;
  const Acquisition& acquisition_;
  const Pixels& pixels_;
  const BoardChange moved_;
  std::vector<tofgraph_source_light> borders_;
  std::vector<SourceArrays> arrays_;
  Points points_;
  std::vector<Hit> hits_;
  std::vector<std::size_t> edges_;
  std::vector<double> turns_, strength_, distances_, intensities_, extras_;
  Doubles amplitudes_;
  std::vector<tofgraph_exposure> steps_;
  std::vector<Complex> light_, exposures_;

  /// Light before the effects of single exposures.
  struct Illumination {
    std::vector<Complex> light;
    std::vector<double> strength;
  };
  std::map<double, Illumination> by_frequency_;  ///< Hz
  std::vector<double> frequencies_;              ///< per exposure, Hz
  std::vector<Illumination> clean_;              ///< per recomputed exposure
  std::vector<BoardChange> changes_;             ///< per exposure
};

}  // namespace tofgraph::simulation
