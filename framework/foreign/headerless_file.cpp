// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "foreign/headerless_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

namespace tofgraph::foreign {
namespace {

std::uint64_t elements_of_image(const HeaderlessArray& array) {
  std::uint64_t count = 1;
  for (std::size_t axis = 1; axis < array.shape.size(); ++axis) count *= array.shape[axis];
  return count;
}

}  // namespace

HeaderlessFile::HeaderlessFile(const std::filesystem::path& file, const Layout& layout)
    : layout_(layout.headerless), begin_(layout.file_header), frame_bytes_(layout.frame_header) {
  for (const HeaderlessArray& array : layout_) {
    offsets_.push_back(frame_bytes_);
    frame_bytes_ += array.shape[0] * (array.image_header + elements_of_image(array) * array.bytes);
  }
  in_.open(file, std::ios::binary);
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(file, error);
  if (!in_ || error) throw std::runtime_error("cannot be read");
  const std::uint64_t frames = size > begin_ ? (size - begin_) / frame_bytes_ : 0;
  if (frames == 0)
    throw std::runtime_error(fmt::format(
        "has {} bytes, less than the file header of {} bytes and one frame of {} bytes that the layout states", size,
        begin_, frame_bytes_));
  rest_ = size - begin_ - frames * frame_bytes_;
  for (const HeaderlessArray& array : layout_) {
    std::vector<std::uint64_t> extent = array.shape;
    extent.insert(extent.begin(), frames);
    add({.kind = array.kind, .bytes = array.bytes, .extent = std::move(extent), .name = array.name, .text = "layout"});
  }
}

void HeaderlessFile::read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) {
  const HeaderlessArray& one = layout_[array];
  const std::uint64_t elements = elements_of_image(one);
  auto* to = static_cast<std::uint8_t*>(out);
  for (std::uint64_t frame = first; frame < first + count; ++frame) {
    std::uint64_t at = begin_ + frame * frame_bytes_ + offsets_[array];
    for (std::uint64_t image = 0; image < one.shape[0]; ++image) {
      read_image(at + one.image_header, one, to, elements);
      at += one.image_header + elements * one.bytes;
      to += elements * one.bytes;
    }
  }
}

void HeaderlessFile::read_image(std::uint64_t at, const HeaderlessArray& array, std::uint8_t* out,
                                std::uint64_t elements) {
  in_.seekg(static_cast<std::streamoff>(at));
  in_.read(reinterpret_cast<char*>(out), static_cast<std::streamsize>(elements * array.bytes));
  if (!in_) throw std::runtime_error("cannot be read to its end: it became shorter while it was read");
  if (array.big_endian == (std::endian::native == std::endian::big) || array.bytes == 1) return;
  for (std::uint64_t i = 0; i < elements; ++i) std::reverse(out + i * array.bytes, out + (i + 1) * array.bytes);
}

}  // namespace tofgraph::foreign
