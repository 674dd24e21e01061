// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/capture_map.hpp"

#include "io/capture_guard.hpp"
#include "io/capture_hdf5.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <tuple>

namespace tofgraph::io {
namespace {

std::vector<double> load(const std::string& file, const std::string& dataset, std::size_t rows, std::size_t columns) {
  const h5::Lock lock;
  const h5::Handle opened(h5::check(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), file), H5Fclose);
  const h5::Handle data(
      h5::check(H5Dopen2(opened, dataset.c_str(), H5P_DEFAULT), file + ": no dataset '" + dataset + "'"), H5Dclose);
  const h5::Handle space(h5::check(H5Dget_space(data), file), H5Sclose);
  hsize_t extent[2] = {0, 0};
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank == 2) H5Sget_simple_extent_dims(space, extent, nullptr);
  if (rank != 2 || extent[0] != rows || extent[1] != columns)
    throw std::runtime_error(
        fmt::format("{}: '{}' is {}, the camera has {} x {}", file, dataset,
                    rank == 2 ? fmt::format("{} x {}", extent[0], extent[1]) : fmt::format("of {} dimensions", rank),
                    rows, columns));
  std::vector<double> values(rows * columns);
  h5::check(H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), file);
  for (const double value : values) {
    if (!std::isfinite(value))
      throw std::runtime_error(fmt::format("{}: '{}' has values that are not finite", file, dataset));
  }
  return values;
}

/// Maps that were read, by file, dataset, time and size.
struct Known {
  using Key = std::tuple<std::string, std::string, std::filesystem::file_time_type, std::size_t, std::size_t>;
  std::mutex mutex;
  std::map<Key, std::shared_ptr<const std::vector<double>>> maps;
  static Known& instance() {
    static Known known;
    return known;
  }
};

}  // namespace

void forget_pixel_maps(const std::string& file) {
  Known& known = Known::instance();
  const std::lock_guard lock(known.mutex);
  std::erase_if(known.maps, [&](const auto& entry) { return std::get<0>(entry.first) == file; });
}

std::shared_ptr<const std::vector<double>> read_pixel_map(const std::string& file, const std::string& dataset,
                                                          std::size_t rows, std::size_t columns) {
  std::error_code error;
  const auto time = std::filesystem::last_write_time(file, error);
  if (error) throw std::runtime_error(fmt::format("{}: {}", file, error.message()));
  Known& known = Known::instance();
  const std::lock_guard lock(known.mutex);
  auto& map = known.maps[{file, dataset, time, rows, columns}];
  if (!map) {
    // A damaged file may take down the process that reads it.
    try_in_child({std::size_t{1} << 28U, 20}, [&] { load(file, dataset, rows, columns); });
    map = std::make_shared<const std::vector<double>>(load(file, dataset, rows, columns));
  }
  return map;
}

void write_pixel_maps(const std::string& file, const std::vector<PixelMapData>& maps, std::size_t rows,
                      std::size_t columns) {
  const h5::Lock lock;
  const h5::Handle created(h5::check(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), file), H5Fclose);
  const hsize_t extent[2] = {rows, columns};
  const h5::Handle space(h5::check(H5Screate_simple(2, extent, nullptr), file), H5Sclose);
  for (const PixelMapData& map : maps) {
    const h5::Handle data(h5::check(H5Dcreate2(created, map.dataset.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT,
                                               H5P_DEFAULT, H5P_DEFAULT),
                                    file + ": " + map.dataset),
                          H5Dclose);
    h5::check(H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, map.values.data()), file);
  }
  h5::check(H5Fflush(created, H5F_SCOPE_LOCAL), file);
}

void remember_pixel_maps(const std::string& file, const std::vector<PixelMapData>& maps, std::size_t rows,
                         std::size_t columns) {
  const auto time = std::filesystem::last_write_time(file);
  Known& known = Known::instance();
  const std::lock_guard lock(known.mutex);
  for (const PixelMapData& map : maps)
    known.maps[{file, map.dataset, time, rows, columns}] = std::make_shared<const std::vector<double>>(map.values);
}

}  // namespace tofgraph::io
