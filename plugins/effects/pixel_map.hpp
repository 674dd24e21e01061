// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A map of the pixels as a parameter of an effect.
#pragma once

#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cmath>

#include "io/capture_map.hpp"

namespace tofgraph {

/// Values between pixels; 0 where there is no map.
class PixelMap {
 public:
  /// For a stage's prepare: an empty file gives the map that is 0. @throws ConfigError naming the parameter
  static PixelMap read(const Setup& setup, const char* parameter, const std::string& file, const std::string& dataset) {
    PixelMap map;
    if (file.empty()) return map;
    map.rows_ = setup.camera().height;
    map.columns_ = setup.camera().width;
    try {
      map.values_ = io::read_pixel_map(file, dataset, map.rows_, map.columns_);
    } catch (const std::exception& problem) {
      throw ConfigError(parameter, problem.what());
    }
    setup.uses_file(file);
    return map;
  }

  /// Bilinear, constant beyond the border. @param u, v column and row
  double at(double u, double v) const {
    if (!values_) return 0;
    const double x = std::clamp(u, 0.0, static_cast<double>(columns_ - 1));
    const double y = std::clamp(v, 0.0, static_cast<double>(rows_ - 1));
    const auto column = std::min(static_cast<std::size_t>(x), columns_ - 1 - (columns_ > 1 ? 1 : 0));
    const auto row = std::min(static_cast<std::size_t>(y), rows_ - 1 - (rows_ > 1 ? 1 : 0));
    const double right = x - static_cast<double>(column), below = y - static_cast<double>(row);
    const auto value = [&](std::size_t r, std::size_t c) {
      return (*values_)[std::min(r, rows_ - 1) * columns_ + std::min(c, columns_ - 1)];
    };
    return std::lerp(std::lerp(value(row, column), value(row, column + 1), right),
                     std::lerp(value(row + 1, column), value(row + 1, column + 1), right), below);
  }

 private:
  std::size_t rows_ = 0, columns_ = 0;
  std::shared_ptr<const std::vector<double>> values_;
};

}  // namespace tofgraph
