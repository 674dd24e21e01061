// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/scene.hpp"

#include "simulation/image.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace tofgraph::simulation {
namespace {

/// Reads a file unless it was read before; errors of a file are reported once.
template <class Content, class Load>
void load_once(const std::filesystem::path& file, const config::Position& at,
               std::map<std::filesystem::path, std::shared_ptr<const Content>>& known, config::Diagnostics& diagnostics,
               Load&& load) {
  const auto [entry, fresh] = known.try_emplace(file);
  if (!fresh) return;
  try {
    entry->second = load();
  } catch (const std::runtime_error& problem) {
    diagnostics.error(at, problem.what());
  }
}

std::shared_ptr<const Mesh> load_mesh(const Object& object, const std::filesystem::path& file,
                                      config::Diagnostics& diagnostics) {
  auto mesh = std::make_shared<const Mesh>(load_triangles(file));
  if (mesh->dropped() > 0)
    diagnostics.warning(object.file_at,
                        fmt::format("{} degenerate triangles of {} are omitted", mesh->dropped(), file.string()));
  return mesh;
}

void load(const Object& object, Assets& assets, config::Diagnostics& diagnostics) {
  if (const auto* mesh = std::get_if<MeshObject>(&object.form))
    load_once(mesh->file, object.file_at, assets.meshes, diagnostics,
              [&] { return load_mesh(object, mesh->file, diagnostics); });
  if (const auto* card = std::get_if<Card>(&object.form); card != nullptr && !card->image.empty())
    load_once(card->image, object.file_at, assets.images, diagnostics,
              [&] { return std::make_shared<const Image>(Image::load(card->image)); });
}

/// Board of a campaign's condition.
Objects board_of(const Condition& condition) {
  if (!condition.has_board()) {
    throw std::runtime_error(fmt::format("the condition '{}' has neither a board nor a scene", condition.id));
  }
  const auto or_zero = [](double value) { return std::isnan(value) ? 0 : value; };
  Board board{{condition.board_distance, or_zero(condition.board_tilt_x), or_zero(condition.board_tilt_y)}};
  if (condition.board_size) {
    board.width = condition.board_size->at(0);
    board.height = condition.board_size->at(1);
  }
  Object object{.name = "board", .type = "board", .form = board};
  if (!std::isnan(condition.reflectivity)) object.reflectivity = condition.reflectivity;
  return {{object}};
}

/// Object at change.time, after the changes by geometry effects.
Object moved(Object object, const BoardChange& change) {
  const Vector3 way = change.time * object.velocity;
  std::visit(
      [&](auto& form) {
        if constexpr (requires { form.target; }) {
          form.target = form.target.changed(change);
          form.target.center_x += way.x;
          form.target.center_y += way.y;
          form.target.distance += way.z;
        } else if constexpr (requires { form.placement; }) {
          form.placement.position = form.placement.position + way;
        } else {
          form.position = form.position + way;
        }
      },
      object.form);
  return object;
}

template <class Content>
std::shared_ptr<const Content> asset(const std::map<std::filesystem::path, std::shared_ptr<const Content>>* known,
                                     const std::filesystem::path& file) {
  if (known != nullptr) {
    if (const auto found = known->find(file); found != known->end() && found->second) return found->second;
  }
  throw std::runtime_error(fmt::format("{} was not loaded", file.string()));
}

void add_object(const Object& object, std::uint32_t index, Vector3 lens, const Rotation& frame, const Assets* assets,
                Shapes& shapes) {
  const Problem problem = problem_of(object, lens);
  if (!problem.text.empty()) throw std::runtime_error(problem.text);
  if (const auto* own = std::get_if<MeshObject>(&object.form)) {
    const auto mesh = asset(assets != nullptr ? &assets->meshes : nullptr, own->file);
    if (far_end(*mesh, *own) <= lens.z)
      throw std::runtime_error(fmt::format("the mesh '{}' is behind the camera", object.name));
    shapes.push_back(mesh_shape(object, index, frame, mesh));
    return;
  }
  std::shared_ptr<const Image> image;
  if (const auto* card = std::get_if<Card>(&object.form); card != nullptr && !card->image.empty())
    image = asset(assets != nullptr ? &assets->images : nullptr, card->image);
  add_shapes(object, index, frame, image, shapes);
}

}  // namespace

void load_assets(SceneFile& scene, config::Diagnostics& diagnostics) {
  auto assets = std::make_shared<Assets>();
  for (const SceneCondition& condition : expand(scene)) {
    for (const Object& object : condition.objects->all) load(object, *assets, diagnostics);
  }
  scene.assets = std::move(assets);
}

void World::trace(std::span<const Vector3> rays, std::span<Hit> hits) const {
  if (rays.size() != hits.size()) throw std::invalid_argument("World::trace needs as many hits as rays");
  std::ranges::fill(hits, Hit{});
  for (const auto& shape : shapes_) shape->trace(lens_centre_, rays, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    Hit& hit = hits[i];
    if (!std::isfinite(hit.return_path)) continue;
    hit.point = lens_centre_ + hit.return_path * rays[i];
    if (dot(hit.normal, rays[i]) > 0) hit.normal = -1 * hit.normal;
    hit.surface = surfaces_[hit.object];
  }
}

World make_world(const SceneFile& scene, const SceneCondition& condition, const BoardChange& change) {
  const Vector3 lens{0, 0, scene.camera->view().focal_length};
  const Objects own = condition.objects ? Objects{} : board_of(condition);
  const Objects& objects = condition.objects ? *condition.objects : own;
  BoardChange total = change;
  if (!std::isnan(condition.velocity)) total.displacement += condition.velocity * change.time;
  const Rotation frame = rotation(0, 0, -condition.roll);
  Shapes shapes;
  std::vector<const Surface*> surfaces;
  for (const Object& object : objects.all) {
    const auto index = static_cast<std::uint32_t>(surfaces.size());
    add_object(moved(object, total), index, lens, frame, scene.assets.get(), shapes);
    surfaces.push_back(object.surface.given ? &object.surface : nullptr);
  }
  return {lens, std::move(shapes), std::move(surfaces), condition.objects};
}

}  // namespace tofgraph::simulation
