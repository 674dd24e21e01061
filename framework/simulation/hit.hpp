// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file What a pixel sees: the meeting of scenes, which are traced, and light, which is computed.
#pragma once

#include "simulation/surface.hpp"

#include <tofgraph/physics/geometry.hpp>

#include <cstdint>
#include <functional>
#include <limits>
#include <span>

namespace tofgraph::simulation {

using physics::Vector3;

/// Where a ray meets the scene; lengths in metres, sensor frame.
struct Hit {
  double reflected = std::numeric_limits<double>::infinity();  ///< D_ref, lens centre to point; infinity: nothing there
  Vector3 point, normal;                                       ///< normal: unit, towards the camera's side
  double reflectivity = 0;
  std::uint32_t object = 0;
  const Surface* surface = nullptr;  ///< null: as the model's light has it
};

/// What effects and motion do to the boards of a scene (boards, chessboards, cards): z becomes scale z + offset, the
/// board turns by R_y(tilt_y) R_x(tilt_x), then it moves along z.
struct BoardChange {
  double scale = 1, offset = 0;   ///< m
  double tilt_x = 0, tilt_y = 0;  ///< rad
  double displacement = 0;        ///< m, away positive
  double time = 0;                ///< s since the begin of the first exposure, for what moves by itself

  bool operator==(const BoardChange&) const = default;
};

/// Traces unit rays from the lens centre.
using Tracer = std::function<void(const BoardChange&, std::span<const Vector3> rays, std::span<Hit> hits)>;

}  // namespace tofgraph::simulation
