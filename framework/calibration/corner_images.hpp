// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Images of counts as OpenCV's detectors want them: large and of eight bits. Part of corners.cpp.
#pragma once

#include "calibration/corners.hpp"

#include <opencv2/core.hpp>

namespace tofgraph::calibration {

/// Mapping of counts to grey: proportional; square root, which brightens dark boards; relative to the mean about each
/// pixel, which removes gradients.
enum class Tones { linear, root, local };

/// Factor by which the image has to be enlarged for detectors made for larger ones.
int scale_for(const Image& image);
/// Eight bits, between the first and the last percent of the counts. Invalid pixels are dark.
cv::Mat enlarged(const Image& image, int scale, Tones tones);
/// A place of the enlarged image in the image; a pixel's centre at integers in both.
cv::Point2d to_image(const cv::Point2f& enlarged, int scale);

BoardSearch find_charuco(const Image& image, const io::Pattern& pattern);  // corners_marked.cpp
BoardSearch find_circles(const Image& image, const io::Pattern& pattern);  // corners_circles.cpp

}  // namespace tofgraph::calibration
