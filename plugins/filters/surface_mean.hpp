// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Depth and reflectivity of an image, averaged over pixels of the same surface.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "plugins/filters/offset_rows.hpp"

namespace tofgraph {

/// Images with a border of NaN, so that windows need no special case at the image's edge.
class Surface {
 public:
  static constexpr std::size_t border = 7;

  void resize(std::size_t rows, std::size_t columns) {
    if (rows == rows_ && columns == columns_) return;
    rows_ = rows;
    columns_ = columns;
    stride_ = columns + 2 * border;
    for (std::vector<float>* image : {&depth_, &reflectivity_, &mean_depth_, &mean_reflectivity_})
      image->assign((rows + 2 * border) * stride_, std::numeric_limits<float>::quiet_NaN());
    path_.resize(rows * columns);
    error_.resize(rows * columns);
    beyond_.resize(columns);
  }
  float* depth(std::size_t row) { return &depth_[at(row)]; }
  float* reflectivity(std::size_t row) { return &reflectivity_[at(row)]; }
  float* path(std::size_t row) { return &path_[row * columns_]; }
  float* error(std::size_t row) { return &error_[row * columns_]; }
  std::int32_t* beyond() { return beyond_.data(); }  ///< values of one row

  /// Averages over a square of pixels whose depth and reflectivity are close to the centre's, first along rows, then
  /// along columns. @param window its side, odd, at most 2 border + 1 @param by_reflectivity whether to compare it too
  /// @param average computes one AverageRow
  template <class Average> void average(std::size_t window, bool by_reflectivity, Average&& average) {
    constexpr float same_depth = 0.03F, same_reflectivity = 0.25F;  // relative to the pixel's own value
    AverageRow row{.columns = columns_,
                   .half = static_cast<std::ptrdiff_t>(window / 2),
                   .depth_limit = same_depth,
                   .limit = by_reflectivity ? same_reflectivity : std::numeric_limits<float>::infinity()};
    for (std::size_t v = 0; v < rows_; ++v) {
      row.step = 1;
      row.depth = &depth_[at(v)];
      row.reflectivity = &reflectivity_[at(v)];
      row.mean_depth = &mean_depth_[at(v)];
      row.mean_reflectivity = &mean_reflectivity_[at(v)];
      average(row);
    }
    for (std::size_t v = 0; v < rows_; ++v) {
      row.step = static_cast<std::ptrdiff_t>(stride_);
      row.depth = &mean_depth_[at(v)];
      row.reflectivity = &mean_reflectivity_[at(v)];
      row.mean_depth = &depth_[at(v)];
      row.mean_reflectivity = &reflectivity_[at(v)];
      average(row);
    }
  }

 private:
  std::size_t at(std::size_t row) const { return (row + border) * stride_ + border; }

  std::size_t rows_ = 0, columns_ = 0, stride_ = 0;
  std::vector<float> depth_, reflectivity_, mean_depth_, mean_reflectivity_, path_, error_;
  std::vector<std::int32_t> beyond_;
};

}  // namespace tofgraph
