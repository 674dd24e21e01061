// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file File without a header, read as described by its layout.
#pragma once

#include "foreign/foreign_file.hpp"
#include "foreign/layout.hpp"

#include <fstream>

namespace tofgraph::foreign {

/// File of file_header bytes, then frames, each of frame_header bytes and the arrays of the layout in sequence. Each
/// array gets a frame axis before its own axes.
class HeaderlessFile final : public FileFormat {
 public:
  /// @throws std::runtime_error if the file is shorter than one frame
  HeaderlessFile(const std::filesystem::path& file, const Layout& layout);
  void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) override;
  /// Bytes after the last whole frame.
  std::uint64_t rest() const { return rest_; }

 private:
  void read_image(std::uint64_t at, const HeaderlessArray& array, std::uint8_t* out, std::uint64_t elements);

  std::vector<HeaderlessArray> layout_;
  std::vector<std::uint64_t> offsets_;  // of each array within a frame, bytes
  std::uint64_t begin_ = 0, frame_bytes_ = 0, rest_ = 0;
  std::ifstream in_;
};

}  // namespace tofgraph::foreign
