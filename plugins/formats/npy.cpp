// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// NumPy arrays (.npy).
#include <tofgraph/format.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "plugins/formats/npy_array.hpp"

namespace tofgraph {

struct Npy final : FileFormat {
  static constexpr const char* endings = "npy";
  static bool recognises(std::span<const std::uint8_t> head) {
    constexpr std::string_view magic = "\x93NUMPY";
    return head.size() > magic.size() &&
           std::equal(magic.begin(), magic.end(), head.begin(),
                      [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
  }

  explicit Npy(const std::string& path) : in_(path, std::ios::binary) {
    std::error_code error;
    const std::uint64_t size = std::filesystem::file_size(path, error);
    if (!in_ || error) throw std::runtime_error("cannot be read");
    header_ = io::read_npy_header(in_, size);
    add(npy_array(header_, "", size - header_.begin));
  }

  void read(std::size_t, std::uint64_t first, std::uint64_t count, void* out) override {
    const FileArray& array = arrays().front();
    const std::uint64_t slice = array.elements() / array.extent[0] * array.bytes;
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(header_.begin + first * slice));
    in_.read(static_cast<char*>(out), static_cast<std::streamsize>(count * slice));
    if (!in_) throw std::runtime_error("cannot be read to its end: it became shorter while it was read");
    to_native(header_, out, count * slice);
  }

 private:
  std::ifstream in_;
  io::NpyHeader header_;
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Npy, "NumPy's arrays")
