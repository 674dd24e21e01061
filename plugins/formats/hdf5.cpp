// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// HDF5 files of other programs.
#include <tofgraph/format.hpp>

#include <string_view>

#include "io/captures/array_file.hpp"

namespace tofgraph {

/// Numeric datasets, named by their paths in the file: `camera/depth`.
struct Hdf5File final : FileFormat {
  static constexpr const char* endings = "h5, hdf5";
  static bool recognises(std::span<const std::uint8_t> head) {
    constexpr std::string_view signature = "\x89HDF\r\n\x1a\n";
    return std::string_view(reinterpret_cast<const char*>(head.data()), head.size()).starts_with(signature);
  }

  explicit Hdf5File(const std::string& path) : file_(path) {
    for (const FileArray& array : file_.arrays()) add(array);
  }

  void read(std::size_t index, std::uint64_t first, std::uint64_t count, void* out) override {
    file_.read(index, first, count, out);
  }

 private:
  io::ArrayFile file_;
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Hdf5File, "HDF5 files of other programs: datasets of numbers")
