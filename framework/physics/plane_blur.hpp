// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Gaussian blur of an image with dark surroundings: two matrix products, exact for any width.
#pragma once

#include <Eigen/Dense>

#include <cmath>
#include <complex>

namespace tofgraph::physics {

template <class Value> using PixelMatrix = Eigen::Matrix<Value, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Weights exp(-d^2 / (2 width^2)), normalised to a sum of 1 over an infinite grid.
class PlaneBlur {
 public:
  /// @param width standard deviation in pixels of the image
  PlaneBlur(Eigen::Index rows, Eigen::Index columns, double width)
      : down_(weights(rows, width)), across_(rows == columns ? down_ : weights(columns, width)) {}

  PixelMatrix<double> operator()(const PixelMatrix<double>& image) const { return down_ * image * across_; }
  PixelMatrix<std::complex<double>> operator()(const PixelMatrix<std::complex<double>>& image) const {
    const PixelMatrix<double> real = (*this)(PixelMatrix<double>(image.real())),
                              imaginary = (*this)(PixelMatrix<double>(image.imag()));
    PixelMatrix<std::complex<double>> result(image.rows(), image.cols());
    result.real() = real;
    result.imag() = imaginary;
    return result;
  }

 private:
  static PixelMatrix<double> weights(Eigen::Index size, double width) {
    double sum = 1;
    for (int i = 1; i < 12 * width + 2; ++i) sum += 2 * weight(i, width);
    PixelMatrix<double> matrix(size, size);
    for (Eigen::Index r = 0; r < size; ++r) {
      for (Eigen::Index c = 0; c < size; ++c) matrix(r, c) = weight(static_cast<double>(r - c), width) / sum;
    }
    return matrix;
  }
  static double weight(double distance, double width) { return std::exp(-distance * distance / (2 * width * width)); }

  PixelMatrix<double> down_, across_;
};

}  // namespace tofgraph::physics
