// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// MATLAB files, versions 5 and 7.3.
#include <tofgraph/format.hpp>

#include <algorithm>
#include <optional>
#include <string_view>

#include "io/captures/array_file.hpp"
#include "plugins/formats/mat5_file.hpp"
#include "plugins/formats/mat5_part.hpp"

namespace tofgraph {

/// Numeric variables, and those in structures, named as in MATLAB: "S.camera.depth". Version 7.3 is HDF5.
struct MatFile final : FileFormat {
  static constexpr const char* endings = "mat";
  static constexpr std::string_view version_5 = "MATLAB 5.0 MAT-file", version_7_3 = "MATLAB 7.3 MAT-file";
  static bool recognises(std::span<const std::uint8_t> head) {
    const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
    return text.starts_with(version_5) || text.starts_with(version_7_3);
  }

  explicit MatFile(const std::string& path) {
    std::string head(version_5.size(), '\0');
    std::ifstream(path, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
    if (head == version_5)
      add_version_5(path);
    else
      add_version_7_3(path);
  }

  void read(std::size_t index, std::uint64_t first, std::uint64_t count, void* out) override {
    if (version_5_)
      version_5_->read(index, first, count, out);
    else
      version_7_3_->read(places_[index], first, count, out);
  }

 private:
  void add_version_5(const std::string& path) {
    version_5_.emplace(path);
    for (const FileArray& array : version_5_->arrays()) add(array);
    if (!arrays().empty()) return;
    std::string others;
    for (const std::string& name : version_5_->ignored()) others += (others.empty() ? "; it has: " : ", ") + name;
    throw std::runtime_error("has no variable that is an array of real numbers" + others);
  }
  void add_version_7_3(const std::string& path) {
    version_7_3_.emplace(path);
    for (std::size_t i = 0; i < version_7_3_->arrays().size(); ++i) {
      FileArray array = version_7_3_->arrays()[i];
      if (array.name.starts_with('#')) continue;  // elements of cells
      std::ranges::replace(array.name, '/', '.');
      array.text = "MATLAB";
      array.reversed = true;
      add(std::move(array));
      places_.push_back(i);
    }
    if (arrays().empty()) throw std::runtime_error("has no variable that is an array of real numbers");
  }

  std::optional<Mat5File> version_5_;
  std::optional<io::ArrayFile> version_7_3_;
  std::vector<std::size_t> places_;  // of the arrays of version 7.3 in their file
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::MatFile, "MATLAB's files, version 5 and 7.3")
