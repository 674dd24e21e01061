// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Keys of each type of object; they are documented in docs/formats/scene.md.
#include "simulation/files/objects.hpp"

#include "config/paths.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

namespace tofgraph::simulation {
namespace {

using config::Diagnostics;
using config::Reader;
using config::Value;

constexpr double min_length = 1e-6, max_length = 1e4;  // m; below optical resolution, beyond visibility

/// Reader of one object with the units of scenes.
struct Keys {
  Reader& reader;
  const Value& map;
  Diagnostics& diagnostics;

  double length(std::string_view key, std::string_view example, std::optional<double> default_value) {
    return reader.number_within(key, "m", example, default_value, min_length, max_length);
  }
  double share(std::string_view key, std::string_view example, double default_value) {
    return reader.number_within(key, "", example, default_value, 0, 1);
  }
  Vector3 vector(std::string_view key, std::string_view unit, std::string_view example) {
    const std::vector<double> v = reader.numbers(key, unit, example, {0, 0, 0});
    return {v[0], v[1], v[2]};
  }
  /// List of N positive lengths.
  template <std::size_t N> std::array<double, N> size(std::string_view example) {
    const std::size_t errors = diagnostics.errors();
    std::array<double, N> result{};
    if (const config::Entry* entry = reader.need("size", example)) {
      const std::vector<double> values = reader.numbers("size", "m", example, std::vector<double>(N, 1.0));
      std::ranges::copy(values, result.begin());
      if (diagnostics.errors() == errors && std::ranges::any_of(result, [](double v) { return !(v >= min_length); }))
        diagnostics.error(entry->value.at, "'size' must be positive lengths",
                          fmt::format("example: size: {}", example));
    }
    return result;
  }
};

/// {left: 0.3, ...}: reflectivities of faces; unnamed faces have the reflectivity of the object.
template <std::size_t N>
std::array<double, N> read_faces(Keys& keys, const std::array<std::string_view, N>& names, double reflectivity) {
  std::array<double, N> faces;
  faces.fill(reflectivity);
  if (const config::Entry* entry = keys.reader.take("faces")) {
    Reader reader(entry->value, keys.diagnostics, "'faces'");
    for (std::size_t i = 0; i < N; ++i) faces[i] = reader.number_within(names[i], "", "0.5", reflectivity, 0, 1);
    reader.finish();
  }
  return faces;
}

Target read_target(Keys& keys) {
  Target target;
  target.distance = keys.reader.number("distance", "m", "500 mm", std::nullopt);
  target.tilt_x = keys.reader.number("tilt_x", "rad", "10 deg", 0.0);
  target.tilt_y = keys.reader.number("tilt_y", "rad", "10 deg", 0.0);
  return target;
}

/// Reads a target that may be off the axis.
Target read_movable_target(Keys& keys) {
  Target target = read_target(keys);
  const std::vector<double> center = keys.reader.numbers("center", "m", "[100 mm, 0 mm]", {0, 0});
  target.center_x = center[0];
  target.center_y = center[1];
  return target;
}

Placement read_placement(Keys& keys) {
  Placement placement;
  constexpr std::string_view example = "[0 mm, 0 mm, 500 mm]";
  keys.reader.need("position", example);
  placement.position = keys.vector("position", "m", example);
  const Vector3 angles = keys.vector("rotation", "rad", "[0 deg, 30 deg, 0 deg]");
  placement.about_x = angles.x;
  placement.about_y = angles.y;
  placement.about_z = angles.z;
  return placement;
}

Board read_board(Keys& keys) {
  Board board{read_target(keys)};
  if (keys.map.find("size") != nullptr) {
    const auto size = keys.size<2>("[841 mm, 594 mm]");
    board.width = size[0];
    board.height = size[1];
  } else {
    keys.reader.take("size");
  }
  return board;
}

Chessboard read_chessboard(Keys& keys) {
  Chessboard board{read_movable_target(keys)};
  board.columns = keys.reader.whole_number("columns", "8", std::nullopt, 1, 1000);
  board.rows = keys.reader.whole_number("rows", "6", std::nullopt, 1, 1000);
  board.square = keys.length("square", "30 mm", std::nullopt);
  board.margin = keys.reader.number_within("margin", "m", "30 mm", board.square, 0, max_length);
  board.dark = keys.share("dark", "0.05", 0.05);
  return board;
}

Card read_card(Keys& keys, config::Position& file_at) {
  Card card{read_movable_target(keys)};
  const auto size = keys.size<2>("[200 mm, 150 mm]");
  card.width = size[0];
  card.height = size[1];
  if (const config::Entry* image = keys.map.find("image")) {
    card.image = keys.reader.input_file("image", "grey_wedge.png");
    file_at = image->value.at;
  } else {
    keys.reader.take("image");
  }
  static const std::vector<std::string> ways = {"bilinear", "nearest"};
  card.bilinear = keys.reader.choice("interpolation", ways) == "bilinear";
  return card;
}

Box read_box(Keys& keys, double reflectivity) {
  Box box{read_placement(keys)};
  box.size = keys.size<3>("[150 mm, 150 mm, 250 mm]");
  box.faces = read_faces<6>(keys, {"left", "right", "top", "bottom", "front", "back"}, reflectivity);
  return box;
}

Sphere read_sphere(Keys& keys) {
  constexpr std::string_view example = "[0 mm, 0 mm, 500 mm]";
  keys.reader.need("position", example);
  return {keys.vector("position", "m", example), keys.length("radius", "100 mm", std::nullopt)};
}

Corner read_corner(Keys& keys, double reflectivity) {
  Corner corner{read_placement(keys)};
  corner.planes = keys.reader.whole_number("planes", "3", 2, 2, 3);
  corner.size = keys.map.find("size") != nullptr ? keys.length("size", "500 mm", std::nullopt) : endless;
  keys.reader.take("size");
  corner.faces = read_faces<3>(keys, {"left", "right", "floor"}, reflectivity);
  return corner;
}

MeshObject read_mesh(Keys& keys, config::Position& file_at) {
  MeshObject mesh{read_placement(keys)};
  mesh.file = keys.reader.input_file("file", "part.ply");
  mesh.unit = keys.length("unit", "1 mm", 1.0);
  const config::Entry* file = keys.map.find("file");
  if (file == nullptr) return mesh;
  file_at = file->value.at;
  const std::string extension = config::lower_case_ending(mesh.file);
  if (!mesh.file.empty() && extension != ".ply" && extension != ".obj")
    keys.diagnostics.error(file_at, fmt::format("'file' is {}, expected a mesh", file->value.described()),
                           "meshes are read from .ply and .obj files");
  return mesh;
}

Surface read_surface(const config::Entry* entry, Diagnostics& diagnostics) {
  Surface surface;
  if (entry == nullptr) return surface;
  Reader reader(entry->value, diagnostics, "'surface'");
  surface.roughness = reader.number_within("roughness", "rad", "0.3 rad", surface.roughness, 0, M_PI / 2);
  surface.specular = reader.number_within("specular", "", "0.3", surface.specular, 0, 100);
  surface.exponent = reader.number_within("exponent", "", "60", surface.exponent, 0, 1e5);
  surface.given = true;
  reader.finish();
  return surface;
}

}  // namespace

const std::vector<std::string>& object_types() {
  static const std::vector<std::string> types = {"board", "box", "sphere", "corner", "chessboard", "card", "mesh"};
  return types;
}

Object read_object(const Value& map, Diagnostics& diagnostics) {
  const config::Entry* type = map.find("type");
  Object object;
  object.at = map.at;
  object.type = type != nullptr ? type->value.text : "";
  const std::string what = object.type.empty() ? "an object" : fmt::format("the {}", object.type);
  Reader reader(map, diagnostics, what);
  if (reader.need("type", "board") == nullptr) return object;
  if (std::ranges::find(object_types(), object.type) == object_types().end()) {
    diagnostics.error(type->value.at, fmt::format("there is no type of object {}", type->value.described()),
                      config::suggestion(object.type, object_types(), "types"));
    return object;
  }
  object.name = reader.word("name", object.type);
  object.reflectivity = reader.number_within("reflectivity", "", "0.85", object.reflectivity, 0, 1);
  object.surface = read_surface(reader.take("surface"), diagnostics);
  Keys keys{reader, map, diagnostics};
  object.velocity = keys.vector("velocity", "m/s", "[0 mm/s, 0 mm/s, 100 mm/s]");
  if (object.type == "board") object.form = read_board(keys);
  if (object.type == "chessboard") object.form = read_chessboard(keys);
  if (object.type == "card") object.form = read_card(keys, object.file_at);
  if (object.type == "box") object.form = read_box(keys, object.reflectivity);
  if (object.type == "sphere") object.form = read_sphere(keys);
  if (object.type == "corner") object.form = read_corner(keys, object.reflectivity);
  if (object.type == "mesh") object.form = read_mesh(keys, object.file_at);
  reader.finish();
  return object;
}

}  // namespace tofgraph::simulation
