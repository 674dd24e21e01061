// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Nearest neighbours among scattered samples, using FLANN's kd-tree.
#pragma once

#include <flann/flann.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace tofgraph::physics {

/// Points in three dimensions with exact search. Several threads may search at the same time.
class NearestSamples {
 public:
  using Point = std::array<double, 3>;

  NearestSamples() = default;
  /// @param points at least one, all coordinates finite
  explicit NearestSamples(std::vector<Point> points)
      : points_(std::make_shared<std::vector<Point>>(std::move(points))),
        tree_(std::make_shared<Tree>(flann::Matrix<double>(points_->front().data(), points_->size(), 3),
                                     flann::KDTreeSingleIndexParams(16))) {
    tree_->buildIndex();
  }

  std::size_t size() const { return points_ ? points_->size() : 0; }

  /// Calls `use(index, squared distance)` for the nearest points in ascending order of distance.
  /// @param count at most 16 are found
  template <class Use> void nearest(const Point& place, std::size_t count, Use&& use) const {
    std::array<std::size_t, 16> index{};
    std::array<double, 16> square{};
    count = std::min({count, size(), index.size()});
    Point query = place;
    flann::Matrix<std::size_t> indices(index.data(), 1, count);
    flann::Matrix<double> squares(square.data(), 1, count);
    tree_->knnSearch(flann::Matrix<double>(query.data(), 1, 3), indices, squares, count,
                     flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED, 0, true));
    for (std::size_t i = 0; i < count; ++i) use(index[i], square[i]);
  }

  /// Returns the indices of all points nearer than a distance, in ascending order of distance.
  std::vector<std::size_t> within(const Point& place, double distance) const {
    Point query = place;
    std::vector<std::vector<std::size_t>> indices;
    std::vector<std::vector<double>> squares;
    tree_->radiusSearch(flann::Matrix<double>(query.data(), 1, 3), indices, squares,
                        static_cast<float>(distance * distance),
                        flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED, 0, true));
    return std::move(indices.front());
  }

 private:
  using Tree = flann::KDTreeSingleIndex<flann::L2_Simple<double>>;
  std::shared_ptr<std::vector<Point>> points_;  // referenced by the tree
  std::shared_ptr<Tree> tree_;
};

}  // namespace tofgraph::physics
