// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/shapes.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::simulation {
namespace {

/// Part of a plane: anchor + a x + b y with a and b within bounds, m.
struct Patch {
  Vector3 anchor;
  Rotation axes;  ///< x and y span the patch, z is its normal
  double min_a = -endless, max_a = endless, min_b = -endless, max_b = endless;
};

Patch patch_of(const Target& target, const Rotation& frame, double width, double height) {
  const Pose pose = target.pose();
  return {frame * pose.position, frame * pose.rotation, -width / 2, width / 2, -height / 2, height / 2};
}

struct Uniform {
  double reflectivity;
  double operator()(double, double) const { return reflectivity; }
};

/// Squares of a chessboard; a, b from its centre.
struct Checks {
  explicit Checks(const Chessboard& board, double reflectivity)
      : columns(static_cast<double>(board.columns + 1)),
        rows(static_cast<double>(board.rows + 1)),
        square(board.square),
        bright(reflectivity),
        dark(board.dark) {}
  double columns, rows, square, bright, dark;

  double operator()(double a, double b) const {
    const double column = std::floor(a / square + columns / 2), row = std::floor(b / square + rows / 2);
    const bool on_squares = column >= 0 && column < columns && row >= 0 && row < rows;
    return on_squares && std::fmod(column + row, 2) == 0 ? dark : bright;
  }
};

struct Picture {
  std::shared_ptr<const Image> image;
  double width, height, reflectivity;
  bool bilinear;

  double operator()(double a, double b) const {
    const double across = a / width + 0.5, down = b / height + 0.5;
    return reflectivity * (bilinear ? image->between(across, down) : image->nearest(across, down));
  }
};

template <class Texture> class Flat final : public Shape {
 public:
  Flat(std::uint32_t object, const Patch& patch, Texture texture)
      : Shape(object), patch_(patch), texture_(std::move(texture)) {}

  void trace(Vector3 lens, std::span<const Vector3> rays, std::span<Hit> hits) const override {
    const Vector3 normal = patch_.axes.z, to_anchor = patch_.anchor - lens;
    const double height = dot(normal, to_anchor);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const double return_path = height / dot(normal, rays[i]);
      if (!(return_path > 0 && return_path < hits[i].return_path)) continue;
      const Vector3 from_anchor = return_path * rays[i] - to_anchor;
      const double a = dot(patch_.axes.x, from_anchor), b = dot(patch_.axes.y, from_anchor);
      if (a < patch_.min_a || a > patch_.max_a || b < patch_.min_b || b > patch_.max_b) continue;
      hits[i] = {return_path, {}, normal, texture_(a, b), object()};
    }
  }

 private:
  Patch patch_;
  Texture texture_;
};

template <class Texture> std::unique_ptr<const Shape> flat(std::uint32_t object, const Patch& patch, Texture texture) {
  return std::make_unique<Flat<Texture>>(object, patch, std::move(texture));
}

class BoxShape final : public Shape {
 public:
  BoxShape(std::uint32_t object, const Box& box, const Rotation& frame) : Shape(object), faces_(box.faces) {
    const Pose pose = box.placement.pose();
    centre_ = frame * pose.position;
    axes_ = frame * pose.rotation;
    for (std::size_t k = 0; k < 3; ++k) half_[k] = box.size[k] / 2;
  }

  /// Slab method: the ray is inside where it is between all three pairs of faces; it enters through the last.
  void trace(Vector3 lens, std::span<const Vector3> rays, std::span<Hit> hits) const override {
    const Vector3 from = axes_.inverse(lens - centre_);
    const double start[] = {from.x, from.y, from.z};
    const Vector3 normals[] = {axes_.x, axes_.y, axes_.z};
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Vector3 own = axes_.inverse(rays[i]);
      const double direction[] = {own.x, own.y, own.z};
      double enter = 0, leave = hits[i].return_path;
      std::size_t axis = 3;
      for (std::size_t k = 0; k < 3 && enter < leave; ++k) {
        const double near = (-std::copysign(half_[k], direction[k]) - start[k]) / direction[k];
        const double far = (std::copysign(half_[k], direction[k]) - start[k]) / direction[k];
        // A ray parallel to the faces gives NaN or infinities, which compare correctly unless it starts outside.
        if (direction[k] == 0 && std::abs(start[k]) > half_[k]) leave = 0;
        if (near > enter) {
          enter = near;
          axis = k;
        }
        leave = far < leave ? far : leave;
      }
      if (axis == 3 || !(enter < leave)) continue;
      const std::size_t face = 2 * axis + (direction[axis] > 0 ? 0 : 1);
      hits[i] = {enter, {}, normals[axis], faces_[face], object()};
    }
  }

 private:
  Vector3 centre_;
  Rotation axes_;
  std::array<double, 3> half_{};
  std::array<double, 6> faces_;
};

class SphereShape final : public Shape {
 public:
  SphereShape(std::uint32_t object, const Sphere& sphere, double reflectivity, const Rotation& frame)
      : Shape(object), centre_(frame * sphere.position), radius_(sphere.radius), reflectivity_(reflectivity) {}

  void trace(Vector3 lens, std::span<const Vector3> rays, std::span<Hit> hits) const override {
    const Vector3 to_centre = centre_ - lens;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      // From the point of the ray nearest to the centre, which avoids cancellation of large squares.
      const double along = dot(rays[i], to_centre);
      const Vector3 aside = along * rays[i] - to_centre;
      const double return_path = along - std::sqrt(radius_ * radius_ - dot(aside, aside));
      if (!(return_path > 0 && return_path < hits[i].return_path)) continue;
      const Vector3 normal = (1 / radius_) * (return_path * rays[i] - to_centre);
      hits[i] = {return_path, {}, normal, reflectivity_, object()};
    }
  }

 private:
  Vector3 centre_;
  double radius_, reflectivity_;
};

void add(const Board& board, const Object& object, std::uint32_t index, const Rotation& frame,
         const std::shared_ptr<const Image>&, Shapes& shapes) {
  shapes.push_back(flat(index, patch_of(board.target, frame, board.width, board.height), Uniform{object.reflectivity}));
}

void add(const Chessboard& board, const Object& object, std::uint32_t index, const Rotation& frame,
         const std::shared_ptr<const Image>&, Shapes& shapes) {
  const Patch patch = patch_of(board.target, frame, board.width(), board.height());
  shapes.push_back(flat(index, patch, Checks(board, object.reflectivity)));
}

void add(const Card& card, const Object& object, std::uint32_t index, const Rotation& frame,
         const std::shared_ptr<const Image>& image, Shapes& shapes) {
  const Patch patch = patch_of(card.target, frame, card.width, card.height);
  if (image)
    shapes.push_back(flat(index, patch, Picture{image, card.width, card.height, object.reflectivity, card.bilinear}));
  else
    shapes.push_back(flat(index, patch, Uniform{object.reflectivity}));
}

void add(const Box& box, const Object&, std::uint32_t index, const Rotation& frame, const std::shared_ptr<const Image>&,
         Shapes& shapes) {
  shapes.push_back(std::make_unique<BoxShape>(index, box, frame));
}

void add(const Sphere& sphere, const Object& object, std::uint32_t index, const Rotation& frame,
         const std::shared_ptr<const Image>&, Shapes& shapes) {
  shapes.push_back(std::make_unique<SphereShape>(index, sphere, object.reflectivity, frame));
}

void add(const Corner& corner, const Object&, std::uint32_t index, const Rotation& frame,
         const std::shared_ptr<const Image>&, Shapes& shapes) {
  const Pose own = corner.placement.pose();
  const Vector3 anchor = frame * own.position;
  const Rotation axes = frame * own.rotation;
  // From the edge the walls extend to the left and right and towards the camera; up is -y.
  const double diagonal = std::sqrt(0.5), size = corner.size;
  const Vector3 left = axes * Vector3{-diagonal, 0, -diagonal}, right = axes * Vector3{diagonal, 0, -diagonal};
  const bool floor = corner.planes == 3;
  const double top = floor ? -size : -size / 2, bottom = floor ? 0 : size / 2;
  shapes.push_back(flat(index, {anchor, {left, axes.y, right}, 0, size, top, bottom}, Uniform{corner.faces[0]}));
  shapes.push_back(flat(index, {anchor, {right, axes.y, left}, 0, size, top, bottom}, Uniform{corner.faces[1]}));
  if (floor) shapes.push_back(flat(index, {anchor, {left, right, axes.y}, 0, size, 0, size}, Uniform{corner.faces[2]}));
}

/// Shapes of meshes are created where their triangles are known.
void add(const MeshObject&, const Object&, std::uint32_t, const Rotation&, const std::shared_ptr<const Image>&,
         Shapes&) {}

}  // namespace

void add_shapes(const Object& object, std::uint32_t index, const Rotation& frame,
                const std::shared_ptr<const Image>& image, Shapes& shapes) {
  std::visit([&](const auto& form) { add(form, object, index, frame, image, shapes); }, object.form);
}

}  // namespace tofgraph::simulation
