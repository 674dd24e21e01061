// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Point clouds in the Stanford format: text and binary, either byte order. PCL's own reader terminates on some
// damaged files.
#include "plugins/formats/cloud_arrays.hpp"

namespace tofgraph {

struct Ply final : CloudFormat {
  static constexpr const char* endings = "ply";
  static bool recognises(std::span<const std::uint8_t> head) {
    const std::string text(head.begin(), head.end());
    return text.starts_with("ply\n") || text.starts_with("ply\r\n");
  }

  explicit Ply(const std::string& path) {
    const std::string content = content_of(path);
    read_header(content);
    const std::string_view body = std::string_view(content).substr(body_);
    if (format_ != "ascii")
      read_binary(body);
    else if (!read_text(cloud_, body, "vertex"))
      cut_off();
    set_cloud(std::move(cloud_), "PLY");
  }

 private:
  /// Vertices must come first, as all known writers place them: elements after them are not read.
  void read_header(const std::string& content) {
    std::string_view element;
    for (std::size_t at = 0;;) {
      const std::size_t end = content.find('\n', at);
      if (end > 65536) throw std::runtime_error("has no whole PLY header");  // also if it was not found
      Words words(std::string_view(content).substr(at, end - at));
      at = body_ = end + 1;
      const std::string_view key = words.next();
      if (key == "end_header") break;
      if (key == "format") format_ = words.next();
      if (key == "element") {
        const bool first = element.empty();
        element = words.next();
        if (first && element != "vertex")
          throw std::runtime_error("begins with the element '" + std::string(element.substr(0, 40)) +
                                   "', expected vertex");
        if (first) cloud_.width = words.whole_number();
      }
      if (key == "property" && element == "vertex") {
        const std::string_view type = words.next();
        add_field(type, words.next());
      }
      if (key == "obj_info") {
        const std::string_view what = words.next();
        if (what == "num_cols") columns_ = words.whole_number();
        if (what == "num_rows") rows_ = words.whole_number();
      }
    }
    if (format_ != "ascii" && format_ != "binary_little_endian" && format_ != "binary_big_endian")
      throw std::runtime_error("has the format '" + format_.substr(0, 40) +
                               "', expected ascii, binary_little_endian or binary_big_endian");
    if (cloud_.fields.empty()) throw std::runtime_error("has no element 'vertex' with properties");
    if (rows_ > 1 && columns_ > 0 && rows_ <= cloud_.width && columns_ == cloud_.width / rows_ &&
        rows_ * columns_ == cloud_.width) {
      cloud_.width = columns_;
      cloud_.height = rows_;
    }
  }

  void add_field(std::string_view type, std::string_view name) {
    struct Type {
      std::string_view name, other;
      std::uint32_t kind, bytes;
    };
    static constexpr Type types[] = {
        {"char", "int8", TOFGRAPH_ELEMENT_SIGNED, 1},    {"uchar", "uint8", TOFGRAPH_ELEMENT_UNSIGNED, 1},
        {"short", "int16", TOFGRAPH_ELEMENT_SIGNED, 2},  {"ushort", "uint16", TOFGRAPH_ELEMENT_UNSIGNED, 2},
        {"int", "int32", TOFGRAPH_ELEMENT_SIGNED, 4},    {"uint", "uint32", TOFGRAPH_ELEMENT_UNSIGNED, 4},
        {"float", "float32", TOFGRAPH_ELEMENT_FLOAT, 4}, {"double", "float64", TOFGRAPH_ELEMENT_FLOAT, 8}};
    for (const Type& known : types) {
      if (type != known.name && type != known.other) continue;
      cloud_.fields.push_back({std::string(name), known.kind, known.bytes, cloud_.step});
      cloud_.step += known.bytes;
      return;
    }
    throw std::runtime_error("has a vertex property of the type '" + std::string(type.substr(0, 40)) +
                             "', expected numbers");
  }

  [[noreturn]] void cut_off() const {
    throw std::runtime_error("announces " + std::to_string(cloud_.points()) +
                             " vertices, more than it holds: it was cut off");
  }

  void read_binary(std::string_view body) {
    if (cloud_.points() > body.size() / cloud_.step) cut_off();
    cloud_.data.assign(body.begin(), body.begin() + static_cast<std::ptrdiff_t>(cloud_.points() * cloud_.step));
    if ((format_ == "binary_big_endian") == (std::endian::native == std::endian::big)) return;
    for (std::uint64_t p = 0; p < cloud_.points(); ++p) {
      for (const CloudField& field : cloud_.fields) {
        std::uint8_t* at = &cloud_.data[p * cloud_.step + field.offset];
        std::reverse(at, at + field.bytes);
      }
    }
  }

  Cloud cloud_;
  std::string format_;
  std::uint64_t rows_ = 0, columns_ = 0;
  std::size_t body_ = 0;
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Ply, "Point clouds in the Stanford format (PLY)")
