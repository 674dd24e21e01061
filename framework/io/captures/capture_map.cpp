// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture_map.hpp"

#include "config/paths.hpp"
#include "config/process_limits.hpp"
#include "io/captures/capture_dataset.hpp"
#include "io/captures/capture_guard.hpp"
#include "io/captures/capture_hdf5.hpp"

#include <fmt/format.h>

#include <array>

namespace tofgraph::io {
namespace {

/// Name of the only dataset of a file, or `map`.
std::string only_dataset(hid_t file) {
  std::string only = "map";
  H5G_info_t group{};
  if (H5Gget_info(file, &group) < 0 || group.nlinks != 1) return only;
  char name[256] = "";
  if (H5Lget_name_by_idx(file, ".", H5_INDEX_NAME, H5_ITER_INC, 0, name, sizeof name, H5P_DEFAULT) > 0) only = name;
  return only;
}

/// Names at the root of the file, at most twenty.
std::vector<std::string> names_at_root(hid_t file) {
  std::vector<std::string> names;
  const auto add = [](hid_t, const char* name, const H5L_info_t*, void* list) {
    static_cast<std::vector<std::string>*>(list)->emplace_back(name);
    return herr_t{static_cast<std::vector<std::string>*>(list)->size() < 20 ? 0 : 1};
  };
  H5Literate(file, H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &names);
  if (names.empty()) names.emplace_back("none");
  return names;
}

/// Returns true if every chunk of a dataset was written, or all of its bytes if it is not chunked.
bool is_stored_whole(hid_t data, hid_t space, std::size_t rank, const std::array<hsize_t, 3>& extent) {
  const h5::Handle creation(H5Dget_create_plist(data), H5Pclose), type(H5Dget_type(data), H5Tclose);
  if (H5Pget_layout(creation) != H5D_CHUNKED)
    return H5Dget_storage_size(data) >= extent[0] * extent[1] * extent[2] * H5Tget_size(type);
  std::array<hsize_t, 3> chunk{1, 1, 1};
  hsize_t stored = 0;
  if (H5Pget_chunk(creation, static_cast<int>(rank), chunk.data()) != static_cast<int>(rank) ||
      H5Dget_num_chunks(data, space, &stored) < 0)
    return false;
  const auto along = [&](std::size_t axis) { return (extent[axis] + chunk[axis] - 1) / chunk[axis]; };
  return stored == along(0) * along(1) * along(2);
}

ImageData load(const std::string& file, const std::string& wanted) {
  const h5::Lock lock;
  const h5::Handle opened(h5::check(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), file), H5Fclose);
  const std::string dataset = wanted.empty() ? only_dataset(opened) : wanted;
  const h5::Handle data(H5Dopen2(opened, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  if (!data) {
    H5Eclear2(H5E_DEFAULT);
    throw std::runtime_error(
        fmt::format("{}: no dataset '{}'; it has {}", file, dataset, fmt::join(names_at_root(opened), ", ")));
  }
  const h5::Handle space(h5::check(H5Dget_space(data), file), H5Sclose);
  std::array<hsize_t, 3> extent{0, 0, 1};
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank != 2 && rank != 3)
    throw std::runtime_error(fmt::format("{}: '{}' has {} dimensions, expected rows x columns", file, dataset, rank));
  H5Sget_simple_extent_dims(space, extent.data(), nullptr);
  if (extent[0] == 0 || extent[1] == 0 || extent[0] > max_image_pixels / extent[1] || extent[2] == 0 || extent[2] > 3)
    throw std::runtime_error(fmt::format("{}: '{}' announces {} x {} pixels, expected 1 to {} pixels in all", file,
                                         dataset, extent[0], extent[1], max_image_pixels));
  if (const std::string missing = h5::missing_filter(data); !missing.empty())
    throw std::runtime_error(fmt::format("{}: '{}' {}", file, dataset, missing));
  if (!is_stored_whole(data, space, static_cast<std::size_t>(rank), extent))
    throw std::runtime_error(fmt::format("{}: '{}' is incomplete: parts of it were never written", file, dataset));
  ImageData image;
  image.rows = extent[0];
  image.columns = extent[1];
  image.depth = extent[2];
  image.values.resize(image.rows * image.columns * image.depth);
  h5::check(H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, image.values.data()), file);
  image.unit = h5::text_attribute(data, "unit");
  return image;
}

}  // namespace

ImageData read_pixel_map(const std::string& file, const std::string& dataset) {
  // A damaged file may crash the process that reads it.
  run_trial({config::trial_program(), "map", file, dataset});
  return load(file, dataset);
}

void read_pixel_map_on_trial(const std::string& file, const std::string& dataset) {
  config::limit_process({std::size_t{1} << 28U, 20});
  load(file, dataset);
}

void write_pixel_maps(const std::string& file, const std::vector<PixelMapData>& maps, std::size_t rows,
                      std::size_t columns) {
  const h5::Lock lock;
  const h5::Handle created(h5::check(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), file), H5Fclose);
  const hsize_t extent[2] = {rows, columns};
  const h5::Handle space(h5::check(H5Screate_simple(2, extent, nullptr), file), H5Sclose);
  const h5::Handle creation(h5::check(H5Pcreate(H5P_DATASET_CREATE), file), H5Pclose);
  H5Pset_obj_track_times(creation, false);  // for reproducible files
  for (const PixelMapData& map : maps) {
    const h5::Handle data(
        h5::check(H5Dcreate2(created, map.dataset.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, creation, H5P_DEFAULT),
                  file + ": " + map.dataset),
        H5Dclose);
    h5::check(H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, map.values.data()), file);
    if (!map.unit.empty()) h5::write_text(data, "unit", map.unit);
  }
  h5::check(H5Fflush(created, H5F_SCOPE_LOCAL), file);
}

}  // namespace tofgraph::io
