// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Shapes that rays from the lens intersect.
#pragma once

#include "simulation/files/objects.hpp"
#include "simulation/hit.hpp"
#include "simulation/image.hpp"

#include <memory>
#include <span>
#include <vector>

namespace tofgraph::simulation {

/// A surface, seen from both sides. Immutable.
class Shape {
 public:
  explicit Shape(std::uint32_t object) : object_(object) {}
  virtual ~Shape() = default;
  Shape(const Shape&) = delete;
  Shape& operator=(const Shape&) = delete;

  /// Gives the hits of rays that meet this surface nearer than they did so far: reflected, normal (of either side),
  /// reflectivity, object.
  /// @param rays unit vectors, as many as hits
  virtual void trace(Vector3 lens, std::span<const Vector3> rays, std::span<Hit> hits) const = 0;

 protected:
  std::uint32_t object() const { return object_; }

 private:
  std::uint32_t object_;
};

using Shapes = std::vector<std::unique_ptr<const Shape>>;

/// Adds the surfaces of an object; a mesh has none here.
/// @param frame from the frame in which the object is described to the sensor frame: not the same for a rolled camera
/// @param image of a card, or null
void add_shapes(const Object& object, std::uint32_t index, const Rotation& frame,
                const std::shared_ptr<const Image>& image, Shapes& shapes);

}  // namespace tofgraph::simulation
