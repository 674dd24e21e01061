// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Intersection of a pixel's ray: the interface between the tracing of scenes and the computation of light.
#pragma once

#include "simulation/files/board_change.hpp"
#include "simulation/files/surface.hpp"

#include <tofgraph/physics/geometry.hpp>

#include <cstdint>
#include <functional>
#include <limits>
#include <span>

namespace tofgraph::simulation {

using physics::Vector3;

/// Intersection of a ray with the scene; lengths in metres, sensor frame.
struct Hit {
  double return_path =
      std::numeric_limits<double>::infinity();  ///< D_ref, lens centre to point; infinity: no surface hit
  Vector3 point, normal;                        ///< normal: unit, towards the camera
  double reflectivity = 0;
  std::uint32_t object = 0;
  const Surface* surface = nullptr;  ///< null: according to the model's light
};

/// Traces unit rays from the lens centre.
using Tracer = std::function<void(const BoardChange&, std::span<const Vector3> rays, std::span<Hit> hits)>;

}  // namespace tofgraph::simulation
