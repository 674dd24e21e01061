// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// PNG: ISO/IEC 15948. JPEG: ITU-T T.81, annex B. TIFF: revision 6.0, sections 2 and 15.
#include "io/picture_file.hpp"

#include "io/image_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::io {
namespace {

class PictureBytes {
 public:
  explicit PictureBytes(const std::filesystem::path& file) : name_(file.string()) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw std::runtime_error(name_ + " cannot be read");
    bytes_.assign(std::istreambuf_iterator<char>(in), {});
  }

  bool starts_with(std::string_view mark) const { return std::string_view(bytes_).starts_with(mark); }
  std::uint64_t size() const { return bytes_.size(); }

  /// Unsigned number of 1 to 4 bytes. @throws std::runtime_error beyond the end
  std::uint64_t number(std::uint64_t at, std::size_t count, bool little_endian = false) const {
    need(at + count);
    std::uint64_t result = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t place = little_endian ? count - 1 - i : i;
      result = result << 8U | static_cast<unsigned char>(bytes_[at + place]);
    }
    return result;
  }
  std::string_view text(std::uint64_t at, std::size_t count) const {
    need(at + count);
    return std::string_view(bytes_).substr(at, count);
  }

  /// Rejects a file that ends before `end`.
  void need(std::uint64_t end) const {
    if (end > size())
      throw std::runtime_error(
          fmt::format("{} was cut off: it needs at least {} bytes, but has {}", name_, end, size()));
  }
  void limit(std::uint64_t columns, std::uint64_t rows) const {
    if (columns == 0 || rows == 0 || columns > max_image_pixels / rows)
      throw std::runtime_error(fmt::format("{} announces {} x {} pixels, expected 1 to {} pixels in all", name_,
                                           columns, rows, max_image_pixels));
  }

 private:
  std::string name_, bytes_;
};

void check_png(const PictureBytes& file) {
  constexpr std::uint64_t frame = 12;  // length, type and checksum of a chunk, bytes
  file.limit(file.number(16, 4), file.number(20, 4));
  for (std::uint64_t at = 8;;) {
    const std::uint64_t length = file.number(at, 4);
    file.need(at + length + frame);
    if (file.text(at + 4, 4) == "IEND") return;
    at += length + frame;
  }
}

void check_jpeg(const PictureBytes& file) {
  constexpr std::uint64_t end_of_image = 0xD9, start_of_scan = 0xDA;
  bool in_scan = false;
  for (std::uint64_t at = 2;;) {
    if (file.number(at, 1) != 0xFF) {  // scan data, or a stray byte before a marker
      ++at;
      continue;
    }
    const std::uint64_t marker = file.number(at + 1, 1);
    if (marker == end_of_image) return;
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    if (marker == 0 || marker == 1 || (marker >= 0xD0 && marker <= 0xD8)) {  // of a scan, or without a length
      at += 2;
      continue;
    }
    const bool frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (frame && !in_scan) file.limit(file.number(at + 7, 2), file.number(at + 5, 2));
    in_scan = in_scan || marker == start_of_scan;
    at += 2 + file.number(at + 2, 2);
  }
}

/// Checks the first image of a TIFF file.
class TiffImage {
 public:
  explicit TiffImage(const PictureBytes& file) : file_(file), little_(file.starts_with("II")) {
    directory_ = number(4, 4);
    count_ = number(directory_, 2);
    file_.need(directory_ + 2 + 12 * count_);
  }

  void check() const {
    constexpr std::uint64_t width = 256, length = 257, strips = 273, strip_bytes = 279, tiles = 324, tile_bytes = 325;
    const std::vector<std::uint64_t> columns = values(width), rows = values(length);
    if (!columns.empty() && !rows.empty()) file_.limit(columns[0], rows[0]);
    check_parts(values(strips), values(strip_bytes));
    check_parts(values(tiles), values(tile_bytes));
  }

 private:
  std::uint64_t number(std::uint64_t at, std::size_t count) const { return file_.number(at, count, little_); }

  void check_parts(const std::vector<std::uint64_t>& offsets, const std::vector<std::uint64_t>& bytes) const {
    for (std::size_t i = 0; i < std::min(offsets.size(), bytes.size()); ++i) file_.need(offsets[i] + bytes[i]);
  }

  /// 16- or 32-bit numbers of a tag; empty if the tag is missing or has another type.
  std::vector<std::uint64_t> values(std::uint64_t tag) const {
    for (std::uint64_t i = 0; i < count_; ++i) {
      const std::uint64_t entry = directory_ + 2 + 12 * i;
      if (number(entry, 2) != tag) continue;
      const std::uint64_t type = number(entry + 2, 2), count = number(entry + 4, 4);
      const std::size_t each = type == 3 ? 2 : type == 4 ? 4 : 0;
      if (each == 0) return {};
      const std::uint64_t begin = each * count <= 4 ? entry + 8 : number(entry + 8, 4);
      file_.need(begin + each * count);
      std::vector<std::uint64_t> result;
      for (std::uint64_t k = 0; k < count; ++k) result.push_back(number(begin + each * k, each));
      return result;
    }
    return {};
  }

  const PictureBytes& file_;
  bool little_;
  std::uint64_t directory_ = 0, count_ = 0;
};

}  // namespace

void check_picture(const std::filesystem::path& file) {
  using namespace std::string_view_literals;
  const PictureBytes bytes(file);
  if (bytes.starts_with("\x89PNG\r\n\x1a\n"))
    check_png(bytes);
  else if (bytes.starts_with("\xFF\xD8"))
    check_jpeg(bytes);
  else if (bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv))
    TiffImage(bytes).check();
}

}  // namespace tofgraph::io
