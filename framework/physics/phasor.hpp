// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Light that reaches a pixel, as the sum of its sources' phasors.
#pragma once

#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/geometry.hpp>

#include <complex>
#include <limits>

namespace tofgraph::physics {

/// Light of a pixel: the phasor P = amplitude e^(j Psi) of the modulated light, and the resulting mean of a tap, both
/// in counts.
struct Light {
  std::complex<double> phasor;
  double intensity = 0;
};

/// Parameters of the amount of light that do not depend on the path.
struct Exposure {
  double gain = std::numeric_limits<double>::quiet_NaN();                  ///< counts m^2/s, from the profile
  double contrast = std::numeric_limits<double>::quiet_NaN();              ///< demodulation contrast, 0..1
  double integration_time = std::numeric_limits<double>::quiet_NaN();      ///< s
  double modulation_frequency = std::numeric_limits<double>::quiet_NaN();  ///< Hz
};

/// Light of all sources from the ray's point at D_ref on a surface of this reflectivity, in the reference light model:
/// every source contributes its weight's fraction of G rho t_int / D_t^2, D_t = mean path + D_ref + D_sen (5.92),
/// without angle dependence; the phasors are summed, Psi_i = (w/c)(D_i + D_ref + D_sen), equations (5.9)-(5.13).
inline Light reference_light(const Geometry& geometry, Vector3 ray, double return_path, double reflectivity,
                             const Exposure& exposure) {
  const Vector3 point = point_on_ray(geometry, ray, return_path);
  const double common = return_path + sensor_path(geometry, ray);
  const double travelled = mean_source_path(geometry, point) + common;
  const double amplitude = exposure.gain * reflectivity * exposure.integration_time / (travelled * travelled);
  const double radians_per_metre = two_pi * exposure.modulation_frequency / speed_of_light;
  Light light;
  for (const WeightedSource& source : geometry.sources) {
    const double phase = radians_per_metre * (source_path(source, point) + common);
    light.phasor += std::polar(source.weight * amplitude, phase);
  }
  light.intensity = amplitude / (2 * exposure.contrast);
  return light;
}

}  // namespace tofgraph::physics
