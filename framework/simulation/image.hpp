// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The brightness printed on a card.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace tofgraph::simulation {

class Image {
 public:
  /// An image of 8 or 16 bits, colours become grey; 0 is black, the largest number of its type is 1, linear.
  /// @throws std::runtime_error when it cannot be read
  static Image load(const std::filesystem::path& file);

  /// @param values rows x columns, 0..1
  Image(std::size_t rows, std::size_t columns, std::vector<float> values);

  std::size_t rows() const { return rows_; }
  std::size_t columns() const { return columns_; }
  /// The pixel in which a place lies. @param across, down 0..1 over the whole image
  double nearest(double across, double down) const;
  /// Between the four nearest pixels' centres, bilinear; the border is continued.
  double between(double across, double down) const;

 private:
  double at(std::size_t row, std::size_t column) const { return values_[row * columns_ + column]; }

  std::size_t rows_, columns_;
  std::vector<float> values_;
};

}  // namespace tofgraph::simulation
