// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Inverse of the forward model: from the measurement of a camera with its effects to that of the same camera without
/// effects. Effects need no inverses of their own.
#pragma once

#include "simulation/forward_model.hpp"

#include <tofgraph/physics/unwrapping.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace tofgraph::simulation {

/// Surfaces seen by pixels, one per entry, perpendicular to the optical axis. Arrays of the same length.
struct Views {
  std::vector<std::uint32_t> pixel;
  std::vector<double> return_path;   ///< m, surface to lens centre
  std::vector<double> reflectivity;  ///< unconstrained: it represents every factor of a pixel's light
  std::size_t size() const { return pixel.size(); }
};

/// Decoded noise-free samples, of the same length as the views.
struct Measurements {
  std::vector<double> distance;   ///< m, within the camera's range
  std::vector<double> amplitude;  ///< counts
};

/// Measurement to be corrected, with the starting point.
struct Measured {
  std::uint32_t pixel;
  double distance;   ///< m, unwrapped: the solution is searched near `guess`
  double amplitude;  ///< counts
  double guess;      ///< m, the distance without effects
};

/// Solution for a pixel; found is false if no distance gives this measurement.
struct Undone {
  double distance;  ///< m, measured by the camera without effects, unwrapped
  bool found;
};

class CameraInverse {
 public:
  /// @param camera with the calibrated lens and sources; must outlive this object
  /// @param effects without geometry effects, which are already part of the camera
  CameraInverse(const tofgraph_camera& camera, bool physical, const std::vector<EffectPtr>& effects);

  /// With all effects, or without any. Uses several threads. @throws EffectError
  Measurements measure(const Acquisition& acquisition, const Views& views, bool with_effects = true) const;

  /// Solves by Broyden's method for distance and logarithm of the amplitude, each pixel independently. Uses several
  /// threads. @throws EffectError
  std::vector<Undone> solve(const Acquisition& acquisition, std::span<const Measured> measured) const;

  /// Like measure(), for an image of neighbouring pixels whose rays are intersected by the tracer; with all effects.
  Measurements measure_image(const Acquisition& acquisition, const Tracer& tracer, const Pixels& pixels) const;

  /// Return path on a ray for this mean source path (half path): m from the lens centre, at least 0.1 mm.
  double return_path_on(Vector3 ray, double distance) const;
  double return_path_at(std::uint32_t pixel, double distance) const {
    return return_path_on(pixels_.rays[pixel], distance);
  }
  Vector3 point_on(Vector3 ray, double return_path) const { return physics::point_on_ray(geometry_, ray, return_path); }
  /// Reflectivity that gives this amplitude, by the equation of the reference light.
  double reflectivity_for(double amplitude, double distance, double integration_time) const;

  /// Distance after which distances repeat, m.
  double range(const Acquisition& acquisition) const;
  /// Pixel with a ray nearest to the image centre. @throws std::invalid_argument if no pixel has a ray
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
