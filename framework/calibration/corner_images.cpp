// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/corner_images.hpp"

#include <opencv2/imgproc.hpp>
#include <tofgraph/physics/robust.hpp>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::calibration {

namespace {

/// Value of a pixel. If it is not finite: median of its finite neighbours, or `otherwise` if there are none.
double value_or_neighbours(const Image& image, std::size_t i, double otherwise) {
  if (std::isfinite(image.values[i])) return image.values[i];
  const std::size_t u = i % image.width, v = i / image.width;
  std::vector<double> around;
  for (std::size_t y = v - std::min<std::size_t>(v, 1); y <= std::min(v + 1, image.height - 1); ++y) {
    for (std::size_t x = u - std::min<std::size_t>(u, 1); x <= std::min(u + 1, image.width - 1); ++x) {
      if (const double value = image.values[y * image.width + x]; std::isfinite(value)) around.push_back(value);
    }
  }
  return around.empty() ? otherwise : physics::median(around);
}

}  // namespace

int scale_for(const Image& image) {
  constexpr double wanted = 800;  // px, since detectors use neighbourhoods of several px
  const auto side = static_cast<double>(std::min(image.width, image.height));
  return std::clamp(physics::to_integer(wanted / std::max(side, 1.0), 1), 1, 8);
}

cv::Mat enlarged(const Image& image, int scale, Tones tones) {
  cv::Mat counts(static_cast<int>(image.height), static_cast<int>(image.width), CV_32F);
  std::vector<double> sorted;
  for (const double value : image.values)
    if (std::isfinite(value)) sorted.push_back(value);
  if (sorted.empty()) return cv::Mat::zeros(counts.size() * scale, CV_8U);
  std::ranges::sort(sorted);
  double low = sorted[sorted.size() / 100], high = sorted[sorted.size() - 1 - sorted.size() / 100];
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    const double value = value_or_neighbours(image, i, low);
    counts.at<float>(static_cast<int>(i / image.width), static_cast<int>(i % image.width)) =
        static_cast<float>(std::clamp(value, low, high) - low);
  }
  high = std::max(high - low, 1e-12);
  if (tones == Tones::root) {
    cv::sqrt(counts, counts);
    high = std::sqrt(high);
  }
  if (tones == Tones::local) {
    cv::Mat mean, square, deviation;
    const double width = static_cast<double>(std::min(image.width, image.height)) / 10;
    cv::GaussianBlur(counts, mean, cv::Size(), width);
    counts -= mean;
    cv::GaussianBlur(counts.mul(counts), square, cv::Size(), width);
    cv::sqrt(square + 1e-4 * high * high, deviation);
    counts = counts / deviation + 2;
    high = 4;
  }
  cv::Mat large, grey;
  cv::resize(counts, large, cv::Size(), scale, scale, cv::INTER_CUBIC);
  large.convertTo(grey, CV_8U, 255 / high);
  return grey;
}

cv::Point2d to_image(const cv::Point2f& p, int scale) { return {(p.x + 0.5) / scale - 0.5, (p.y + 0.5) / scale - 0.5}; }

}  // namespace tofgraph::calibration
