// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/image_file.hpp"

#include "config/paths.hpp"
#include "config/quantity.hpp"
#include "io/image_data.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>

namespace tofgraph::io {
namespace {

/// SI value of one unit.
double scale_of(const std::string& unit, const std::string& wanted) {
  if (unit.empty()) return 1;
  const config::Quantity one = config::parse_scale(unit, wanted);
  if (!one.ok()) {
    throw std::runtime_error(fmt::format("the unit of its values is '{}', expected {}", unit,
                                         wanted.empty() ? "none, because they are pure numbers" : "one of " + wanted));
  }
  return one.value;
}

}  // namespace

/// Loads the image libraries with the first image, because most runs need none.
ImageData read_image(const std::string& file, const std::string& dataset) {
  static const auto function = [] {
    const auto module = config::library_folder() / "tofgraph-images.so";
    void* library = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (library == nullptr)
      throw std::runtime_error(fmt::format("images cannot be read: {}: is it installed?", dlerror()));
    return reinterpret_cast<io::ReadImage*>(dlsym(library, io::read_image_symbol));
  }();
  io::ImageData image;
  std::string problem;
  function(file, dataset, image, problem);
  if (!problem.empty()) throw std::runtime_error(problem);
  return image;
}

ImageFile::ImageFile(std::string parameter, std::string file, const std::string& dataset, const std::string& unit,
                     const std::string& wanted, bool mask)
    : parameter_(std::move(parameter)), file_(std::move(file)), unit_(wanted) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file_, error))
    throw std::runtime_error(fmt::format("there is no file {}", file_));
  ImageData image = read_image(file_, dataset);
  if (image.depth != 1) throw std::runtime_error(file_ + " has 3 dimensions, expected rows x columns");
  if (image.of_bytes && !mask)
    throw std::runtime_error(file_ + " has 8 bits per pixel, expected 16 (PNG) or floating point (TIFF)");
  values_ = std::move(image.values);
  const double scale = scale_of(unit.empty() ? image.unit : unit, wanted);
  for (double& value : values_) {
    if (!std::isfinite(value)) throw std::runtime_error(fmt::format("{} has values that are not finite", file_));
    value *= scale;
  }
  view_ = image_view(values_.data(), image.rows, image.columns, parameter_.c_str(), unit_.c_str());
}

tofgraph_view image_view(const double* values, std::size_t rows, std::size_t columns, const char* name,
                         const char* unit) {
  tofgraph_view view{};
  view.size = sizeof view;
  view.type = TOFGRAPH_TYPE_F64;
  view.rank = 2;
  view.data = const_cast<double*>(values);  // read-only for plugins
  view.extent[0] = rows;
  view.extent[1] = columns;
  view.stride[1] = sizeof(double);
  view.stride[0] = static_cast<std::int64_t>(columns * sizeof(double));
  view.channel = name;
  view.unit = unit;
  return view;
}

}  // namespace tofgraph::io
