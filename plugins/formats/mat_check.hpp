// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Check of MATLAB files of version 5 before libmatio reads them: libmatio divides by the size of nonexistent types.
/// Format: MathWorks, MAT-File Format, "Level 5".
#pragma once

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph {

class MatCheck {
 public:
  /// @throws std::runtime_error for a variable, or a field of a structure, whose header exceeds its size; a numeric one
  /// whose values have an unknown type or a number other than announced; or a decompression bomb
  explicit MatCheck(const std::string& path) : in_(path, std::ios::binary | std::ios::ate) {
    const auto size = static_cast<std::uint64_t>(in_.tellg());
    const Bytes head = part_at(0, 128).bytes(128);
    if (head.size() < 128 || std::string(head.begin(), head.begin() + 10) != "MATLAB 5.0") return;
    big_endian_ = head[126] == 'M';
    for (std::uint64_t at = 128; at + 8 <= size;) {
      const Bytes tag = part_at(at, 8).bytes(8);
      if (tag.size() < 8) return;
      const std::uint32_t type = number(tag, 0), length = number(tag, 4);
      if (length > size - at - 8) throw std::runtime_error("is damaged: a variable extends beyond the end of the file");
      Part variable = part_at(at + 8, length);
      if (type == matrix) check(variable, 0);
      if (type == compressed) check_compressed(variable, length);
      at += 8 + std::uint64_t{length};
    }
  }

 private:
  using Bytes = std::vector<std::uint8_t>;
  static constexpr std::uint32_t matrix = 14, compressed = 15;  // types of elements

  /// Part of the file, read in order, and inflated if asked for.
  class Part {
   public:
    Part(std::istream& in, std::uint64_t length) : in_(&in), left_(length) {}
    void inflate() {
      stream_ = std::unique_ptr<z_stream, End>(new z_stream{});
      if (inflateInit(stream_.get()) != Z_OK) throw std::runtime_error("cannot be inflated: no memory");
    }
    /// Returns the next bytes, fewer at the end.
    Bytes bytes(std::uint64_t count) {
      Bytes result = stream_ ? inflated(count) : stored(count);
      position_ += result.size();
      return result;
    }
    void skip(std::uint64_t count) {
      while (count > 0) {
        const std::uint64_t read = bytes(std::min(count, buffer_size)).size();
        if (read == 0) return;
        count -= read;
      }
    }
    std::uint64_t position() const { return position_; }

   private:
    static constexpr std::uint64_t buffer_size = 65536;
    struct End {
      void operator()(z_stream* stream) const {
        inflateEnd(stream);
        delete stream;
      }
    };
    Bytes stored(std::uint64_t count) {
      Bytes result(std::min(count, left_));
      in_->read(reinterpret_cast<char*>(result.data()), static_cast<std::streamsize>(result.size()));
      result.resize(static_cast<std::size_t>(in_->gcount()));
      left_ -= result.size();
      return result;
    }
    Bytes inflated(std::uint64_t count) {
      Bytes result(count);
      stream_->next_out = result.data();
      stream_->avail_out = static_cast<uInt>(count);
      do {
        if (stream_->avail_in == 0) {
          buffer_ = stored(buffer_size);
          stream_->next_in = buffer_.data();
          stream_->avail_in = static_cast<uInt>(buffer_.size());
        }
      } while (stream_->avail_out > 0 && ::inflate(stream_.get(), Z_SYNC_FLUSH) == Z_OK);
      result.resize(count - stream_->avail_out);
      return result;
    }

    std::istream* in_;
    std::uint64_t left_, position_ = 0;
    std::unique_ptr<z_stream, End> stream_;
    Bytes buffer_;
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

  void check_compressed(Part& variable, std::uint32_t length) const {
    variable.inflate();
    const Bytes tag = variable.bytes(8);
    if (tag.size() < 8 || number(tag, 0) != matrix)
      throw std::runtime_error("is damaged: a compressed variable cannot be read");
    refuse_bomb(length, number(tag, 4));
    check(variable, 0);
  }

  /// Rejects decompression bombs. Deflate reaches 1032 for zeros; measured values compress less than tenfold.
  static void refuse_bomb(std::uint32_t compressed, std::uint32_t inflated) {
    constexpr std::uint32_t large = std::uint32_t{1} << 30U, most = 200;
    if (inflated < large || inflated / most < compressed) return;
    throw std::runtime_error("has a variable of " + std::to_string(compressed) + " bytes, which would become " +
                             std::to_string(inflated) + ", over " + std::to_string(most) +
                             " times as many: no measurement compresses that well. If this is intended, save it "
                             "without compression (version 6)");
  }

  struct Element {
    std::uint32_t type = 0, length = 0;
    Bytes within;  ///< up to four bytes, stored within the tag
    bool found = false;
  };
  Element next(Part& part) const {
    const Bytes tag = part.bytes(8);
    if (tag.size() < 8) return {};
    const std::uint32_t first = number(tag, 0), small = first >> 16U;
    if (small == 0) return {first, number(tag, 4), {}, true};
    return {first & 0xffffU, small, Bytes(tag.begin() + 4, tag.end()), true};
  }
  /// Content of an element of the head. libmatio would allocate its length before reading.
  static Bytes content(Part& part, const Element& element) {
    constexpr std::uint32_t max_head = 65536;  // flags, sizes and names are shorter
    Bytes bytes = element.within;
    if (bytes.empty() && element.length <= max_head) bytes = part.bytes((element.length + 7U) / 8U * 8U);
    if (bytes.size() < element.length) throw std::runtime_error("is damaged: the head of a variable has no end");
    bytes.resize(element.length);
    return bytes;
  }

  /// Checks the elements of a variable: flags, sizes, name and values, or for a structure the length of the names of
  /// its fields, these names, and the fields.
  void check(Part& part, int depth) const {
    constexpr std::uint32_t structure = 2, first_numeric = 6, last_numeric = 15;
    const Element flags = next(part);
    const Bytes flag_bytes = content(part, flags);
    const std::uint32_t kind = flag_bytes.size() >= 4 ? number(flag_bytes, 0) & 0xffU : 0;
    if (kind == 0 || kind > last_numeric) return;
    const std::uint64_t elements = elements_of(content(part, next(part)));
    if (kind != structure && kind < first_numeric) return;
    content(part, next(part));
    if (kind == structure) return check_fields(part, elements, depth);
    if (const Element values = next(part); values.found) check_values(values.type, values.length, elements);
  }

  void check_fields(Part& part, std::uint64_t elements, int depth) const {
    constexpr int max_depth = 16;
    const Bytes width = content(part, next(part));
    const std::uint32_t name = width.size() >= 4 ? number(width, 0) : 0;
    const std::uint64_t names = content(part, next(part)).size();
    if (depth == max_depth || name == 0 || names % name != 0)
      throw std::runtime_error("is damaged: the fields of a structure have no names, or are nested too deeply");
    const std::uint64_t fields = names / name;
    for (std::uint64_t i = 0; i < elements && fields > 0; ++i) {
      for (std::uint64_t k = 0; k < fields; ++k) check_field(part, depth);
    }
  }
  void check_field(Part& part, int depth) const {
    const Element field = next(part);
    const std::uint64_t begin = part.position();
    if (!field.found || field.type != matrix)
      throw std::runtime_error("is damaged: a structure has fewer fields than announced");
    if (field.length > 0) check(part, depth + 1);
    const std::uint64_t read = part.position() - begin;
    if (read > field.length) throw std::runtime_error("is damaged: a field of a structure is longer than announced");
    part.skip(field.length - read);
  }

  std::uint64_t elements_of(const Bytes& extents) const {
    std::uint64_t elements = 1;
    for (std::size_t i = 0; i + 4 <= extents.size(); i += 4) {
      const std::uint64_t extent = number(extents, i);
      if (extent != 0 && elements > (std::uint64_t{1} << 40U) / extent)
        throw std::runtime_error("is damaged: a variable has an impossible size");
      elements *= extent;
    }
    return elements;
  }

  static void check_values(std::uint32_t type, std::uint32_t length, std::uint64_t expected) {
    static constexpr std::array<std::uint32_t, 14> sizes = {0, 1, 1, 2, 2, 4, 4, 4, 0, 8, 0, 0, 8, 8};
    const std::uint32_t size = type < sizes.size() ? sizes[type] : 0;
    if (size == 0 || length % size != 0 || length / size != expected)
      throw std::runtime_error(
          "is damaged: the values of a variable are of an unknown type, or their number differs from the announced "
          "one");
  }

  std::ifstream in_;
  bool big_endian_ = false;
};

}  // namespace tofgraph
