// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The format is documented in numpy.lib.format: magic, version, length of the header, the header as a Python
// dictionary, the elements.
#include "io/npy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace tofgraph::io {
namespace {

constexpr std::string_view npy_magic = "\x93NUMPY";
constexpr std::size_t max_npy_header = 65536;  // bytes

class HeaderReader {
 public:
  HeaderReader(std::istream& in, std::uint64_t size) : in_(in), size_(size) {}

  NpyHeader read() {
    NpyHeader header = parse(read_text());
    header.begin = begin_;
    return header;
  }

 private:
  [[noreturn]] static void fail(const std::string& problem) { throw std::runtime_error(problem); }

  std::uint64_t number(std::size_t bytes) {
    std::array<unsigned char, 4> raw{};
    if (!in_.read(reinterpret_cast<char*>(raw.data()), static_cast<std::streamsize>(bytes)))
      fail("ends within its header");
    std::uint64_t result = 0;
    for (std::size_t i = bytes; i-- > 0;) result = result << 8U | raw[i];
    return result;
  }

  std::string read_text() {
    std::string magic(npy_magic.size(), '\0');
    if (!in_.read(magic.data(), static_cast<std::streamsize>(magic.size())) || magic != npy_magic)
      fail("is not a .npy file: it does not begin with the mark of one");
    const std::uint64_t major = number(1);
    number(1);
    if (major < 1 || major > 3) fail(fmt::format("is of .npy version {}, expected 1 to 3", major));
    const std::size_t length_bytes = major == 1 ? 2 : 4;
    const std::uint64_t length = number(length_bytes);
    if (length > max_npy_header || length > size_)
      fail(fmt::format("announces a header of {} bytes, but has {} bytes in all", length, size_));
    std::string header(length, '\0');
    if (!in_.read(header.data(), static_cast<std::streamsize>(length))) fail("ends within its header");
    begin_ = npy_magic.size() + 2 + length_bytes + length;
    return header;
  }

  /// Text of a key's value and the remaining header.
  std::string_view after(std::string_view header, std::string_view key) const {
    for (const char quote : {'\'', '"'}) {
      const std::string quoted = fmt::format("{}{}{}", quote, key, quote);
      const auto at = header.find(quoted);
      if (at == std::string_view::npos) continue;
      const auto colon = header.find(':', at + quoted.size());
      const auto begin = colon == std::string_view::npos ? colon : header.find_first_not_of(' ', colon + 1);
      if (begin != std::string_view::npos) return header.substr(begin);
    }
    fail(fmt::format("has no '{}' in its header", key));
  }

  NpyHeader parse(std::string_view header) const {
    NpyHeader result;
    const std::string_view type = after(header, "descr");
    const auto end = type.find_first_of("'\"", 1);
    if ((type[0] != '\'' && type[0] != '"') || end == std::string_view::npos)
      fail("holds structured elements, expected plain numbers");
    set_type(type.substr(1, end - 1), result);
    const std::string_view order = after(header, "fortran_order");
    result.by_columns = order.starts_with("True");
    if (!result.by_columns && !order.starts_with("False")) fail("says neither True nor False for 'fortran_order'");
    const std::string_view shape = after(header, "shape");
    const auto close = shape.find(')');
    if (shape[0] != '(' || close == std::string_view::npos) fail("has no list of sizes for 'shape'");
    result.shape = sizes(shape.substr(1, close - 1));
    return result;
  }

  std::vector<std::uint64_t> sizes(std::string_view list) const {
    std::vector<std::uint64_t> result;
    while (!list.empty()) {
      const std::string_view item = list.substr(0, list.find(','));
      list.remove_prefix(std::min(list.size(), item.size() + 1));
      const auto begin = item.find_first_not_of(' ');
      if (begin == std::string_view::npos) continue;
      std::uint64_t size = 0;
      const std::string_view digits = item.substr(begin, item.find_last_not_of(" L") + 1 - begin);
      const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), size);
      if (error != std::errc() || end != digits.data() + digits.size())
        fail(fmt::format("announces a size of '{}', expected a whole number from 1 on", digits));
      result.push_back(size);
    }
    return result;
  }

  void set_type(std::string_view type, NpyHeader& header) const {
    static constexpr std::array<std::string_view, 11> known = {"f4", "f8", "u1", "u2", "u4", "u8",
                                                               "i1", "i2", "i4", "i8", "b1"};
    const bool order = type.size() == 3 && std::string_view("<>|=").find(type[0]) != std::string_view::npos;
    if (!order || std::ranges::find(known, type.substr(1)) == known.end()) {
      const std::string problem =
          fmt::format("holds elements of type '{}', expected f4, f8 or integers of up to 64 bits", type);
      if (type.find_first_of("USOMmV") != std::string_view::npos) throw NotNumbers(problem);
      fail(problem);
    }
    header.order = type[0];
    header.kind = type[1];
    header.bytes = static_cast<std::size_t>(type[2] - '0');
  }

  std::istream& in_;
  std::uint64_t size_, begin_ = 0;
};

class NpyFile {
 public:
  explicit NpyFile(const std::string& file) : file_(file), in_(file, std::ios::binary) {
    std::error_code error;
    size_ = std::filesystem::file_size(file, error);
    if (!in_ || error) fail("cannot be read");
  }

  ImageData read() {
    NpyHeader header;
    try {
      header = read_npy_header(in_, size_);
    } catch (const std::runtime_error& error) {
      fail(error.what());
    }
    if (header.shape.size() == 2) header.shape.push_back(1);
    if (header.shape.size() != 3) fail(fmt::format("has {} dimensions, expected 2 or 3", header.shape.size()));
    if (header.shape[2] == 0 || header.shape[2] > 3)
      fail(fmt::format("has {} values a pixel, expected 1 to 3", header.shape[2]));
    const std::uint64_t rows = header.shape[0], columns = header.shape[1], depth = header.shape[2];
    if (rows == 0 || columns == 0 || rows > max_image_pixels || columns > max_image_pixels / rows)
      fail(fmt::format("announces {} x {} pixels, expected 1 to {}", rows, columns, max_image_pixels));
    const std::size_t each = header.bytes;
    const std::uint64_t announced = rows * columns * depth * each, stored = size_ - header.begin;
    if (announced != stored)
      fail(fmt::format("announces {} x {}{} values of {} bytes, {} bytes in all, but {} bytes follow its header: {}",
                       rows, columns, depth == 1 ? "" : fmt::format(" x {}", depth), each, announced, stored,
                       stored < announced ? "it was cut off" : "something was appended to it"));
    std::vector<char> bytes(announced);
    if (!in_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) fail("cannot be read to its end");
    ImageData image;
    image.rows = rows;
    image.columns = columns;
    image.depth = depth;
    image.values.resize(rows * columns * depth);
    for (std::size_t i = 0; i < image.values.size(); ++i) {
      const std::size_t r = i / depth / columns, c = i / depth % columns, k = i % depth;
      image.values[i] = value(header, bytes.data() + each * (header.by_columns ? (k * columns + c) * rows + r : i));
    }
    return image;
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const { throw std::runtime_error(file_ + " " + problem); }

  template <class T> static double as(const std::array<char, 8>& bytes) {
    T value;
    std::memcpy(&value, bytes.data(), sizeof value);
    return static_cast<double>(value);
  }

  static double value(const NpyHeader& header, const char* at) {
    const std::size_t size = header.bytes;
    std::array<char, 8> bytes{};
    std::memcpy(bytes.data(), at, size);
    if (header.other_order()) std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    const char kind = header.kind;
    if (kind == 'f') return size == 4 ? as<float>(bytes) : as<double>(bytes);
    if (kind == 'i')
      return size == 1   ? as<std::int8_t>(bytes)
             : size == 2 ? as<std::int16_t>(bytes)
             : size == 4 ? as<std::int32_t>(bytes)
                         : as<std::int64_t>(bytes);
    return size == 1   ? as<std::uint8_t>(bytes)
           : size == 2 ? as<std::uint16_t>(bytes)
           : size == 4 ? as<std::uint32_t>(bytes)
                       : as<std::uint64_t>(bytes);
  }

  std::string file_;
  std::ifstream in_;
  std::uint64_t size_ = 0;
};

}  // namespace

NpyHeader read_npy_header(std::istream& in, std::uint64_t size) { return HeaderReader(in, size).read(); }

ImageData read_npy(const std::string& file) { return NpyFile(file).read(); }

}  // namespace tofgraph::io
