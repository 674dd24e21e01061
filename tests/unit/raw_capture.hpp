// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Captures written and read with HDF5's own interface, so that reader and writer are not tested against each
/// other. Files that include this header include <hdf5.h> themselves.
#pragma once

#include <hdf5.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <type_traits>
#include <vector>

namespace tofgraph::tests {

template <class T> hid_t hdf5_type() {
  if constexpr (std::is_same_v<T, float>) return H5T_NATIVE_FLOAT;
  if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<T, std::uint8_t>) return H5T_NATIVE_UINT8;
  if constexpr (std::is_same_v<T, std::uint16_t>) return H5T_NATIVE_UINT16;
  if constexpr (std::is_same_v<T, std::int16_t>) return H5T_NATIVE_INT16;
  if constexpr (std::is_same_v<T, std::int32_t>) return H5T_NATIVE_INT32;
  if constexpr (std::is_same_v<T, std::int64_t>) return H5T_NATIVE_INT64;
  if constexpr (std::is_same_v<T, std::uint64_t>) return H5T_NATIVE_UINT64;
}

/// A capture file with arbitrary content, valid or not; closed by the destructor.
class RawCapture {
 public:
  explicit RawCapture(const std::filesystem::path& path)
      : file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {}
  ~RawCapture() {
    if (group_ >= 0) H5Gclose(group_);
    H5Fclose(file_);
  }
  RawCapture(const RawCapture&) = delete;
  RawCapture& operator=(const RawCapture&) = delete;

  RawCapture& text(const char* name, const std::string& value, hid_t object = -1) {
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, value.size() + 1);
    const hid_t attribute = H5Acreate2(object < 0 ? file_ : object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, type, value.c_str());
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
    return *this;
  }

  template <class T> RawCapture& number(const char* name, T value) {
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t attribute = H5Acreate2(file_, name, hdf5_type<T>(), space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, hdf5_type<T>(), &value);
    H5Aclose(attribute);
    H5Sclose(space);
    return *this;
  }

  RawCapture& numbers(const char* name, const std::vector<double>& values) {
    const hsize_t size = values.size();
    const hid_t space = H5Screate_simple(1, &size, nullptr);
    const hid_t attribute = H5Acreate2(file_, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, H5T_NATIVE_DOUBLE, values.data());
    H5Aclose(attribute);
    H5Sclose(space);
    return *this;
  }

  /// Writes format, version, camera, width, height and the group.
  RawCapture& head(std::int64_t width, std::int64_t height, std::int64_t version = 1,
                   const std::string& format = "tofgraph-capture", const std::string& camera = "test") {
    text("format", format).number("version", version).text("camera", camera);
    return number("width", width).number("height", height).group();
  }

  RawCapture& group() {
    group_ = H5Gcreate2(file_, "frames", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    return *this;
  }

  /// Writes a dataset /frames/NAME; chunk empty: contiguous. No values: declared, never written.
  template <class T> RawCapture& dataset(const std::string& name, const std::vector<hsize_t>& size,
                                         const std::vector<T>& values, const std::vector<hsize_t>& chunk = {},
                                         const std::string& applied = {}) {
    const int rank = static_cast<int>(size.size());
    const hid_t space = H5Screate_simple(rank, size.data(), nullptr), creation = H5Pcreate(H5P_DATASET_CREATE);
    if (!chunk.empty()) H5Pset_chunk(creation, rank, chunk.data());
    const hid_t made = H5Dcreate2(group_, name.c_str(), hdf5_type<T>(), space, H5P_DEFAULT, creation, H5P_DEFAULT);
    if (!values.empty()) H5Dwrite(made, hdf5_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    if (!applied.empty()) text("applied", applied, made);
    H5Dclose(made);
    H5Pclose(creation);
    H5Sclose(space);
    return *this;
  }

  /// Writes the five arrays of every capture; all but the time stamp unknown unless given.
  RawCapture& metadata(std::size_t frames, double integration_time = std::nan(""), const std::string& without = {}) {
    const hsize_t n = frames;
    std::vector<std::int64_t> stamps(frames);
    for (std::size_t i = 0; i < frames; ++i) stamps[i] = 1'000'000'000 + static_cast<std::int64_t>(i);
    if (without != "timestamp_ns") dataset<std::int64_t>("timestamp_ns", {n}, stamps);
    if (without != "integration_time_s")
      dataset("integration_time_s", {n}, std::vector<double>(frames, integration_time));
    if (without != "modulation_frequency_hz")
      dataset("modulation_frequency_hz", {n}, std::vector<double>(frames, std::nan("")));
    if (without != "temperature_c") dataset("temperature_c", {n}, std::vector<float>(frames, std::nanf("")));
    if (without != "time_since_power_on_s")
      dataset("time_since_power_on_s", {n}, std::vector<double>(frames, std::nan("")));
    return *this;
  }

  hid_t frames_group() const { return group_; }

 private:
  hid_t file_, group_ = -1;
};

/// A whole dataset as returned by HDF5.
template <class T> std::vector<T> raw_values(const std::filesystem::path& path, const std::string& name) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT),
              set = H5Dopen2(file, name.c_str(), H5P_DEFAULT);
  const hid_t space = H5Dget_space(set);
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  H5Dread(set, hdf5_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  H5Sclose(space);
  H5Dclose(set);
  H5Fclose(file);
  return values;
}

/// Provenance of a recording, which is complete only at its end, when readers may already have opened the file.
inline std::string provenance_in(const std::filesystem::path& path) {
  const std::vector<std::uint8_t> bytes = raw_values<std::uint8_t>(path, "/provenance");
  return {bytes.begin(), bytes.end()};
}

/// Text of a variable-length attribute, as h5py writes and reads it.
inline std::string raw_text(const std::filesystem::path& path, const std::string& object, const std::string& name) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (H5Aexists_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT) <= 0) {
    H5Fclose(file);
    return {};
  }
  const hid_t attribute = H5Aopen_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
  const hid_t type = H5Aget_type(attribute);
  char* text = nullptr;
  H5Aread(attribute, type, &text);
  std::string result = text;
  H5free_memory(text);
  H5Tclose(type);
  H5Aclose(attribute);
  H5Fclose(file);
  return result;
}

}  // namespace tofgraph::tests
