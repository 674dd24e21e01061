// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Wavefront OBJ: only the statements for vertices and faces are read.
#include "simulation/mesh_polygons.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <string_view>

namespace tofgraph::simulation {
namespace {

constexpr std::string_view obj_blanks = " \t\r";

/// Removes and returns the next word of a line; empty at its end.
std::string_view next_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(obj_blanks), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(obj_blanks));
  line.remove_prefix(word.size());
  return word;
}

template <class T> std::optional<T> obj_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  T value{};
  const auto [end, failed] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (failed != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

class ObjFile {
 public:
  explicit ObjFile(const std::filesystem::path& file) : file_(file), text_(mesh_bytes(file)) {}

  Polygons read() {
    std::replace(text_.begin(), text_.end(), '\r', '\n');
    std::string joined;  // for lines continued by a backslash
    std::string_view rest = text_;
    while (!rest.empty()) {
      const std::string_view line = rest.substr(0, rest.find('\n'));
      rest.remove_prefix(std::min(rest.size(), line.size() + 1));
      ++line_;
      if (line.ends_with('\\')) {
        joined += line.substr(0, line.size() - 1);
        joined += ' ';
        continue;
      }
      joined += line;
      read_line(joined);
      joined.clear();
    }
    read_line(joined);
    for (const std::uint32_t corner : polygons_.corners) {
      if (corner >= polygons_.vertices.size())
        fail_mesh(file_, fmt::format("it cannot be read as a mesh: a face has the corner {}, but there are {} vertices",
                                     std::uint64_t{corner} + 1, polygons_.vertices.size()));
    }
    return std::move(polygons_);
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const {
    fail_mesh(file_, fmt::format("it cannot be read as a mesh: line {}: {}", line_, problem));
  }

  void read_line(std::string_view line) {
    line = line.substr(0, line.find('#'));
    const std::string_view statement = next_word(line);
    if (statement == "v") add_vertex(line);
    if (statement == "f") add_face(line);
  }

  void add_vertex(std::string_view line) {
    Vertex vertex{};
    for (float& coordinate : vertex) {
      const std::string_view word = next_word(line);
      const auto value = obj_number<double>(word);
      if (!value) fail(fmt::format("'{}' is not a coordinate", word));
      coordinate = static_cast<float>(*value);
    }
    check_vertex(file_, polygons_.vertices.size(), vertex);
    polygons_.vertices.push_back(vertex);
  }

  /// Corners are written VERTEX, VERTEX/TEXTURE or VERTEX/TEXTURE/NORMAL, counted from 1; negative ones from the end.
  void add_face(std::string_view line) {
    polygon_.clear();
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
      const auto index = obj_number<std::int64_t>(word.substr(0, word.find('/')));
      const auto count = static_cast<std::int64_t>(polygons_.vertices.size());
      const std::int64_t corner = !index ? -1 : *index < 0 ? count + *index : *index - 1;
      if (corner < 0 || corner >= std::numeric_limits<std::uint32_t>::max())
        fail(fmt::format("a face has the corner '{}', but there are {} vertices", word, count));
      polygon_.push_back(static_cast<std::uint32_t>(corner));
    }
    if (polygon_.size() < 3) return;  // points and lines have no surface
    polygons_.add(polygon_);
    refuse_too_many(file_, polygons_.ends.size());
  }

  const std::filesystem::path& file_;
  std::string text_;
  std::size_t line_ = 0;
  std::vector<std::uint32_t> polygon_;
  Polygons polygons_;
};

}  // namespace

Polygons read_obj(const std::filesystem::path& file) { return ObjFile(file).read(); }

}  // namespace tofgraph::simulation
