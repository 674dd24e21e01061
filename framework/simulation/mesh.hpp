// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Triangle meshes, intersected by Embree.
#pragma once

#include "simulation/mesh_file.hpp"
#include "simulation/shapes.hpp"

#include <memory>

namespace tofgraph::simulation {

/// Triangles of a file with their search tree; immutable, shared by all worlds.
class Mesh {
 public:
  /// @throws std::runtime_error if Embree rejects them
  explicit Mesh(Triangles triangles);
  ~Mesh();
  Mesh(const Mesh&) = delete;
  Mesh& operator=(const Mesh&) = delete;

  struct Meeting {
    double distance;  ///< along the ray; infinity: none
    Vector3 normal;   ///< unit, of the triangle
  };
  /// Nearest triangle on a ray, in the file's unit and frame. Embree finds the triangle in single precision; the
  /// intersection with its plane is then computed in double.
  /// @param direction unit
  Meeting nearest(Vector3 from, Vector3 direction) const;

  /// Corners of the bounding box of all vertices.
  Vector3 least() const { return least_; }
  Vector3 most() const { return most_; }
  std::size_t dropped() const { return triangles_.dropped; }

 private:
  struct Tree;
  Triangles triangles_;
  Vector3 least_, most_;
  std::unique_ptr<Tree> tree_;
};

/// Mesh placed in a scene.
std::unique_ptr<const Shape> mesh_shape(const Object& object, std::uint32_t index, const Rotation& frame,
                                        std::shared_ptr<const Mesh> mesh);

/// Largest z of the mesh's bounding box in the sensor frame, m.
double far_end(const Mesh& mesh, const MeshObject& object);

}  // namespace tofgraph::simulation
