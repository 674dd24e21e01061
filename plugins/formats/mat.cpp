// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// MATLAB files, versions 5 and 7.3.
#include <matio.h>
#include <tofgraph/format.hpp>

#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "plugins/formats/mat_check.hpp"

namespace tofgraph {

/// Real, full, numeric variables, and those in structures ("S.camera.depth"). Others (cells, arrays of structures,
/// texts, complex numbers) are ignored.
struct MatFile final : FileFormat {
  static constexpr const char* endings = "mat";
  static bool recognises(std::span<const std::uint8_t> head) {
    constexpr std::string_view five = "MATLAB 5.0 MAT-file", seven = "MATLAB 7.3 MAT-file";
    const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
    return text.starts_with(five) || text.starts_with(seven);
  }

  explicit MatFile(const std::string& path) {
    const MatCheck checked(path);
    file_.reset(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
    if (!file_) throw std::runtime_error("is a damaged MATLAB file");
    size_ = std::filesystem::file_size(path);
    std::string others;
    while (const Variable variable{Mat_VarReadNextInfo(file_.get())}) {
      if (variable->name == nullptr) continue;
      const std::size_t before = arrays().size();
      add_variable(*variable, {variable->name});
      if (arrays().size() == before) others += std::string(others.empty() ? "" : ", ") + variable->name;
    }
    if (arrays().empty())
      throw std::runtime_error("has no variable that is an array of real numbers" +
                               (others.empty() ? "" : "; it has: " + others));
  }

  void read(std::size_t index, std::uint64_t first, std::uint64_t count, void* out) override {
    const FileArray& array = arrays()[index];
    Place& place = places_[index];
    if (!place.compressed) return read_stored(array, place.path, first, count, out);
    const std::uint64_t slice = array.elements() / array.extent[0] * array.bytes;
    if (place.whole.empty()) {  // any part is inflated from the beginning, so all of it is read once
      std::vector<std::uint8_t> whole(array.extent[0] * slice);
      read_stored(array, place.path, 0, array.extent[0], whole.data());
      place.whole = std::move(whole);
    }
    std::memcpy(out, &place.whole[first * slice], count * slice);
  }

 private:
  struct CloseFile {
    void operator()(mat_t* file) const { Mat_Close(file); }
  };
  struct FreeVariable {
    void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
  };

  using Variable = std::unique_ptr<matvar_t, FreeVariable>;

  /// Place of an array in the file.
  struct Place {
    std::vector<std::string> path;  ///< variable, and fields of structures
    bool compressed = false;
    std::vector<std::uint8_t> whole;  ///< elements of a compressed array once it was read
  };

  void read_stored(const FileArray& array, const std::vector<std::string>& path, std::uint64_t first,
                   std::uint64_t count, void* out) const {
    const Variable variable(Mat_VarReadInfo(file_.get(), path.front().c_str()));
    matvar_t* found = variable.get();
    for (std::size_t i = 1; found != nullptr && i < path.size(); ++i)
      found = Mat_VarGetStructFieldByName(found, path[i].c_str(), 0);
    if (found == nullptr) throw std::runtime_error("has lost the variable '" + array.name + "'");
    if (!(is_version_5() ? read_linear(*found, array, first, count, out) : read_slab(*found, array, first, count, out)))
      throw std::runtime_error("is damaged: the variable '" + array.name + "' cannot be read");
  }
  bool is_version_5() const { return Mat_GetVersion(file_.get()) == MAT_FT_MAT5; }
  /// Of version 5, read_slab() returns wrong values for parts of arrays with four axes.
  bool read_linear(matvar_t& variable, const FileArray& array, std::uint64_t first, std::uint64_t count,
                   void* out) const {
    const std::uint64_t slice = array.elements() / array.extent[0];
    if (array.elements() > std::numeric_limits<int>::max())
      throw std::runtime_error("has more elements in '" + array.name + "' than libmatio can count");
    return Mat_VarReadDataLinear(file_.get(), &variable, out, static_cast<int>(first * slice), 1,
                                 static_cast<int>(count * slice)) == 0;
  }
  bool read_slab(matvar_t& variable, const FileArray& array, std::uint64_t first, std::uint64_t count,
                 void* out) const {
    const std::size_t rank = array.extent.size();
    std::vector<int> start(rank, 0), stride(rank, 1), edge;
    for (std::size_t i = rank; i-- > 0;) edge.push_back(static_cast<int>(array.extent[i]));  // column-major
    start.back() = static_cast<int>(first);
    edge.back() = static_cast<int>(count);
    return Mat_VarReadData(file_.get(), &variable, out, start.data(), stride.data(), edge.data()) == 0;
  }

  void add_variable(const matvar_t& variable, const std::vector<std::string>& path) {
    FileArray array;
    switch (variable.class_type) {
      case MAT_C_DOUBLE:
        array.bytes = 8;
        break;
      case MAT_C_SINGLE:
        break;
      case MAT_C_INT8:
      case MAT_C_INT16:
      case MAT_C_INT32:
      case MAT_C_INT64:
        array.kind = TOFGRAPH_ELEMENT_SIGNED;
        break;
      case MAT_C_UINT8:
      case MAT_C_UINT16:
      case MAT_C_UINT32:
      case MAT_C_UINT64:
        array.kind = TOFGRAPH_ELEMENT_UNSIGNED;
        break;
      case MAT_C_STRUCT:
        return add_fields(variable, path);
      default:
        return;
    }
    for (int axis = 0; axis < variable.rank; ++axis) {
      if (variable.dims[axis] > std::size_t{1} << 30U) return;
    }
    if (variable.isComplex != 0 || variable.rank < 1 || variable.rank > 6) return;
    if (array.kind != TOFGRAPH_ELEMENT_FLOAT) array.bytes = bytes_of(variable.class_type);
    for (int axis = variable.rank; axis-- > 0;) array.extent.push_back(variable.dims[axis]);
    for (const std::string& name : path) array.name += (array.name.empty() ? "" : ".") + name;
    array.text = "MATLAB";
    array.reversed = true;
    // Numbers may be stored in an eighth of their bytes, and deflate compresses at most 1032 times.
    constexpr double best_compression = 8 * 1032;
    double bytes = array.bytes;
    for (const std::uint64_t extent : array.extent) bytes *= static_cast<double>(extent);
    if (bytes > best_compression * static_cast<double>(size_))
      throw std::runtime_error("is damaged: the variable '" + array.name +
                               "' announces more values than the file holds");
    if (array.elements() == 0) return;
    add(std::move(array));
    places_.push_back(
        {.path = path, .compressed = is_version_5() && variable.compression == MAT_COMPRESSION_ZLIB, .whole = {}});
  }
  void add_fields(const matvar_t& structure, const std::vector<std::string>& path) {
    std::uint64_t elements = 1;
    for (int axis = 0; axis < structure.rank; ++axis) elements *= structure.dims[axis];
    if (elements != 1) return;
    const unsigned fields = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&structure));
    char* const* names = Mat_VarGetStructFieldnames(&structure);
    for (unsigned i = 0; i < fields; ++i) {
      const matvar_t* field = Mat_VarGetStructFieldByIndex(const_cast<matvar_t*>(&structure), i, 0);
      if (field == nullptr) continue;
      std::vector<std::string> longer = path;
      longer.emplace_back(names[i]);
      add_variable(*field, longer);
    }
  }
  static std::uint32_t bytes_of(matio_classes type) {
    switch (type) {
      case MAT_C_INT8:
      case MAT_C_UINT8:
        return 1;
      case MAT_C_INT16:
      case MAT_C_UINT16:
        return 2;
      case MAT_C_INT32:
      case MAT_C_UINT32:
        return 4;
      default:
        return 8;
    }
  }

  std::unique_ptr<mat_t, CloseFile> file_;
  std::uint64_t size_ = 0;     // bytes
  std::vector<Place> places_;  // of the arrays
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::MatFile, "MATLAB's files, version 5 and 7.3")
