// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// PLY: G. Turk, The PLY Polygon File Format (1994). The data begin immediately after the line end_header, whatever
// their first byte is.
#include "simulation/mesh_polygons.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <iterator>
#include <limits>
#include <sstream>
#include <string_view>

namespace tofgraph::simulation {
namespace {

struct PlyType {
  char kind = 0;  ///< f, i or u; 0: unknown
  std::size_t bytes = 1;
};

PlyType ply_type(std::string_view name) {
  struct Named {
    std::string_view name;
    PlyType type;
  };
  static constexpr Named types[] = {
      {"char", {'i', 1}},  {"int8", {'i', 1}},    {"uchar", {'u', 1}},  {"uint8", {'u', 1}},
      {"short", {'i', 2}}, {"int16", {'i', 2}},   {"ushort", {'u', 2}}, {"uint16", {'u', 2}},
      {"int", {'i', 4}},   {"int32", {'i', 4}},   {"uint", {'u', 4}},   {"uint32", {'u', 4}},
      {"float", {'f', 4}}, {"float32", {'f', 4}}, {"double", {'f', 8}}, {"float64", {'f', 8}},
  };
  const auto* found = std::ranges::find(types, name, &Named::name);
  return found != std::end(types) ? found->type : PlyType{};
}

struct PlyProperty {
  std::string name;
  PlyType type, count;  ///< count: for a list
  bool list = false;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  bool is_face() const { return name == "face"; }
  /// Minimum number of bytes per element in a binary file; polygons have at least three corners.
  std::uint64_t min_bytes() const {
    std::uint64_t bytes = 0;
    for (const PlyProperty& p : properties) {
      const bool corners = is_face() && p.name.starts_with("vertex_ind");
      bytes += p.list ? p.count.bytes + (corners ? 3 * p.type.bytes : 0) : p.type.bytes;
    }
    return bytes;
  }
};

class PlyFile {
 public:
  explicit PlyFile(const std::filesystem::path& file) : file_(file), bytes_(mesh_bytes(file)) {}

  Polygons read() {
    read_header();
    check_announced();
    for (const PlyElement& element : elements_) {
      for (std::uint64_t i = 0; i < element.count; ++i) read_row(element);
    }
    for (const std::uint32_t corner : polygons_.corners) {
      if (corner >= polygons_.vertices.size())
        fail(fmt::format("a face has the corner {}, but there are {} vertices", corner, polygons_.vertices.size()));
    }
    return std::move(polygons_);
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const {
    fail_mesh(file_, "it cannot be read as a mesh: " + problem);
  }

  void read_header() {
    if (!bytes_.starts_with("ply")) fail("it does not begin with 'ply'");
    const std::size_t first_end = bytes_.find_first_of("\r\n");
    if (first_end == std::string::npos) fail("its header has no end");
    const bool only_returns = bytes_.compare(first_end, 2, "\r\n") != 0 && bytes_[first_end] == '\r';
    const char line_end = only_returns ? '\r' : '\n';
    for (bool ended = false; !ended;) {
      const std::size_t end = bytes_.find(line_end, at_);
      if (end == std::string::npos) fail("its header has no end");
      std::string line = bytes_.substr(at_, end - at_);
      if (line.ends_with('\r')) line.pop_back();
      at_ = end + 1;
      ended = line == "end_header" || line.starts_with("end_header ");
      if (!ended) read_header_line(line);
    }
    if (format_.empty()) fail("its header names no format");
  }

  void read_header_line(const std::string& line) {
    std::istringstream stream(line);
    const std::vector<std::string> words{std::istream_iterator<std::string>(stream), {}};
    if (words.size() < 2 || words[0] == "comment" || words[0] == "obj_info") return;
    if (words[0] == "format") {
      format_ = words[1];
      if (format_ != "ascii" && format_ != "binary_little_endian" && format_ != "binary_big_endian")
        fail(fmt::format("its format is '{}', expected ascii, binary_little_endian or binary_big_endian", format_));
    }
    if (words[0] == "element") add_element(line, words);
    if (words[0] == "property") add_property(line, words);
  }

  void add_element(const std::string& line, const std::vector<std::string>& words) {
    PlyElement element{words[1]};
    const std::string count = words.size() > 2 ? words[2] : "";
    const auto [end, failed] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (failed != std::errc() || end != count.data() + count.size())
      fail_mesh(file_, fmt::format("its header has no count in '{}'", line));
    elements_.push_back(std::move(element));
  }

  void add_property(const std::string& line, const std::vector<std::string>& words) {
    if (elements_.empty()) fail(fmt::format("its header has '{}' before any element", line));
    PlyProperty property;
    property.list = words[1] == "list";
    const std::size_t type = property.list ? 3 : 1;
    if (words.size() < type + 2) fail(fmt::format("its header has '{}' without a name", line));
    property.name = words[type + 1];
    property.type = ply_type(words[type]);
    property.count = property.list ? ply_type(words[2]) : PlyType{'u', 1};
    if (property.type.kind == 0 || property.count.kind == 0 || property.count.kind == 'f')
      fail(fmt::format("its header has an unknown type in '{}'", line));
    elements_.back().properties.push_back(std::move(property));
  }

  /// Compares the announced amount of data with that of the file before allocating memory.
  void check_announced() const {
    double announced = 0;  // lines or bytes; floating point, as it cannot overflow
    for (const PlyElement& element : elements_) {
      if (element.is_face()) refuse_too_many(file_, element.count);
      const double each = is_ascii() ? 1.0 : static_cast<double>(element.min_bytes());
      announced += static_cast<double>(element.count) * each;
    }
    const std::uint64_t there = is_ascii() ? lines_left() : bytes_.size() - at_;
    if (announced <= static_cast<double>(there)) return;
    const char* unit = is_ascii() ? "lines" : "bytes";
    fail_mesh(file_, fmt::format("it ends too early: its header announces at least {:.0f} {} of data, but there are "
                                 "only {}",
                                 announced, unit, there));
  }

  std::uint64_t lines_left() const {
    std::uint64_t lines = 0;
    bool content = false;
    for (const char c : std::string_view(bytes_).substr(at_)) {
      const bool ends = c == '\n' || c == '\r';
      lines += ends && content ? 1 : 0;
      content = !ends && (content || (c != ' ' && c != '\t'));
    }
    return lines + (content ? 1 : 0);
  }

  bool is_ascii() const { return format_ == "ascii"; }

  double number(PlyType type) { return is_ascii() ? word() : binary(type); }

  double word() {
    at_ = bytes_.find_first_not_of(" \t\r\n", at_);
    if (at_ == std::string::npos) fail_mesh(file_, "it ends too early: numbers are missing");
    if (bytes_[at_] == '+') ++at_;
    double value = 0;
    const auto [end, failed] = std::from_chars(bytes_.data() + at_, bytes_.data() + bytes_.size(), value);
    const std::size_t word_end = std::min(bytes_.find_first_of(" \t\r\n", at_), bytes_.size());
    if (failed != std::errc() || end != bytes_.data() + word_end)
      fail(fmt::format("'{}' is not a number", bytes_.substr(at_, std::min<std::size_t>(word_end - at_, 40))));
    at_ = word_end;
    return value;
  }

  double binary(PlyType type) {
    if (type.bytes > bytes_.size() - at_)
      fail_mesh(file_, fmt::format("it ends too early: after {} bytes a number is missing", bytes_.size()));
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), bytes_.data() + at_, type.bytes);
    at_ += type.bytes;
    const bool big = format_ == "binary_big_endian";
    if (big == (std::endian::native == std::endian::little))
      std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(type.bytes));
    const auto as = [&raw]<class T>(T value) {
      std::memcpy(&value, raw.data(), sizeof value);
      return static_cast<double>(value);
    };
    if (type.kind == 'f') return type.bytes == 4 ? as(float{}) : as(double{});
    if (type.kind == 'i')
      return type.bytes == 1 ? as(std::int8_t{}) : type.bytes == 2 ? as(std::int16_t{}) : as(std::int32_t{});
    return type.bytes == 1 ? as(std::uint8_t{}) : type.bytes == 2 ? as(std::uint16_t{}) : as(std::uint32_t{});
  }

  void read_row(const PlyElement& element) {
    Vertex vertex{};
    for (const PlyProperty& property : element.properties) {
      if (!property.list) {
        const double value = number(property.type);
        for (std::size_t axis = 0; axis < 3; ++axis)
          if (property.name == std::string_view("xyz").substr(axis, 1)) vertex[axis] = static_cast<float>(value);
        continue;
      }
      read_list(property);
      if (element.is_face() && property.name.starts_with("vertex_ind")) add_face();
      if (element.name == "tristrips" && property.name.starts_with("vertex_ind")) add_strip();
    }
    if (element.name != "vertex") return;
    check_vertex(file_, polygons_.vertices.size(), vertex);
    polygons_.vertices.push_back(vertex);
  }

  void read_list(const PlyProperty& property) {
    const double count = number(property.count);
    const std::size_t left = bytes_.size() - std::min(at_, bytes_.size());
    if (!(count >= 0 && count <= static_cast<double>(left)))
      fail_mesh(file_, fmt::format("it ends too early: a list announces {:.0f} numbers, but only {} bytes are left",
                                   count, left));
    list_.clear();
    for (double i = 0; i < count; ++i) list_.push_back(number(property.type));
  }

  std::uint32_t corner(double index) const {
    if (!(index >= 0 && index < std::numeric_limits<std::uint32_t>::max()))
      fail(fmt::format("a face has the corner {}", index));
    return static_cast<std::uint32_t>(index);
  }

  void add_face() {
    if (list_.size() < 3) return;  // points and lines have no surface
    std::vector<std::uint32_t>& polygon = polygon_;
    polygon.clear();
    for (const double index : list_) polygon.push_back(corner(index));
    polygons_.add(polygon);
  }

  /// Every corner of a strip forms a triangle with the two before it, alternately oriented; -1 starts a new strip.
  void add_strip() {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < list_.size(); ++i) {
      if (list_[i] < 0) {
        begin = i + 1;
        continue;
      }
      if (i < begin + 2) continue;
      const bool odd = (i - begin) % 2 != 0;
      const TriangleIndices triangle = {corner(list_[i - 2]), corner(list_[odd ? i : i - 1]),
                                        corner(list_[odd ? i - 1 : i])};
      polygons_.add(triangle);
      refuse_too_many(file_, polygons_.ends.size());
    }
  }

  const std::filesystem::path& file_;
  std::string bytes_, format_;
  std::size_t at_ = 0;
  std::vector<PlyElement> elements_;
  std::vector<double> list_;
  std::vector<std::uint32_t> polygon_;
  Polygons polygons_;
};

}  // namespace

Polygons read_ply(const std::filesystem::path& file) { return PlyFile(file).read(); }

}  // namespace tofgraph::simulation
