// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Files of images: HDF5, PNG, TIFF, NumPy. A module, so that what never reads one links none of their libraries.
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <xtensor/xarray.hpp>
#include <xtensor/xnpy.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "io/captures/capture_map.hpp"
#include "io/image_data.hpp"

namespace tofgraph::io {
namespace {

ImageData from_picture(const std::string& file) {
  const cv::Mat picture = cv::imread(file, cv::IMREAD_UNCHANGED);
  if (picture.empty()) throw std::runtime_error(file + " cannot be read as a picture");
  if (picture.channels() != 1)
    throw std::runtime_error(
        fmt::format("{} has {} colour channels, expected one value per pixel", file, picture.channels()));
  if (picture.depth() == CV_8U)
    throw std::runtime_error(file + " has 8 bits per pixel, expected 16 (PNG) or floating point (TIFF)");
  cv::Mat values;
  picture.convertTo(values, CV_64F);
  return {{values.begin<double>(), values.end<double>()},
          static_cast<std::size_t>(values.rows),
          static_cast<std::size_t>(values.cols),
          ""};
}

template <class T> bool read_npy_as(const std::string& file, ImageData& image) {
  try {
    const xt::xarray<T> array = xt::load_npy<T>(file);
    if (array.dimension() != 2)
      throw std::invalid_argument(fmt::format("{} has {} dimensions, expected 2", file, array.dimension()));
    image.rows = array.shape(0);
    image.columns = array.shape(1);
    for (std::size_t r = 0; r < image.rows; ++r)
      for (std::size_t c = 0; c < image.columns; ++c) image.values.push_back(static_cast<double>(array(r, c)));
    return true;
  } catch (const std::invalid_argument&) {
    throw;
  } catch (const std::runtime_error&) {
    return false;  // another type of element, or no such file
  }
}

ImageData from_npy(const std::string& file) {
  ImageData image;
  const bool read = read_npy_as<double>(file, image) || read_npy_as<float>(file, image) ||
                    read_npy_as<std::uint16_t>(file, image) || read_npy_as<std::int16_t>(file, image) ||
                    read_npy_as<std::int32_t>(file, image) || read_npy_as<std::uint8_t>(file, image);
  if (!read) throw std::runtime_error(file + " is not a .npy of float64, float32 or whole numbers of up to 32 bits");
  return image;
}

ImageData load(const std::string& file, const std::string& dataset) {
  std::string ending = std::filesystem::path(file).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool hdf5 = ending == ".h5" || ending == ".hdf5";
  if (!dataset.empty() && !hdf5) throw std::runtime_error(file + " has no datasets: only .h5 files have");
  if (hdf5) return read_pixel_map(file, dataset);
  if (ending == ".npy") return from_npy(file);
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
