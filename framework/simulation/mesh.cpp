// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/mesh.hpp"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tofgraph::simulation {
namespace {

Vector3 point(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

Vector3 cross(Vector3 a, Vector3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

class MeshShape final : public Shape {
 public:
  MeshShape(const Object& object, std::uint32_t index, const Rotation& frame, std::shared_ptr<const Mesh> mesh)
      : Shape(index), mesh_(std::move(mesh)), reflectivity_(object.reflectivity) {
    const MeshObject& own = std::get<MeshObject>(object.form);
    const Pose pose = own.placement.pose();
    position_ = frame * pose.position;
    axes_ = frame * pose.rotation;
    unit_ = own.unit;
  }

  void trace(Vector3 lens, std::span<const Vector3> rays, std::span<Hit> hits) const override {
    const Vector3 from = (1 / unit_) * axes_.inverse(lens - position_);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Mesh::Meeting meeting = mesh_->nearest(from, axes_.inverse(rays[i]));
      const double return_path = meeting.distance * unit_;
      if (!(return_path > 0 && return_path < hits[i].return_path)) continue;
      hits[i] = {return_path, {}, axes_ * meeting.normal, reflectivity_, object()};
    }
  }

 private:
  std::shared_ptr<const Mesh> mesh_;
  Vector3 position_;
  Rotation axes_;
  double unit_, reflectivity_;
};

}  // namespace

/// Embree's objects; the tree is built in one thread, so that the same file always gives the same tree.
struct Mesh::Tree {
  explicit Tree(const Triangles& mesh) : device(rtcNewDevice("threads=1")), scene(nullptr) {
    if (device == nullptr) throw std::runtime_error("Embree cannot start on this processor");
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<std::array<float, 3>*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(std::array<float, 3>), mesh.vertices.size()));
    auto* indices = static_cast<std::array<std::uint32_t, 3>*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                sizeof(std::array<std::uint32_t, 3>), mesh.triangles.size()));
    if (vertices != nullptr && indices != nullptr) {
      std::ranges::copy(mesh.vertices, vertices);
      std::ranges::copy(mesh.triangles, indices);
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(scene, geometry);
      rtcCommitScene(scene);
    }
    rtcReleaseGeometry(geometry);
    const RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_NONE) return;
    release();
    throw std::runtime_error(
        fmt::format("Embree cannot take a mesh of {} triangles: error {}", mesh.triangles.size(), int{error}));
  }
  ~Tree() { release(); }
  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;

  void release() const {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  RTCDevice device;
  RTCScene scene;
};

Mesh::Mesh(Triangles triangles) : triangles_(std::move(triangles)) {
  least_ = most_ = point(triangles_.vertices.at(0));
  for (const auto& vertex : triangles_.vertices) {
    const Vector3 v = point(vertex);
    least_ = {std::min(least_.x, v.x), std::min(least_.y, v.y), std::min(least_.z, v.z)};
    most_ = {std::max(most_.x, v.x), std::max(most_.y, v.y), std::max(most_.z, v.z)};
  }
  tree_ = std::make_unique<Tree>(triangles_);
}

Mesh::~Mesh() = default;

Mesh::Meeting Mesh::nearest(Vector3 from, Vector3 direction) const {
  constexpr Meeting none{endless, {}};
  if (!std::isfinite(direction.x + direction.y + direction.z)) return none;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit found{};
  found.ray.org_x = static_cast<float>(from.x);
  found.ray.org_y = static_cast<float>(from.y);
  found.ray.org_z = static_cast<float>(from.z);
  found.ray.dir_x = static_cast<float>(direction.x);
  found.ray.dir_y = static_cast<float>(direction.y);
  found.ray.dir_z = static_cast<float>(direction.z);
  found.ray.tfar = std::numeric_limits<float>::infinity();
  found.ray.mask = ~0U;
  found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(tree_->scene, &context, &found);
  if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return none;
  const auto& [a, b, c] = triangles_.triangles[found.hit.primID];
  const Vector3 corner = point(triangles_.vertices[a]);
  const Vector3 normal = cross(point(triangles_.vertices[b]) - corner, point(triangles_.vertices[c]) - corner);
  return {dot(normal, corner - from) / dot(normal, direction), (1 / norm(normal)) * normal};
}

std::unique_ptr<const Shape> mesh_shape(const Object& object, std::uint32_t index, const Rotation& frame,
                                        std::shared_ptr<const Mesh> mesh) {
  return std::make_unique<MeshShape>(object, index, frame, std::move(mesh));
}

double far_end(const Mesh& mesh, const MeshObject& object) {
  const Pose pose = object.placement.pose();
  const Vector3 middle = 0.5 * (mesh.least() + mesh.most()), half = 0.5 * (mesh.most() - mesh.least());
  const Rotation& r = pose.rotation;
  const double reach = std::abs(r.x.z) * half.x + std::abs(r.y.z) * half.y + std::abs(r.z.z) * half.z;
  return pose.position.z + object.unit * ((r * middle).z + reach);
}

}  // namespace tofgraph::simulation
