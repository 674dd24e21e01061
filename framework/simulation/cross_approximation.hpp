// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Corrections as sums of a few products, by adaptive cross approximation (Bebendorf, Numer. Math. 86, 2000): of the
/// matrix of all pixels and all nodes only a few rows and columns are solved. For correction*.cpp only.
#pragma once

#include "simulation/correction.hpp"

#include <cmath>
#include <limits>
#include <vector>

namespace tofgraph::simulation {

/// Amplitude of the i-th amplitude node, counts.
inline double node_amplitude(const CorrectionTables& tables, std::size_t i) {
  const std::size_t octave = i / nodes_per_octave, part = i % nodes_per_octave;
  return tables.weakest * std::exp2(static_cast<double>(octave)) * (1 + static_cast<double>(part) / nodes_per_octave);
}

/// Nodes of the tables, and the solutions at them.
class Nodes {
 public:
  Nodes(const CameraInverse& inverse, const CorrectionTables& shape, std::vector<Acquisition> corners)
      : inverse_(inverse), shape_(shape), corners_(std::move(corners)) {}

  std::size_t per_corner() const { return shape_.amplitudes * shape_.distances; }
  std::size_t size() const { return corners_.size() * per_corner(); }
  std::size_t corners() const { return corners_.size(); }
  /// Distance without correction, m.
  double distance(std::size_t node) const {
    return shape_.first + shape_.step * static_cast<double>(node % shape_.distances);
  }
  /// Measured distance, m, unwrapped.
  double measured(std::size_t node) const {
    return distance(node) + shape_.shifts[node % per_corner() / shape_.distances];
  }
  double amplitude(std::size_t node) const { return node_amplitude(shape_, node % per_corner() / shape_.distances); }
  bool is_in_range(double true_distance) const {
    return true_distance >= shape_.first && true_distance < shape_.first + shape_.range;
  }

  struct Place {
    std::uint32_t pixel;
    std::size_t node;
    double near = 0;    ///< m: approximate correction
    double lifted = 0;  ///< m: multiple of the range added to the measured distance
  };
  /// Tolerance of a correction, m: 3 um, a thousandth of the correction, 0.5 % of the noise of one frame.
  double allowed(std::size_t node, double correction) const;
  /// Corrections, m; NaN if there is no solution.
  std::vector<double> solve(const std::vector<Place>& places) const;

 private:
  const CameraInverse& inverse_;
  const CorrectionTables& shape_;
  std::vector<Acquisition> corners_;
};

/// correction(pixel, node) = sum of pixels[r][pixel] nodes[r][node].
struct Products {
  std::vector<std::vector<double>> pixels, nodes;
  double operator()(std::size_t pixel, std::size_t node) const {
    double sum = 0;
    for (std::size_t r = 0; r < nodes.size(); ++r) sum += pixels[r][pixel] * nodes[r][node];
    return sum;
  }
};

/// Finds the products. The solver evaluates one test node per pixel, by which the residual is estimated, and a row and
/// a column per product.
class CrossApproximation {
 public:
  CrossApproximation(const Nodes& nodes, const CorrectionTables& shape, const CameraInverse& inverse,
                     double metres_per_radian)
      : nodes_(nodes),
        shape_(shape),
        count_(inverse.pixels().size()),
        middle_(inverse.middle()),
        metres_per_radian_(metres_per_radian) {}

  /// @returns 0, or if the number of products is insufficient the most significant residual, m
  double run(std::size_t max_products);
  const Products& products() const { return products_; }
  /// Factor of sigma at each node, at the image centre; very large if there is no solution or two.
  const std::vector<double>& factors() const { return factors_; }

 private:
  void find_factors(const std::vector<double>& first);
  void find_doubtful(const std::vector<double>& first);
  /// Returns true if the noise changes too much for the correction to justify a product.
  bool is_doubtful(std::size_t node) const { return !(std::abs(std::log(factors_[node])) < std::log(1.5)); }
  void add(std::vector<double> pixels, std::vector<double> nodes);
  std::vector<double> row(std::uint32_t pixel) const;
  void choose_tests();
  bool add_cross(std::uint32_t pixel);

  const Nodes& nodes_;
  const CorrectionTables& shape_;
  std::size_t count_;
  std::uint32_t middle_;
  Products products_;
  double metres_per_radian_;
  std::vector<double> factors_;
  std::vector<Nodes::Place> tests_;  // one per pixel
  std::vector<double> tested_;
};

}  // namespace tofgraph::simulation
