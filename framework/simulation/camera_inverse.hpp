// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The forward model turned around: from what a camera with its effects measured to what the same camera without them
/// would have measured. No effect needs an inverse of its own.
#pragma once

#include "simulation/forward_model.hpp"

#include <tofgraph/physics/unwrapping.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace tofgraph::simulation {

/// Surfaces seen by pixels, one each, towards the camera. Arrays of the same length.
struct Views {
  std::vector<std::uint32_t> pixel;
  std::vector<double> return_path;   ///< m, surface to lens centre
  std::vector<double> reflectivity;  ///< whatever is needed: it stands for everything that scales a pixel's light
  std::size_t size() const { return pixel.size(); }
};

/// Decoded samples without noise, as long as the views.
struct Measurements {
  std::vector<double> distance;   ///< m, within the camera's range
  std::vector<double> amplitude;  ///< counts
};

/// A measurement to be undone, and where to begin.
struct Measured {
  std::uint32_t pixel;
  double distance;   ///< m, not wrapped: the solution is looked for near `guess`
  double amplitude;  ///< counts
  double guess;      ///< m, the distance without effects
};

/// Solution for a pixel; found is false if no distance gives this measurement.
struct Undone {
  double distance;  ///< m, that of the camera without effects, not wrapped
  bool found;
};

class CameraInverse {
 public:
  /// @param camera with the lens and the sources that are right; must live as long
  /// @param effects without those of the geometry, which are in the camera already
  CameraInverse(const tofgraph_camera& camera, bool physical, const std::vector<EffectPtr>& effects);

  /// With all effects, or without any. Several threads. @throws EffectError
  Measurements measure(const Acquisition& acquisition, const Views& views, bool with_effects = true) const;

  /// By Broyden's method on the pair of distance and logarithm of the amplitude, each pixel on its own. Several
  /// threads. @throws EffectError
  std::vector<Undone> solve(const Acquisition& acquisition, std::span<const Measured> measured) const;

  /// The same of pixels that are neighbours, whatever a tracer gives for their rays; with all effects.
  Measurements measure_image(const Acquisition& acquisition, const Tracer& tracer, const Pixels& pixels) const;

  /// Return path on a ray with this distance by the sources' mean path: m from the lens centre, 0.1 mm at least.
  double return_path_on(Vector3 ray, double distance) const;
  double return_path_at(std::uint32_t pixel, double distance) const {
    return return_path_on(pixels_.rays[pixel], distance);
  }
  Vector3 point_on(Vector3 ray, double return_path) const { return physics::point_on_ray(geometry_, ray, return_path); }
  /// The reflectivity that gives this amplitude, by the formula of the light of the reference.
  double reflectivity_for(double amplitude, double distance, double integration_time) const;

  /// Distances repeat after this, m.
  double range(const Acquisition& acquisition) const;
  /// The pixel with a ray that is nearest to the image's middle. @throws std::invalid_argument when none has one
  std::uint32_t middle() const { return middle_; }
  const Pixels& pixels() const { return pixels_; }
  const tofgraph_camera& camera() const { return real_.camera(); }
  const ForwardModel& model() const { return real_; }

 private:
  Measurements measure(const ForwardModel& model, const Acquisition& acquisition, const Tracer& tracer,
                       const Pixels& pixels) const;
  /// @param taps P x (A, B) x pixels, counts
  Measurements decode(const Acquisition& acquisition, std::span<const double> taps, std::size_t pixels) const;

  ForwardModel real_, ideal_;
  physics::Geometry geometry_;
  Pixels pixels_;
  physics::Exposures exposures_;
  std::uint32_t middle_ = 0;
};

}  // namespace tofgraph::simulation
