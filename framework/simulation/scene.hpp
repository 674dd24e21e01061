// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Scene prepared for ray tracing.
#pragma once

#include "simulation/files/scene_file.hpp"
#include "simulation/mesh.hpp"
#include "simulation/shapes.hpp"

#include <map>
#include <span>

namespace tofgraph::simulation {

/// Files shared by all conditions of a scene, by path; each is read once.
struct Assets {
  std::map<std::filesystem::path, std::shared_ptr<const Mesh>> meshes;
  std::map<std::filesystem::path, std::shared_ptr<const Image>> images;
};

/// Reads the meshes and images of a valid scene. Errors and warnings are reported to the diagnostics.
void load_assets(SceneFile& scene, config::Diagnostics& diagnostics);

/// Objects as the camera sees them in one condition. Immutable; several threads may trace at the same time.
class World {
 public:
  /// @param surfaces one per object, null if the scene states none
  /// @param owner of the surfaces; kept alive
  World(Vector3 lens_centre, Shapes shapes, std::vector<const Surface*> surfaces, std::shared_ptr<const Objects> owner)
      : lens_centre_(lens_centre),
        shapes_(std::move(shapes)),
        surfaces_(std::move(surfaces)),
        owner_(std::move(owner)) {}

  /// First surface on each ray. A ray that is NaN (outside the lens model) hits nothing.
  /// @param rays unit vectors from the lens centre, sensor frame @param hits as many as rays, overwritten
  void trace(std::span<const Vector3> rays, std::span<Hit> hits) const;

  Vector3 lens_centre() const { return lens_centre_; }

 private:
  Vector3 lens_centre_;
  Shapes shapes_;
  std::vector<const Surface*> surfaces_;
  std::shared_ptr<const Objects> owner_;
};

/// World of a condition of this scene, or of a campaign's condition with a board (the scene then only provides the
/// camera).
///
/// The poses in the file refer to a camera without roll; a camera rolled by +roll sees them rotated by -roll about its
/// axis. Tilts and displacements of `change` are applied before that.
/// At change.time objects with a velocity have moved; with the condition's velocity also the boards, chessboards and
/// cards, along z.
/// @throws std::runtime_error if the camera cannot see an object, if there is no board, and if load_assets was not
/// called for a scene that needs it
World make_world(const SceneFile& scene, const SceneCondition& condition, const BoardChange& change = {});

}  // namespace tofgraph::simulation
