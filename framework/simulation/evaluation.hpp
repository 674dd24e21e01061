// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The evaluation of one shot. For forward_model.cpp and evaluation*.cpp only.
#pragma once

#include "simulation/forward_model.hpp"
#include "simulation/points.hpp"

#include <tofgraph/physics/lens.hpp>

#include <map>

namespace tofgraph::simulation {

/// The border's state is the base, so that a call from an effect finds its way back.
class Evaluation : public tofgraph_light_state {
 public:
  /// @param modulation Hz, that of the light; the exposures' own where it is not told
  Evaluation(const ForwardModel& model, const Tracer& tracer, const Acquisition& acquisition, const Pixels& pixels,
             const BoardChange& moved, double modulation = 0);

  /// Geometry and phasor level: light_ and strength_ of each pixel.
  void illuminate();

  /// Samples and taps, up to the noise.
  Expectation integrate();

  /// Only what effects on the taps need.
  void use_taps(std::span<double> values);

 private:
  void apply_level(std::uint32_t level);
  void place_sources();
  Vector3 ray_at(const physics::Lens& lens, double u, double v) const;
  void trace_rays(const std::vector<Vector3>& rays, std::vector<Hit>& hits) const;
  void trace();
  void add_edges(const physics::Lens& lens);

  /// Every source's light at every point: formats of `light: reference` and `light: physical`.
  void emit();
  void emit_at(std::size_t i, double all);
  Vector3 to_source(std::size_t s, std::size_t i) const;
  /// cos(theta_i); 0 from behind.
  double incidence(std::size_t s, std::size_t i) const;

  /// A surface that is not Lambert's: its factor, and its gloss, which does not depend on the reflectivity.
  double finish_of(std::size_t s, std::size_t i, double strength) const;

  /// Each pixel on an edge becomes the mean of its rays; from then on the points are the pixels.
  void merge_edges();

  /// All light together: what late effects look at.
  void sum();

  /// Exposure k sees the scene as changes_[k] says: what effects made of its light before stays, in proportion.
  void shine_again(std::size_t k);
  /// The light of another frequency.
  void shine_at(double other_frequency);
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

  /// The light as it is before the exposures' own effects.
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
