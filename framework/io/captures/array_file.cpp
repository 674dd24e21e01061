// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/array_file.hpp"

#include "config/paths.hpp"
#include "config/process_limits.hpp"
#include "io/captures/capture_dataset.hpp"
#include "io/captures/capture_guard.hpp"
#include "io/captures/capture_hdf5.hpp"
#include "io/captures/capture_layout.hpp"
#include "io/unknown.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

namespace tofgraph::io {
namespace {

constexpr std::size_t max_listed_datasets = 4096;
constexpr int max_array_rank = 5;
constexpr double max_exact = 9007199254740992.0;  // 2^53: all smaller integers are doubles
constexpr double max_slice = 2147483648.0;        // bytes per element of the slowest axis

/// Paths of the datasets stored in the file itself.
std::vector<std::string> paths_in(hid_t file) {
  std::vector<std::string> paths;
  const auto visit = [](hid_t, const char* name, const H5O_info_t* object, void* list) {
    auto& found = *static_cast<std::vector<std::string>*>(list);
    if (object->type == H5O_TYPE_DATASET) found.emplace_back(name);
    return herr_t{found.size() > max_listed_datasets ? 1 : 0};
  };
  h5::check(H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_NATIVE, visit, &paths, H5O_INFO_BASIC),
            "is damaged: its datasets cannot be listed");
  if (paths.size() > max_listed_datasets)
    throw std::runtime_error(fmt::format(
        "has more than {} datasets: copy the ones to be read into a file of their own, e.g. h5copy -i IN.h5 "
        "-o OUT.h5 -s /depth -d /depth",
        max_listed_datasets));
  std::ranges::sort(paths);
  return paths;
}

/// Element type of an array as read; nullopt: not a number.
std::optional<FileArray> element_of(hid_t type) {
  FileArray array;
  const auto bytes = static_cast<std::uint32_t>(H5Tget_size(type));
  const H5T_class_t kind = H5Tget_class(type);
  if (kind == H5T_FLOAT && (bytes == 2 || bytes == 4 || bytes == 8)) {
    array.bytes = std::max(bytes, 4U);  // HDF5 converts half precision
    return array;
  }
  if (kind != H5T_INTEGER || (bytes != 1 && bytes != 2 && bytes != 4 && bytes != 8)) return std::nullopt;
  array.kind = H5Tget_sign(type) == H5T_SGN_NONE ? TOFGRAPH_ELEMENT_UNSIGNED : TOFGRAPH_ELEMENT_SIGNED;
  array.bytes = bytes;
  return array;
}

hid_t memory_type_of(const FileArray& array) {
  if (array.kind == TOFGRAPH_ELEMENT_FLOAT) return array.bytes == 4 ? H5T_NATIVE_FLOAT : H5T_NATIVE_DOUBLE;
  const bool is_signed = array.kind == TOFGRAPH_ELEMENT_SIGNED;
  switch (array.bytes) {
    case 1:
      return is_signed ? H5T_NATIVE_INT8 : H5T_NATIVE_UINT8;
    case 2:
      return is_signed ? H5T_NATIVE_INT16 : H5T_NATIVE_UINT16;
    case 4:
      return is_signed ? H5T_NATIVE_INT32 : H5T_NATIVE_UINT32;
    default:
      return is_signed ? H5T_NATIVE_INT64 : H5T_NATIVE_UINT64;
  }
}

/// Attribute of a file or dataset; empty if it is missing or not a text.
std::string text_of(hid_t object, const char* name) {
  try {
    return h5::text_attribute(object, name);
  } catch (const std::runtime_error&) {
    H5Eclear2(H5E_DEFAULT);
    return {};
  }
}

/// Attribute of a dataset; nullopt: missing. @param where begins messages, with the name of the dataset
/// @throws std::runtime_error if it is not one number
std::optional<double> attribute_number(hid_t dataset, const char* name, const std::string& where) {
  const std::string problem = fmt::format("{} has an attribute {} that is not one number", where, name);
  if (h5::check(H5Aexists(dataset, name), problem) == 0) return std::nullopt;
  const h5::Handle attribute(h5::check(H5Aopen(dataset, name, H5P_DEFAULT), problem), H5Aclose);
  const h5::Handle type(h5::check(H5Aget_type(attribute), problem), H5Tclose);
  const h5::Handle space(h5::check(H5Aget_space(attribute), problem), H5Sclose);
  double value = 0;
  if (!element_of(type) || H5Sget_simple_extent_npoints(space) != 1 ||
      H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0)
    throw std::runtime_error(problem);
  return value;
}

/// Returns whether MATLAB (version 7.3) marks a dataset as something else than an array of numbers: a text, an empty
/// array, of which the dimensions are stored, or a part of a sparse matrix.
bool is_no_array_of_matlab(hid_t file, hid_t dataset, const std::string& path) {
  const std::string type = text_of(dataset, "MATLAB_class");
  const bool numbers = type.empty() || type == "double" || type == "single" || type == "logical" ||
                       type.starts_with("int") || type.starts_with("uint");
  if (!numbers || H5Aexists(dataset, "MATLAB_empty") > 0) return true;
  const std::size_t slash = path.rfind('/');
  return slash != std::string::npos &&
         H5Aexists_by_name(file, path.substr(0, slash).c_str(), "MATLAB_sparse", H5P_DEFAULT) > 0;
}

}  // namespace

/// Meaning of stored numbers by the netCDF (CF) attributes of a dataset: value = scale x stored + offset.
struct ArrayFile::Packing {
  double scale = 1, offset = 0;
  std::vector<double> fills;  ///< stored numbers that mean "no value"
  bool is_long = false;       ///< 64-bit integers are stored
  std::string text;           ///< the attributes found; empty: none that changes a value

  /// @param where begins messages @throws std::runtime_error if an attribute is not one number
  static Packing of(hid_t dataset, const std::string& where);
  /// @throws std::runtime_error for a number that may have been rounded
  void apply(std::span<double> values) const {
    for (double& value : values) {
      const bool is_fill = std::ranges::find(fills, value) != fills.end();
      if (is_long && !is_fill && std::abs(value) >= max_exact)
        throw std::runtime_error(
            fmt::format("has the 64-bit number {:.0f} in a dataset with {}: only numbers below "
                        "2^53 can be unpacked; remove the attribute if it does not apply",
                        value, text));
      value = is_fill ? std::numeric_limits<double>::quiet_NaN() : scale * value + offset;
    }
  }
};

ArrayFile::Packing ArrayFile::Packing::of(hid_t dataset, const std::string& where) {
  Packing packing;
  std::vector<std::string> found;
  const auto take = [&](const char* name, double usual) {
    const double value = attribute_number(dataset, name, where).value_or(usual);
    if (value != usual && !std::isnan(value)) found.push_back(fmt::format("{} {}", name, value));
    return value;
  };
  packing.scale = take("scale_factor", 1);
  packing.offset = take("add_offset", 0);
  if (!std::isfinite(packing.scale) || packing.scale == 0 || !std::isfinite(packing.offset))
    throw std::runtime_error(
        where + " has an unusable scale_factor or add_offset: both must be finite, and scale_factor not 0");
  for (const char* name : {"_FillValue", "missing_value"}) packing.fills.push_back(take(name, io::unknown));
  packing.text = fmt::format("{}", fmt::join(found, ", "));
  return packing;
}

struct ArrayFile::Impl {
  h5::Handle file;
  std::vector<std::optional<h5::Dataset>> datasets;  // nullopt: unreadable, reason in array.text
  std::vector<FileArray> arrays;
  std::vector<Packing> packings;
  std::vector<bool> whole;  // true: all announced values are stored

  void load(const std::filesystem::path& path) {
    const h5::Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    h5::check(H5Pset_file_locking(access, true, true), "file locking");
    file = h5::Handle(h5::check(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access), "cannot be opened as HDF5"), H5Fclose);
    if (text_of(file, "format") == layout::format)
      throw std::runtime_error("is a capture of this program already: it is used as it is, without a conversion");
    for (const std::string& name : paths_in(file)) add(name);
    if (arrays.empty()) throw std::runtime_error("has no dataset that is an array of numbers");
  }

  void add(const std::string& name) {
    const std::string damaged = "is damaged: '" + name + "'";
    const h5::Handle opened(h5::check(H5Dopen2(file, name.c_str(), H5P_DEFAULT), damaged), H5Dclose);
    const h5::Handle type(h5::check(H5Dget_type(opened), damaged), H5Tclose);
    const h5::Handle space(h5::check(H5Dget_space(opened), damaged), H5Sclose);
    std::optional<FileArray> array = element_of(type);
    const int rank = H5Sget_simple_extent_ndims(space);
    if (!array || rank < 1 || rank > max_array_rank || H5Sget_simple_extent_npoints(space) <= 0) return;
    if (is_no_array_of_matlab(file, opened, name)) return;
    std::vector<hsize_t> extent(static_cast<std::size_t>(rank));
    h5::check(H5Sget_simple_extent_dims(space, extent.data(), nullptr), damaged);
    array->extent.assign(extent.begin(), extent.end());
    array->name = name;
    array->text = "HDF5";
    array->unit = text_of(opened, "unit");
    if (array->unit.empty()) array->unit = text_of(opened, "units");
    std::optional<h5::Dataset> dataset;
    Packing packing;
    const std::string unreadable = "has a dataset that cannot be read: ";
    try {
      packing = Packing::of(opened, unreadable + name);
      if (!packing.text.empty()) {
        packing.is_long = array->kind != TOFGRAPH_ELEMENT_FLOAT && array->bytes == 8;
        array->kind = TOFGRAPH_ELEMENT_FLOAT;
        array->bytes = 8;
        array->text += ", unpacked: " + packing.text;
      }
      double slice = array->bytes;
      for (std::size_t axis = 1; axis < extent.size(); ++axis) slice *= static_cast<double>(extent[axis]);
      if (slice > max_slice)
        throw std::runtime_error(
            fmt::format("{}{} has {:.3g} GiB per element of its slowest axis, 2 are possible: store it "
                        "with the frames first",
                        unreadable, name, slice / max_slice * 2));
      dataset.emplace(file, name, CaptureReader::not_cut, unreadable);
    } catch (const std::runtime_error& problem) {  // other datasets may be readable
      H5Eclear2(H5E_DEFAULT);
      array->text = problem.what();
    }
    packings.push_back(std::move(packing));
    datasets.push_back(std::move(dataset));
    arrays.push_back(std::move(*array));
    whole.push_back(false);
  }

  void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) {
    const std::optional<h5::Dataset>& dataset = datasets[array];
    if (!dataset) throw std::runtime_error(arrays[array].text);
    if (!whole[array]) dataset->stored_frames(true);
    whole[array] = true;
    dataset->read_range(first, count, memory_type_of(arrays[array]), out);
    if (packings[array].text.empty()) return;
    const std::uint64_t slice = arrays[array].elements() / arrays[array].extent[0];
    packings[array].apply({static_cast<double*>(out), count * slice});
  }
};

ArrayFile::ArrayFile(const std::filesystem::path& file) {
  run_trial_once(file, "arrays", {config::trial_program(), "arrays", file.string()});
  const h5::Lock lock;
  auto impl = std::make_unique<Impl>();  // local, so that a failure closes the file with the lock held
  impl->load(file);
  impl_ = std::move(impl);
}

ArrayFile::~ArrayFile() {
  const h5::Lock lock;
  impl_.reset();
}

const std::vector<FileArray>& ArrayFile::arrays() const { return impl_->arrays; }

void ArrayFile::read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) const {
  const h5::Lock lock;
  impl_->read(array, first, count, out);
}

void ArrayFile::read_on_trial(const std::filesystem::path& file) {
  constexpr std::size_t memory = 256U << 20U, max_file = 512U << 20U;  // bytes, in addition to twice the file's size
  constexpr std::uint64_t max_tried = 64U << 20U;                      // bytes of an array that the trial reads
  constexpr unsigned seconds = 10;                                     // processor time
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  config::limit_process({memory + 2 * std::min<std::size_t>(error ? 0 : size, max_file), seconds});
  const h5::Lock lock;
  Impl trial;
  trial.load(file);
  std::vector<std::uint8_t> slice;
  for (std::size_t i = 0; i < trial.arrays.size(); ++i) {
    const FileArray& array = trial.arrays[i];
    const std::uint64_t bytes = array.elements() / array.extent[0] * array.bytes;
    if (bytes > max_tried || !trial.datasets[i]) continue;
    slice.resize(bytes);
    for (const std::uint64_t at : {std::uint64_t{0}, array.extent[0] - 1})
      trial.datasets[i]->read_range(at, 1, memory_type_of(array), slice.data());
  }
}

}  // namespace tofgraph::io
