// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Shapes that are intersected with rays from the lens.
#pragma once

#include "simulation/files/objects.hpp"
#include "simulation/hit.hpp"
#include "simulation/image.hpp"

#include <memory>
#include <span>
#include <vector>

namespace tofgraph::simulation {

/// Surface that is visible from both sides. Immutable.
class Shape {
 public:
  explicit Shape(std::uint32_t object) : object_(object) {}
  virtual ~Shape() = default;
  Shape(const Shape&) = delete;
  Shape& operator=(const Shape&) = delete;

  /// Updates the hits of rays that meet this surface at a shorter distance: return path, normal (of either side),
  /// reflectivity, object.
  /// @param rays unit vectors, as many as hits
  virtual void trace(Vector3 lens, std::span<const Vector3> rays, std::span<Hit> hits) const = 0;

 protected:
  std::uint32_t object() const { return object_; }

 private:
  std::uint32_t object_;
};

using Shapes = std::vector<std::unique_ptr<const Shape>>;

/// Adds the surfaces of an object; for a mesh none.
/// @param frame rotation from the frame of the description to the sensor frame: differs for a rolled camera
/// @param image of a card, or null
void add_shapes(const Object& object, std::uint32_t index, const Rotation& frame,
                const std::shared_ptr<const Image>& image, Shapes& shapes);

}  // namespace tofgraph::simulation
