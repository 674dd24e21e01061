// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Arrays of a MATLAB file of version 5. Format: MathWorks, MAT-File Format, "Level 5". Not by libmatio, which crashes,
/// hangs or fills the memory on damaged files, and returns wrong parts of arrays with four axes.
#pragma once

#include <tofgraph/file_format.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "plugins/formats/mat5_part.hpp"
#include "plugins/formats/mat5_values.hpp"

namespace tofgraph {

/// Real, full, numeric variables, and those in structures ("S.camera.depth"). Others (cells, arrays of structures,
/// texts, complex numbers) are ignored.
class Mat5File {
 public:
  /// @throws std::runtime_error with the end of a sentence about the file
  explicit Mat5File(const std::string& path) : path_(path), in_(path, std::ios::binary | std::ios::ate) {
    const auto size = static_cast<std::uint64_t>(in_.tellg());
    const Bytes head = part_at(0, 128).bytes(128);
    if (head.size() < 128) throw std::runtime_error("is a damaged MATLAB file: it ends within its head");
    big_endian_ = head[126] == 'M';
    for (std::uint64_t at = 128; at + 8 <= size;) {
      const Bytes tag = part_at(at, 8).bytes(8);
      if (tag.size() < 8) return;
      const std::uint32_t type = number(tag, 0), length = number(tag, 4);
      if (length > size - at - 8) throw std::runtime_error("is damaged: a variable extends beyond the end of the file");
      if (type == matrix || type == compressed)
        add_variable({.at = at + 8, .length = length, .is_compressed = type == compressed});
      at += 8 + std::uint64_t{length};
    }
  }

  const std::vector<FileArray>& arrays() const { return arrays_; }
  /// Names of variables that are ignored.
  const std::vector<std::string>& ignored() const { return ignored_; }

  void read(std::size_t index, std::uint64_t first, std::uint64_t count, void* out) {
    const FileArray& array = arrays_[index];
    const Stored& stored = stored_[index];
    const std::uint64_t slice = array.elements() / array.extent[0], bytes = stored.type.bytes;
    const std::uint64_t position = stored.position + first * slice * bytes, length = count * slice * bytes;
    if (stored.variable.is_compressed)
      return convert_mat5(inflated(index, position, length, first + count == array.extent[0]), stored.type, big_endian_,
                          array, out);
    const Bytes read = part_at(stored.variable.at + position, length).bytes(length);
    if (read.size() < length) throw std::runtime_error("is damaged: it ends within the variable '" + array.name + "'");
    convert_mat5(read, stored.type, big_endian_, array, out);
  }

 private:
  using Part = Mat5Part;
  using Bytes = Part::Bytes;
  static constexpr std::uint32_t matrix = 14, compressed = 15;  // types of elements
  static constexpr std::size_t max_name = 4096, max_arrays = 4096;

  /// Variable in the file.
  struct Variable {
    std::uint64_t at = 0;  ///< position of its first byte
    std::uint32_t length = 0;
    bool is_compressed = false;
    std::uint64_t inflated = 0;  ///< length of the inflated variable with its tag
  };
  /// Values of an array: place and type in the file.
  struct Stored {
    Variable variable;
    std::uint64_t position = 0;  ///< in the variable, inflated if it is compressed
    ElementType type;
  };
  /// Compressed variable that is being read.
  struct Inflating {
    std::ifstream in;
    Part part;
    Inflating(const std::string& path, std::uint64_t at, std::uint64_t length)
        : in(path, std::ios::binary), part(in, length) {
      in.seekg(static_cast<std::streamoff>(at));
    }
  };
  /// Element of a variable.
  struct Element {
    std::uint32_t type = 0, length = 0;
    Bytes within;  ///< up to four bytes, stored within the tag
    bool found = false;
  };

  Part part_at(std::uint64_t at, std::uint64_t length) {
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(at));
    return {in_, length};
  }
  std::uint32_t number(const Bytes& from, std::size_t at) const {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8U | from[at + (big_endian_ ? i : 3 - i)];
    return value;
  }
  Element next(Part& part) const {
    const Bytes tag = part.bytes(8);
    if (tag.size() < 8) return {};
    const std::uint32_t first = number(tag, 0), small = first >> 16U;
    if (small == 0) return {first, number(tag, 4), {}, true};
    return {first & 0xffffU, small, Bytes(tag.begin() + 4, tag.end()), true};
  }
  /// Content of an element of the head.
  static Bytes content(Part& part, const Element& element) {
    constexpr std::uint32_t max_head = std::uint32_t{1} << 20U;  // flags, sizes and names of fields are shorter
    Bytes bytes = element.within;
    if (bytes.empty() && element.length <= max_head) bytes = part.bytes((element.length + 7U) / 8U * 8U);
    if (bytes.size() < element.length) throw std::runtime_error("is damaged: the head of a variable has no end");
    bytes.resize(element.length);
    return bytes;
  }

  /// Bytes of an array in a compressed variable. Each array is inflated in order by its own part, which begins again
  /// for bytes that it has passed. @param last these are the array's last: the checksum of the variable is verified
  Bytes inflated(std::size_t index, std::uint64_t position, std::uint64_t length, bool last) {
    const Variable& variable = stored_[index].variable;
    std::unique_ptr<Inflating>& one = inflating_[index];
    if (!one || one->part.position() > position) {
      one = std::make_unique<Inflating>(path_, variable.at, variable.length);
      one->part.inflate();
    }
    one->part.skip(position - one->part.position());
    Bytes bytes = one->part.bytes(length);
    if (bytes.size() < length) throw std::runtime_error("is damaged: a compressed variable cannot be read");
    if (!last) return bytes;
    one->part.skip(variable.inflated - one->part.position());
    if (!one->part.ends())
      throw std::runtime_error("is damaged: a compressed variable does not agree with its checksum, or has no end");
    return bytes;
  }

  void add_variable(Variable variable) {
    Part part = part_at(variable.at, variable.length);
    if (variable.is_compressed) {
      part.inflate();
      const Bytes tag = part.bytes(8);
      if (tag.size() < 8 || number(tag, 0) != matrix)
        throw std::runtime_error("is damaged: a compressed variable cannot be read");
      refuse_bomb(variable.length, number(tag, 4));
      variable.inflated = 8 + std::uint64_t{number(tag, 4)};
    }
    const std::size_t before = arrays_.size();
    const std::string name = add(part, variable, "", 0, variable.is_compressed ? variable.inflated : variable.length);
    if (arrays_.size() == before && !name.empty()) ignored_.push_back(name);
  }

  /// Rejects decompression bombs. Deflate reaches 1032 for zeros; measured values compress less than tenfold.
  static void refuse_bomb(std::uint32_t stored, std::uint32_t announced) {
    constexpr std::uint32_t possible = 1032, longest = std::numeric_limits<std::uint32_t>::max() - 16;
    if (announced / possible > stored || announced > longest)
      throw std::runtime_error("is damaged: a compressed variable announces more bytes than it can hold");
    constexpr std::uint32_t large = std::uint32_t{1} << 30U, most = 200;
    if (announced < large || announced / most < stored) return;
    throw std::runtime_error("has a variable of " + std::to_string(stored) + " bytes, which would become " +
                             std::to_string(announced) + ", over " + std::to_string(most) +
                             " times as many: no measurement compresses that well. If this is intended, save it "
                             "without compression (version 6)");
  }

  /// Adds the arrays of a variable or field, whose elements are flags, sizes, name and values.
  /// @param path name with those of the structures around it; empty: a variable, named by itself
  /// @param end of the elements, as a position in the variable @returns its name
  std::string add(Part& part, const Variable& variable, std::string path, int depth, std::uint64_t end) {
    constexpr std::uint32_t structure = 2, first_numeric = 6, last_numeric = 15, complex = 0x800;
    const Bytes flag_bytes = content(part, next(part));
    const std::uint32_t flags = flag_bytes.size() >= 4 ? number(flag_bytes, 0) : 0, kind = flags & 0xffU;
    if (kind == 0 || kind > last_numeric) return path;
    std::vector<std::uint64_t> extents = extents_of(content(part, next(part)));
    const Bytes name = content(part, next(part));
    if (path.empty()) path = text_of(name);
    if (path.empty()) return path;  // MATLAB's own data at the end of the file
    if (path.size() > max_name) throw std::runtime_error("is damaged: a variable has a name of over 4096 characters");
    if (kind == structure) {
      add_fields(part, variable, elements_of(extents), path, depth, end);
    } else if (kind >= first_numeric) {
      const Element values = next(part);
      check_values(values, elements_of(extents), end - std::min(end, part.position()));
      if ((flags & complex) == 0) {
        const std::uint64_t position = part.position() - values.within.size();
        add_array(kind, std::move(extents), path, {variable, position, mat5_type_of(values.type)});
      }
    }
    return path;
  }

  void add_fields(Part& part, const Variable& variable, std::uint64_t elements, const std::string& path, int depth,
                  std::uint64_t end) {
    constexpr int max_depth = 64;
    const Bytes width = content(part, next(part)), names = content(part, next(part));
    const std::size_t length = width.size() >= 4 ? number(width, 0) : 0;
    if (length == 0 || names.size() % length != 0)
      throw std::runtime_error("is damaged: the fields of a structure have no names");
    if (elements != 1 || depth == max_depth) return;
    for (std::size_t at = 0; at < names.size(); at += length) {
      const std::span<const std::uint8_t> name(&names[at], length);
      const Element field = next(part);
      const std::uint64_t begin = part.position();
      if (!field.found || field.type != matrix)
        throw std::runtime_error("is damaged: a structure has fewer fields than announced");
      if (begin > end || field.length > end - begin)
        throw std::runtime_error("is damaged: a field extends beyond the end of its structure");
      if (field.length > 0) add(part, variable, path + "." + text_of(name), depth + 1, begin + field.length);
      const std::uint64_t read = part.position() - begin;
      if (read > field.length) throw std::runtime_error("is damaged: a field of a structure is longer than announced");
      part.skip(field.length - read);
    }
  }

  /// A name up to its end, which a damaged file may have filled with anything.
  static std::string text_of(std::span<const std::uint8_t> bytes) {
    std::string text(bytes.begin(), std::ranges::find(bytes, 0));
    std::ranges::replace_if(
        text, [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
  }
  std::vector<std::uint64_t> extents_of(const Bytes& bytes) const {
    std::vector<std::uint64_t> extents;
    for (std::size_t i = 0; i + 4 <= bytes.size(); i += 4) extents.push_back(number(bytes, i));
    return extents;
  }
  static std::uint64_t elements_of(const std::vector<std::uint64_t>& extents) {
    std::uint64_t elements = 1;
    for (const std::uint64_t extent : extents) {
      if (extent != 0 && elements > (std::uint64_t{1} << 40U) / extent)
        throw std::runtime_error("is damaged: a variable has an impossible size");
      elements *= extent;
    }
    return elements;
  }

  /// @param left bytes up to the end of the elements
  static void check_values(const Element& values, std::uint64_t elements, std::uint64_t left) {
    const std::uint32_t size = mat5_type_of(values.type).bytes;
    const bool fits = values.within.empty() || values.length <= values.within.size();
    if (!fits || size == 0 || values.length % size != 0 || values.length / size != elements)
      throw std::runtime_error(
          "is damaged: the values of a variable are of an unknown type, or their number differs from the announced "
          "one");
    if (values.within.empty() && values.length > left)
      throw std::runtime_error("is damaged: a variable announces more values than it holds");
  }

  void add_array(std::uint32_t kind, std::vector<std::uint64_t> extents, const std::string& name,
                 const Stored& stored) {
    constexpr std::uint64_t max_extent = std::uint64_t{1} << 30U;
    constexpr std::size_t max_rank = 6;
    if (extents.empty() || extents.size() > max_rank || elements_of(extents) == 0 ||
        std::ranges::any_of(extents, [](std::uint64_t extent) { return extent > max_extent; }))
      return;
    // From MATLAB's double, single, int8, uint8, int16, uint16, .. uint64.
    static constexpr std::array<std::uint32_t, 10> types = {9, 7, 1, 2, 3, 4, 5, 6, 12, 13};  // as of values
    const ElementType type = mat5_type_of(types.at(kind - 6));
    if (std::ranges::find(arrays_, name, &FileArray::name) != arrays_.end())
      throw std::runtime_error("is damaged: it has two variables '" + name + "'");
    if (arrays_.size() == max_arrays)
      throw std::runtime_error("has more than " + std::to_string(max_arrays) +
                               " variables: save those to be read in a file of their own");
    FileArray array;
    array.kind = type.kind;
    array.bytes = type.bytes;
    array.extent.assign(extents.rbegin(), extents.rend());
    array.name = name;
    array.text = "MATLAB";
    array.reversed = true;
    arrays_.push_back(std::move(array));
    stored_.push_back(stored);
  }

  std::string path_;
  std::ifstream in_;
  bool big_endian_ = false;
  std::vector<FileArray> arrays_;
  std::vector<Stored> stored_;                                   // values of the arrays
  std::map<std::size_t, std::unique_ptr<Inflating>> inflating_;  // by array
  std::vector<std::string> ignored_;
};

}  // namespace tofgraph
