// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// MATLAB files, versions 5 and 7.3.
#include <matio.h>
#include <tofgraph/format.hpp>

#include <cstring>
#include <filesystem>
#include <memory>
#include <string_view>

#include "plugins/formats/mat_check.hpp"

namespace tofgraph {

/// Real, full, numeric variables; others (cells, structures, texts, complex numbers) are ignored.
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
    while (std::unique_ptr<matvar_t, FreeVariable> variable{Mat_VarReadNextInfo(file_.get())}) add_variable(*variable);
    if (arrays().empty()) throw std::runtime_error("has no variable that is an array of real numbers");
  }

  void read(std::size_t index, std::uint64_t first, std::uint64_t count, void* out) override {
    const FileArray& array = arrays()[index];
    const std::unique_ptr<matvar_t, FreeVariable> variable(Mat_VarReadInfo(file_.get(), array.name.c_str()));
    if (!variable) throw std::runtime_error("has lost the variable '" + array.name + "'");
    const std::size_t rank = array.extent.size();
    std::vector<int> start(rank, 0), stride(rank, 1), edge;
    for (std::size_t i = rank; i-- > 0;) edge.push_back(static_cast<int>(array.extent[i]));  // column-major
    start.back() = static_cast<int>(first);
    edge.back() = static_cast<int>(count);
    if (Mat_VarReadData(file_.get(), variable.get(), out, start.data(), stride.data(), edge.data()) != 0)
      throw std::runtime_error("is damaged: the variable '" + array.name + "' cannot be read");
  }

 private:
  struct CloseFile {
    void operator()(mat_t* file) const { Mat_Close(file); }
  };
  struct FreeVariable {
    void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
  };

  void add_variable(const matvar_t& variable) {
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
      default:
        return;
    }
    for (int axis = 0; axis < variable.rank; ++axis) {
      if (variable.dims[axis] > std::size_t{1} << 30U) return;
    }
    if (variable.isComplex != 0 || variable.rank < 1 || variable.rank > 6 || variable.name == nullptr) return;
    if (array.kind != TOFGRAPH_ELEMENT_FLOAT) array.bytes = bytes_of(variable.class_type);
    for (int axis = variable.rank; axis-- > 0;) array.extent.push_back(variable.dims[axis]);
    array.name = variable.name;
    array.text = "MATLAB";
    array.reversed = true;
    // Numbers may be stored in an eighth of their bytes, and deflate compresses at most 1032 times.
    constexpr double best_compression = 8 * 1032;
    double bytes = array.bytes;
    for (const std::uint64_t extent : array.extent) bytes *= static_cast<double>(extent);
    if (bytes > best_compression * static_cast<double>(size_))
      throw std::runtime_error("is damaged: the variable '" + array.name +
                               "' announces more values than the file holds");
    if (array.elements() > 0) add(std::move(array));
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
  std::uint64_t size_ = 0;  // bytes
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::MatFile, "MATLAB's files, version 5 and 7.3")
