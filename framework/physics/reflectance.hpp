// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Reflection by rough surfaces.
#pragma once

#include <tofgraph/physics/geometry.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::physics {

/// Light of an Oren-Nayar surface towards the camera, relative to Lambert: A + B max(0, cos dphi) sin alpha tan beta,
/// with A = 1 - 0.5 s^2 / (s^2 + 0.33), B = 0.45 s^2 / (s^2 + 0.09), alpha the greater and beta the lesser of the
/// angles of incidence and view, dphi between their planes (Oren, Nayar: Generalization of Lambert's reflectance model,
/// SIGGRAPH 1994, the qualitative form).
/// @param roughness s, rad; 0 returns 1
/// @param normal, to_light, to_camera unit vectors; directions behind the surface return 1
inline double oren_nayar(double roughness, Vector3 normal, Vector3 to_light, Vector3 to_camera) {
  const double square = roughness * roughness;
  if (square == 0) return 1;
  const double cos_light = dot(normal, to_light), cos_view = dot(normal, to_camera);
  if (cos_light <= 0 || cos_view <= 0) return 1;
  const Vector3 light = to_light - cos_light * normal, view = to_camera - cos_view * normal;  // in the surface plane
  const double sin_light = norm(light), sin_view = norm(view);
  const double a = 1 - 0.5 * square / (square + 0.33), b = 0.45 * square / (square + 0.09);
  if (sin_light == 0 || sin_view == 0) return a;
  const double together = std::max(0.0, dot(light, view)) / (sin_light * sin_view);
  // sin of the greater angle, tan of the lesser
  const double angles = cos_light < cos_view ? sin_light * sin_view / cos_view : sin_view * sin_light / cos_light;
  return a + b * together * angles;
}

}  // namespace tofgraph::physics
