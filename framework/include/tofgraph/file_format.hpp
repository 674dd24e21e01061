// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Opened file of another program as a list of arrays; base class of format plugins (format.hpp).
#pragma once

#include <tofgraph/format.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph {

/// Type of the elements of an array; see tofgraph_file_array.
struct ElementType {
  std::uint32_t kind = TOFGRAPH_ELEMENT_FLOAT, bytes = 4;
};

/// Returns visit(zero of the C++ type of such elements), for example of std::int16_t.
template <class Visit> auto with_element(ElementType type, Visit&& visit) {
  if (type.kind == TOFGRAPH_ELEMENT_FLOAT) return type.bytes == 4 ? visit(float{}) : visit(double{});
  const bool is_signed = type.kind == TOFGRAPH_ELEMENT_SIGNED;
  switch (type.bytes) {
    case 1:
      return is_signed ? visit(std::int8_t{}) : visit(std::uint8_t{});
    case 2:
      return is_signed ? visit(std::int16_t{}) : visit(std::uint16_t{});
    case 4:
      return is_signed ? visit(std::int32_t{}) : visit(std::uint32_t{});
    default:
      return is_signed ? visit(std::int64_t{}) : visit(std::uint64_t{});
  }
}

/// Array of a file; see tofgraph_file_array.
struct FileArray {
  std::uint32_t kind = TOFGRAPH_ELEMENT_FLOAT, bytes = 4;
  std::vector<std::uint64_t> extent;  ///< in memory, slowest axis first
  std::string name, unit, text;
  std::string axes;       ///< meaning of the axes if the format defines it, e.g. "row column"; else empty
  bool reversed = false;  ///< users of the format count the axes in reverse order

  std::uint64_t elements() const {
    std::uint64_t count = 1;
    for (const std::uint64_t e : extent) count *= e;
    return count;
  }
};

/// Opened file. Errors are exceptions derived from std::exception, whose text continues a sentence that begins with the
/// file name: "has 3 bytes, expected 8".
class FileFormat {
 public:
  FileFormat() = default;
  FileFormat(const FileFormat&) = delete;
  FileFormat& operator=(const FileFormat&) = delete;
  virtual ~FileFormat() = default;

  const std::vector<FileArray>& arrays() const { return arrays_; }
  const std::string& profile() const { return profile_; }
  /// Reads elements first .. first + count - 1 of an array's slowest axis.
  virtual void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) = 0;

 protected:
  void add(FileArray array) { arrays_.push_back(std::move(array)); }
  /// Sets a camera profile (YAML) derived from the file.
  void set_profile(std::string text) { profile_ = std::move(text); }

 private:
  std::vector<FileArray> arrays_;
  std::string profile_;
};

}  // namespace tofgraph
