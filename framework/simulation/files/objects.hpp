// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Description of the objects in a scene; SI, sensor frame.
#pragma once

#include "config/document.hpp"
#include "simulation/files/board_change.hpp"
#include "simulation/files/pose.hpp"
#include "simulation/files/surface.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace tofgraph::simulation {

inline constexpr double endless = std::numeric_limits<double>::infinity();

/// Pose of boards, chessboards and cards: a plane whose centre is (center_x, center_y, distance).
struct Target {
  double distance = 0;                ///< m, sensor plane to centre
  double tilt_x = 0, tilt_y = 0;      ///< rad, R = R_y(tilt_y) R_x(tilt_x)
  double turned_x = 0, turned_y = 0;  ///< rad, rotation by an effect, after the tilt
  double center_x = 0, center_y = 0;  ///< m

  Pose pose() const;
  Target changed(const BoardChange& change) const;
};

struct Board {
  Target target;
  double width = endless, height = endless;  ///< m; endless: fills the image
};

struct Chessboard {
  Target target;
  std::int64_t columns = 0, rows = 0;  ///< inner corners
  double square = 0;                   ///< m
  double margin = 0;                   ///< m of bright border around the squares
  double dark = 0;                     ///< reflectivity of the dark squares, one of which is at the upper left corner

  double width() const { return static_cast<double>(columns + 1) * square + 2 * margin; }
  double height() const { return static_cast<double>(rows + 1) * square + 2 * margin; }
};

struct Card {
  Target target;
  double width = 0, height = 0;  ///< m
  std::filesystem::path image;   ///< image with linear factors of the reflectivity; empty: uniform
  bool bilinear = true;          ///< interpolated between the image's pixels; otherwise nearest neighbour
};

/// Position of any other object.
struct Placement {
  Vector3 position;                              ///< m
  double about_x = 0, about_y = 0, about_z = 0;  ///< rad, see rotation()

  Pose pose() const { return {position, rotation(about_x, about_y, about_z)}; }
};

struct Box {
  Placement placement;            ///< placement of its centre
  std::array<double, 3> size{};   ///< m, along its own axes
  std::array<double, 6> faces{};  ///< reflectivity of left (-x), right, top (-y), bottom, front (-z), back
};

struct Sphere {
  Vector3 position;
  double radius = 0;  ///< m
};

/// Two or three perpendicular planes that meet in a line or point, open towards the camera: the left and the right wall
/// extend from the edge x = z = 0 towards (-+1, 0, -1), the floor y = 0 is between them.
struct Corner {
  Placement placement;            ///< intersection point; without a floor: centre of the edge
  std::int64_t planes = 2;        ///< 3: with the floor
  double size = endless;          ///< m, length of the edges
  std::array<double, 3> faces{};  ///< reflectivity of left, right, floor
};

struct MeshObject {
  Placement placement;
  std::filesystem::path file;  ///< PLY or OBJ
  double unit = 1;             ///< m per unit of the file
};

struct Object {
  std::string name;
  std::string type;  ///< as in the file
  config::Position at;
  config::Position file_at;  ///< position of the image or mesh
  double reflectivity = 0.85;
  Surface surface;
  Vector3 velocity;  ///< m/s
  std::variant<Board, Chessboard, Card, Box, Sphere, Corner, MeshObject> form;

  /// Pose changed by BoardChange; null if it does not apply to the object.
  const Target* target() const;
};

struct Objects {
  std::vector<Object> all;
};

const std::vector<std::string>& object_types();

/// Reads one object with all its keys. Errors are reported to the diagnostics; geometry is not checked.
Object read_object(const config::Value& map, config::Diagnostics& diagnostics);

/// Reason why the camera cannot see an object.
struct Problem {
  std::string text;  ///< empty: it can
  std::string key;   ///< key of the object with the wrong value
  std::string hint = {};
};

/// Detects objects that are behind the lens, enclose it, or are seen from behind. Meshes are not checked here.
Problem problem_of(const Object& object, Vector3 lens_centre);

}  // namespace tofgraph::simulation
