// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/plain_geometry.hpp"

#include <cmath>

namespace tofgraph::hidden {

Vector about_x(double angle, Vector v) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {v.x, c * v.y - s * v.z, s * v.y + c * v.z};
}

Vector about_y(double angle, Vector v) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * v.x + s * v.z, v.y, -s * v.x + c * v.z};
}

Vector about_z(double angle, Vector v) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * v.x - s * v.y, s * v.x + c * v.y, v.z};
}

Plane board_of(const Physics& physics, const View& view, double displacement) {
  const Effects& effects = physics.effects;
  double z = view.distance;
  if (!view.laser) z = z * (1 + effects.value("rail_scale", "scale")) + effects.value("rail_offset", "offset");
  const auto turned = [&](Vector v) {
    const Vector stated = about_y(view.tilt_y, about_x(view.tilt_x, v));
    const Vector tilted = about_y(effects.value("board_tilt", "y"), about_x(effects.value("board_tilt", "x"), stated));
    return about_z(-view.roll, tilted);  // the camera rotates by roll, so the world rotates back in its frame
  };
  return {{0, 0, z + displacement}, turned({0, 0, 1}), turned({1, 0, 0}), turned({0, 1, 0})};
}

std::vector<Ray> rays_of(const Physics& physics) {
  const Camera& camera = physics.camera;
  const auto lens = [&](const char* name) { return physics.effects.value("lens_distortion", name); };
  const double k1 = lens("k1"), k2 = lens("k2"), k3 = lens("k3"), p1 = lens("p1"), p2 = lens("p2");
  const double center_x = camera.center_x + physics.effects.value("principal_point", "x");
  const double center_y = camera.center_y + physics.effects.value("principal_point", "y");
  std::vector<Ray> rays;
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      // Observed direction of the point; the lens model maps the undistorted (x, y) to it: inverted iteratively.
      const double seen_x = (column - center_x) * camera.pitch / camera.focal_length;
      const double seen_y = (row - center_y) * camera.pitch / camera.focal_length;
      double x = seen_x, y = seen_y, step = 1;
      for (int i = 0; i < 200 && step > 1e-15; ++i) {
        const double r2 = x * x + y * y, radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
        const double next_x = (seen_x - 2 * p1 * x * y - p2 * (r2 + 2 * x * x)) / radial;
        const double next_y = (seen_y - p1 * (r2 + 2 * y * y) - 2 * p2 * x * y) / radial;
        step = std::hypot(next_x - x, next_y - y);
        x = next_x;
        y = next_y;
      }
      const double norm = std::sqrt(x * x + y * y + 1);
      rays.push_back({{x / norm, y / norm, 1 / norm}, camera.focal_length * norm, 1 / norm});
    }
  return rays;
}

std::array<Vector, 2> source_positions(const Physics& physics) {
  const auto moved = [&](const char* name) { return physics.effects.value("source_position", name); };
  const double x = physics.camera.source_x + moved("separation"), shift = moved("shift"), z = moved("depth");
  return {Vector{shift - x, 0, z}, Vector{shift + x, 0, z}};
}

Vector mirrored_by_rail(const Physics& physics, const View& view, Vector source) {
  Vector world = about_z(view.roll, source);
  world.y = 2 * physics.effects.value("rail_reflection", "height") - world.y;
  return about_z(-view.roll, world);
}

}  // namespace tofgraph::hidden
