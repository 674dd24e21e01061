// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Point clouds as arrays of a file format: the coordinates, and each further field.
#pragma once

#include <tofgraph/format.hpp>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace tofgraph {

/// Field of a point: one number.
struct CloudField {
  std::string name;
  std::uint32_t kind = TOFGRAPH_ELEMENT_FLOAT, bytes = 4;
  std::uint64_t offset = 0;  ///< offset in a point
};

/// Points stored one after the other, in the byte order of this machine.
struct Cloud {
  std::uint64_t width = 0, height = 1, step = 0;  ///< px; bytes per point
  std::vector<CloudField> fields;
  std::vector<std::uint8_t> data;

  std::uint64_t points() const { return width * height; }
};

/// Stores a number given as text in an element. @returns false if it is not a number or does not fit
inline bool store_number(std::string_view text, const CloudField& field, std::uint8_t* to) {
  const auto store = [&]<class T>(T value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return false;
    std::memcpy(to, &value, sizeof value);
    return true;
  };
  if (text.starts_with('+')) text.remove_prefix(1);
  return with_element({field.kind, field.bytes}, store);
}

/// Reads a whole file. @throws std::runtime_error
inline std::string content_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (!in || error) throw std::runtime_error("cannot be read");
  std::string content(size, '\0');
  in.read(content.data(), static_cast<std::streamsize>(size));
  if (!in) throw std::runtime_error("cannot be read to its end: it became shorter while it was read");
  return content;
}

/// Splits a text into words.
class Words {
 public:
  explicit Words(std::string_view text) : left_(text) {}
  /// Next word; empty at the end.
  std::string_view next() {
    const std::size_t begin = std::min(left_.find_first_not_of(" \t\r\n"), left_.size());
    const std::size_t end = std::min(left_.find_first_of(" \t\r\n", begin), left_.size());
    const std::string_view word = left_.substr(begin, end - begin);
    left_.remove_prefix(end);
    return word;
  }
  std::uint64_t whole_number() {
    const std::string_view word = next();
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || value > std::uint64_t{1} << 40U)
      throw std::runtime_error("has '" + std::string(word.substr(0, 40)) + "' where a number is expected");
    return value;
  }

 private:
  std::string_view left_;
};

/// Reads the points of a cloud in text form. @param item a point or a vertex, for messages
/// @returns false if the text ends too early @throws std::runtime_error for a word that is not a suitable number
inline bool read_text(Cloud& cloud, std::string_view text, const char* item) {
  if (cloud.points() > text.size() / std::max<std::size_t>(cloud.fields.size(), 1)) return false;
  cloud.data.resize(cloud.points() * cloud.step);
  Words words(text);
  for (std::uint64_t p = 0; p < cloud.points(); ++p) {
    for (const CloudField& field : cloud.fields) {
      const std::string_view word = words.next();
      if (word.empty()) return false;
      if (!store_number(word, field, &cloud.data[p * cloud.step + field.offset]))
        throw std::runtime_error("has '" + std::string(word.substr(0, 40)) + "' as the field '" + field.name + "' of " +
                                 item + " " + std::to_string(p));
    }
  }
  return true;
}

/// Format of files that contain a cloud. Organised clouds are images (row column), others lists of points (point).
class CloudFormat : public FileFormat {
 public:
  void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) override {
    const std::uint64_t columns = cloud_.height > 1 ? cloud_.width : 1;
    const std::size_t each = arrays()[array].axes.ends_with("coordinate") ? 3 : 1;
    auto* to = static_cast<std::uint8_t*>(out);
    for (std::uint64_t p = first * columns; p < (first + count) * columns; ++p) {
      for (std::size_t k = 0; k < each; ++k) {
        const CloudField& field = cloud_.fields[of_array_[array] + k];
        std::memcpy(to, &cloud_.data[p * cloud_.step + field.offset], field.bytes);
        to += field.bytes;
      }
    }
  }

 protected:
  /// Takes ownership of a cloud and lists its fields. @throws std::runtime_error if it has no points
  void set_cloud(Cloud cloud, const std::string& text) {
    cloud_ = std::move(cloud);
    if (cloud_.points() == 0) throw std::runtime_error("has no points");
    for (std::size_t i = 0; i < cloud_.fields.size(); ++i) {
      const std::vector<CloudField>& fields = cloud_.fields;
      if (fields[i].name == "_") continue;  // padding
      const bool xyz = i + 2 < fields.size() && fields[i].name == "x" && fields[i + 1].name == "y" &&
                       fields[i + 2].name == "z" && fields[i + 1].bytes == fields[i].bytes &&
                       fields[i + 2].bytes == fields[i].bytes && fields[i + 1].kind == fields[i].kind &&
                       fields[i + 2].kind == fields[i].kind;
      FileArray array{.kind = fields[i].kind, .bytes = fields[i].bytes, .name = xyz ? "points" : fields[i].name};
      array.text = text;
      array.extent = {cloud_.width};
      if (cloud_.height > 1) array.extent.insert(array.extent.begin(), cloud_.height);
      array.axes = cloud_.height > 1 ? "row column" : "point";
      if (xyz) {
        array.extent.push_back(3);
        array.axes += " coordinate";
      }
      add(std::move(array));
      of_array_.push_back(i);
      if (xyz) i += 2;
    }
    if (arrays().empty()) throw std::runtime_error("has no fields that can be read");
  }

 private:
  Cloud cloud_;
  std::vector<std::size_t> of_array_;  // index of the first field of each array
};

}  // namespace tofgraph
