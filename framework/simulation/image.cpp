// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/image.hpp"

#include "io/picture_decoder.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tofgraph::simulation {
namespace {

/// The pixels' brightness as float, 0..1.
std::vector<float> brightness(const cv::Mat& image) {
  cv::Mat scaled;
  image.convertTo(scaled, CV_32F, image.depth() == CV_8U ? 1 / 255.0 : 1 / 65535.0);
  return {scaled.begin<float>(), scaled.end<float>()};
}

}  // namespace

Image Image::load(const std::filesystem::path& file) {
  io::check_picture(file);
  cv::Mat image;
  try {
    image = io::decode_picture(file, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  } catch (const std::runtime_error& problem) {
    throw std::runtime_error(fmt::format("{} {}", file.string(), problem.what()));
  }
  if (image.depth() != CV_8U && image.depth() != CV_16U)
    throw std::runtime_error(fmt::format("{} has floating-point pixels, expected 8 or 16 bits", file.string()));
  return {static_cast<std::size_t>(image.rows), static_cast<std::size_t>(image.cols), brightness(image)};
}

Image::Image(std::size_t rows, std::size_t columns, std::vector<float> values)
    : rows_(rows), columns_(columns), values_(std::move(values)) {
  if (rows == 0 || columns == 0 || values_.size() != rows * columns)
    throw std::invalid_argument("an image needs rows x columns values, at least one");
}

double Image::nearest(double across, double down) const {
  const auto index = [](double share, std::size_t count) {
    const double last = static_cast<double>(count) - 1;
    const double at = std::clamp(std::floor(share * static_cast<double>(count)), 0.0, last);
    return physics::to_integer(at, std::size_t{0});
  };
  return at(index(down, rows_), index(across, columns_));
}

double Image::between(double across, double down) const {
  const auto place = [](double share, std::size_t count) {
    return std::clamp(share * static_cast<double>(count) - 0.5, 0.0, static_cast<double>(count - 1));
  };
  const double x = place(across, columns_), y = place(down, rows_);
  const auto column = static_cast<std::size_t>(x), row = static_cast<std::size_t>(y);
  const std::size_t next_column = std::min(column + 1, columns_ - 1), next_row = std::min(row + 1, rows_ - 1);
  const double u = x - std::floor(x), v = y - std::floor(y);
  return (1 - v) * ((1 - u) * at(row, column) + u * at(row, next_column)) +
         v * ((1 - u) * at(next_row, column) + u * at(next_row, next_column));
}

}  // namespace tofgraph::simulation
