// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/files/objects.hpp"

#include "config/quantity.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tofgraph::simulation {
namespace {

std::string metres(double value) { return config::format_quantity(value, "m"); }

template <class Form> constexpr bool has_target = requires(const Form& form) { form.target; };

Problem behind(double end, Vector3 lens, std::string key, std::string hint) {
  return {fmt::format("is behind the camera: it ends at z = {}, and the lens is {} from the sensor plane", metres(end),
                      metres(lens.z)),
          std::move(key), std::move(hint)};
}

Problem around() { return {"contains the camera", "position", "example: position: [0 mm, 0 mm, 2 m]"}; }

Problem problem_of(const Target& target, Vector3 lens) {
  if (!(target.distance > lens.z)) return behind(target.distance, lens, "distance", "example: distance: 500 mm");
  const Pose pose = target.pose();
  if (dot(pose.rotation.z, pose.position - lens) > 0) return {};
  const std::string key = std::abs(target.tilt_x) > std::abs(target.tilt_y) ? "tilt_x" : "tilt_y";
  return {
      fmt::format("turns its edge or its back to the camera: its tilts are {:.4g} deg about x and {:.4g} deg about y",
                  target.tilt_x * 180 / M_PI, target.tilt_y * 180 / M_PI),
      key, fmt::format("example: {}: 30 deg", key)};
}

/// Half the extent of a box along z of the sensor frame.
double half_depth(const Pose& pose, const std::array<double, 3>& size) {
  const Rotation& r = pose.rotation;
  return (std::abs(r.x.z) * size[0] + std::abs(r.y.z) * size[1] + std::abs(r.z.z) * size[2]) / 2;
}

/// For objects with a position.
Problem behind(double end, Vector3 lens) {
  if (end > lens.z) return {};
  return behind(end, lens, "position", "example: position: [0 mm, 0 mm, 500 mm]");
}

Problem problem_of(const Box& box, Vector3 lens) {
  const Pose pose = box.placement.pose();
  const Vector3 own = pose.rotation.inverse(lens - pose.position);
  if (std::abs(own.x) <= box.size[0] / 2 && std::abs(own.y) <= box.size[1] / 2 && std::abs(own.z) <= box.size[2] / 2)
    return around();
  return behind(box.placement.position.z + half_depth(pose, box.size), lens);
}

Problem problem_of(const Sphere& sphere, Vector3 lens) {
  if (norm(sphere.position - lens) <= sphere.radius) return around();
  return behind(sphere.position.z + sphere.radius, lens);
}

Problem problem_of(const Corner& corner, Vector3 lens) { return behind(corner.placement.position.z, lens); }

Problem problem_of(const MeshObject&, Vector3) { return {}; }

}  // namespace

Pose Target::pose() const {
  return {{center_x, center_y, distance}, rotation(turned_x, turned_y, 0) * rotation(tilt_x, tilt_y, 0)};
}

Target Target::changed(const BoardChange& change) const {
  Target result = *this;
  result.distance = change.scale * distance + change.offset + change.displacement;
  result.turned_x += change.tilt_x;
  result.turned_y += change.tilt_y;
  return result;
}

const Target* Object::target() const {
  return std::visit(
      [](const auto& own) -> const Target* {
        if constexpr (has_target<std::decay_t<decltype(own)>>) return &own.target;
        return nullptr;
      },
      form);
}

Problem problem_of(const Object& object, Vector3 lens_centre) {
  Problem problem = std::visit(
      [&](const auto& own) {
        if constexpr (has_target<std::decay_t<decltype(own)>>)
          return problem_of(own.target, lens_centre);
        else
          return problem_of(own, lens_centre);
      },
      object.form);
  if (!problem.text.empty()) problem.text = fmt::format("the {} '{}' {}", object.type, object.name, problem.text);
  return problem;
}

}  // namespace tofgraph::simulation
