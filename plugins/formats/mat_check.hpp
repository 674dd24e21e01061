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
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph {

class MatCheck {
 public:
  /// @throws std::runtime_error for a variable whose header exceeds its size, a numeric one whose values have an
  /// unknown type or a number other than announced, or a decompression bomb
  explicit MatCheck(const std::string& path) : in_(path, std::ios::binary | std::ios::ate) {
    const auto size = static_cast<std::uint64_t>(in_.tellg());
    std::vector<std::uint8_t> head = bytes(0, 128);
    if (head.size() < 128 || std::string(head.begin(), head.begin() + 10) != "MATLAB 5.0") return;
    big_endian_ = head[126] == 'M';
    constexpr std::uint32_t matrix = 14, compressed = 15;
    for (std::uint64_t at = 128; at + 8 <= size;) {
      const std::vector<std::uint8_t> tag = bytes(at, 8);
      if (tag.size() < 8) return;
      const std::uint32_t type = number(tag, 0), length = number(tag, 4);
      if (length > size - at - 8) throw std::runtime_error("is damaged: a variable extends beyond the end of the file");
      if (type == matrix) check(bytes(at + 8, std::min<std::uint64_t>(length, max_head)));
      if (type == compressed) {
        const std::vector<std::uint8_t> inflated =
            inflate_head(bytes(at + 8, std::min<std::uint64_t>(length, max_head)));
        if (inflated.size() < 8 || number(inflated, 0) != matrix)
          throw std::runtime_error("is damaged: a compressed variable cannot be read");
        refuse_bomb(length, number(inflated, 4));
        check({inflated.begin() + 8, inflated.end()});
      }
      at += 8 + std::uint64_t{length};
    }
  }

 private:
  static constexpr std::uint64_t max_head = 8192;  // flags, sizes and name of a variable are shorter
  using Bytes = std::vector<std::uint8_t>;

  Bytes bytes(std::uint64_t at, std::uint64_t count) {
    Bytes result(count);
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(at));
    in_.read(reinterpret_cast<char*>(result.data()), static_cast<std::streamsize>(count));
    result.resize(static_cast<std::size_t>(in_.gcount()));
    return result;
  }
  std::uint32_t number(const Bytes& from, std::size_t at) const {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8U | from[at + (big_endian_ ? i : 3 - i)];
    return value;
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

  static Bytes inflate_head(const Bytes& from) {
    Bytes result(max_head);
    z_stream stream{};
    if (inflateInit(&stream) != Z_OK) return {};
    stream.next_in = const_cast<Bytef*>(from.data());
    stream.avail_in = static_cast<uInt>(from.size());
    stream.next_out = result.data();
    stream.avail_out = static_cast<uInt>(result.size());
    inflate(&stream, Z_SYNC_FLUSH);
    result.resize(stream.total_out);
    inflateEnd(&stream);
    return result;
  }

  /// Checks the parts of a variable: flags, sizes, name, values.
  void check(const Bytes& matrix) const {
    std::uint64_t at = 0, expected = 1;
    std::uint32_t kind = 0;
    constexpr std::uint32_t first_numeric = 6, last_numeric = 15;
    for (int part = 0; part < 4; ++part) {
      if (at + 8 > matrix.size()) return;  // up to four bytes stored within the tag
      const std::uint32_t tag = number(matrix, at);
      const bool small = tag >> 16U != 0;  // up to four bytes within the tag
      const std::uint32_t type = small ? tag & 0xffffU : tag, length = small ? tag >> 16U : number(matrix, at + 4);
      const std::uint64_t data = at + (small ? 4 : 8);
      if (part == 3) return check_values(type, length, expected);
      // libmatio would allocate this length before reading.
      if (data + length > matrix.size()) throw std::runtime_error("is damaged: the head of a variable has no end");
      if (part == 0) kind = length >= 4 ? number(matrix, data) & 0xffU : 0;
      if (kind == 0 || kind > last_numeric || (part == 2 && kind < first_numeric)) return;
      for (std::uint32_t i = 0; part == 1 && i + 4 <= length; i += 4) {
        const std::uint64_t extent = number(matrix, data + i);
        if (extent != 0 && expected > (std::uint64_t{1} << 40U) / extent)
          throw std::runtime_error("is damaged: a variable has an impossible size");
        expected *= extent;
      }
      at = small ? at + 8 : data + (length + 7U) / 8U * 8U;
    }
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
