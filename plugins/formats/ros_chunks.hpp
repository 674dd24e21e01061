// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Compressed chunks of ROS 1 bags and MCAP: none, LZ4 frames, Zstandard, bzip2.
#pragma once

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <fstream>
#include <string>

#include "plugins/formats/ros_messages.hpp"

namespace tofgraph::ros {

inline constexpr std::uint64_t max_chunk = std::uint64_t{1} << 30U;  ///< bytes
inline constexpr std::uint64_t max_ratio = 2000;  ///< of decompression; more is treated as an attack; LZ4 reaches 255

/// Decompresses a chunk. @param size announced by the chunk @throws std::runtime_error for another size, or damage
inline std::vector<std::uint8_t> decompressed(const std::string& compression, Bytes in, std::uint64_t size) {
  if (compression.empty() || compression == "none") {
    if (in.size() != size) throw std::runtime_error("has a chunk of another size than it announces");
    return {in.begin(), in.end()};
  }
  if (size > max_chunk || size > max_ratio * (in.size() + 64))
    throw std::runtime_error("announces a chunk of " + std::to_string(size) + " bytes from " +
                             std::to_string(in.size()) + " compressed ones");
  std::vector<std::uint8_t> out(size);
  std::uint64_t got = 0;
  if (compression == "zstd") {
    const std::size_t result = ZSTD_decompress(out.data(), out.size(), in.data(), in.size());
    if (ZSTD_isError(result) != 0) throw std::runtime_error("has a damaged zstd chunk");
    got = result;
  } else if (compression == "lz4") {
    LZ4F_dctx* context = nullptr;
    LZ4F_createDecompressionContext(&context, LZ4F_VERSION);
    std::size_t at = 0, result = 1;
    while (at < in.size() && result != 0 && LZ4F_isError(result) == 0) {
      std::size_t room = out.size() - got, used = in.size() - at;
      result = LZ4F_decompress(context, out.data() + got, &room, in.data() + at, &used, nullptr);
      got += room;
      at += used;
      if (room == 0 && used == 0) break;
    }
    LZ4F_freeDecompressionContext(context);
    if (LZ4F_isError(result) != 0) throw std::runtime_error("has a damaged lz4 chunk");
  } else if (compression == "bz2") {
    auto room = static_cast<unsigned>(out.size());
    std::vector<char> copy(in.begin(), in.end());  // bzip2's input pointer is not const
    if (BZ2_bzBuffToBuffDecompress(reinterpret_cast<char*>(out.data()), &room, copy.data(),
                                   static_cast<unsigned>(copy.size()), 0, 0) != BZ_OK)
      throw std::runtime_error("has a damaged bz2 chunk");
    got = room;
  } else {
    throw std::runtime_error("has chunks compressed by '" + compression + "', expected none, lz4, zstd or bz2");
  }
  if (got != size) throw std::runtime_error("has a chunk of another size than it announces");
  return out;
}

/// File with random access.
class PlacedFile {
 public:
  explicit PlacedFile(const std::string& path) : in_(path, std::ios::binary | std::ios::ate) {
    if (!in_) throw std::runtime_error("cannot be read");
    size_ = static_cast<std::uint64_t>(in_.tellg());
  }
  std::uint64_t size() const { return size_; }
  /// @throws std::runtime_error if the file is too short
  void read(std::uint64_t at, std::uint64_t count, std::vector<std::uint8_t>& out) {
    if (at > size_ || count > size_ - at) throw std::runtime_error("ends within a record: it was cut off");
    out.resize(count);
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(at));
    in_.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(count));
    if (!in_) throw std::runtime_error("cannot be read to its end: it became shorter while it was read");
  }

 private:
  std::ifstream in_;
  std::uint64_t size_ = 0;
};

}  // namespace tofgraph::ros
