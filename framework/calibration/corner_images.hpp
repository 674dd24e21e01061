// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Conversion of count images to large 8-bit images for OpenCV's detectors. Part of corners.cpp.
#pragma once

#include "calibration/corners.hpp"

#include <opencv2/core.hpp>

namespace tofgraph::calibration {

/// Mapping of counts to grey values: proportional; square root, which brightens dark boards; relative to the mean
/// around each pixel, which removes gradients.
enum class Tones { linear, root, local };

/// Factor by which an image is enlarged for detectors made for larger images.
int scale_for(const Image& image);
/// Enlarged 8-bit image; its range excludes the lowest and highest percent of the counts. Invalid pixels are dark.
cv::Mat enlarged(const Image& image, int scale, Tones tones);
/// Converts a position in the enlarged image to the original image; pixel centres are at integers in both.
cv::Point2d to_image(const cv::Point2f& enlarged, int scale);

BoardSearch find_charuco(const Image& image, const io::Pattern& pattern);  // corners_marked.cpp
BoardSearch find_circles(const Image& image, const io::Pattern& pattern);  // corners_circles.cpp

}  // namespace tofgraph::calibration
