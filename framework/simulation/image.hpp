// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Brightness image printed on a card.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace tofgraph::simulation {

class Image {
 public:
  /// Image with 8 or 16 bits, colours converted to grey; linear scale with 0 as black and the maximum of its type as
  /// 1. @throws std::runtime_error if it cannot be read
  static Image load(const std::filesystem::path& file);

  /// @param values rows x columns, 0..1
  Image(std::size_t rows, std::size_t columns, std::vector<float> values);

  std::size_t rows() const { return rows_; }
  std::size_t columns() const { return columns_; }
  /// Value of the pixel at a position. @param across, down 0..1 over the whole image
  double nearest(double across, double down) const;
  /// Bilinear interpolation between the four nearest pixel centres; border pixels are extended.
  double between(double across, double down) const;

 private:
  double at(std::size_t row, std::size_t column) const { return values_[row * columns_ + column]; }

  std::size_t rows_, columns_;
  std::vector<float> values_;
};

}  // namespace tofgraph::simulation
