// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Image files: HDF5, PNG, TIFF, NumPy. A module, so that programs that read none do not link their libraries.
#include <opencv2/core.hpp>

#include <fmt/format.h>

#include <stdexcept>

#include "config/paths.hpp"
#include "io/captures/capture_map.hpp"
#include "io/image_data.hpp"
#include "io/npy.hpp"
#include "io/picture_decoder.hpp"

namespace tofgraph::io {
namespace {

ImageData from_picture(const std::string& file) {
  check_picture(file);
  cv::Mat picture;
  try {
    picture = decode_picture(file, cv::IMREAD_UNCHANGED);
  } catch (const std::runtime_error& problem) {
    throw std::runtime_error(file + " " + problem.what());
  }
  if (picture.channels() != 1)
    throw std::runtime_error(
        fmt::format("{} has {} colour channels, expected one value per pixel", file, picture.channels()));
  cv::Mat values;
  picture.convertTo(values, CV_64F);
  return {.values = {values.begin<double>(), values.end<double>()},
          .rows = static_cast<std::size_t>(values.rows),
          .columns = static_cast<std::size_t>(values.cols),
          .depth = 1,
          .unit = "",
          .of_bytes = picture.depth() == CV_8U};
}

ImageData load(const std::string& file, const std::string& dataset) {
  const std::string ending = config::lower_case_ending(file);
  const bool hdf5 = ending == ".h5" || ending == ".hdf5";
  if (!dataset.empty() && !hdf5) throw std::runtime_error(file + " has no datasets: only .h5 files have");
  if (hdf5) return read_pixel_map(file, dataset);
  if (ending == ".npy") return read_npy(file);
  if (ending == ".png" || ending == ".tif" || ending == ".tiff") return from_picture(file);
  throw std::runtime_error(file + ": expected an image as .h5, .png (16 bit), .tif or .npy");
}

}  // namespace
}  // namespace tofgraph::io

extern "C" __attribute__((visibility("default"))) void tofgraph_read_image(const std::string& file,
                                                                           const std::string& dataset,
                                                                           tofgraph::io::ImageData& image,
                                                                           std::string& problem) {
  try {
    image = tofgraph::io::load(file, dataset);
  } catch (const std::exception& error) {
    problem = error.what();
  }
}
