// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Images as 16-bit codes; the format is described in docs/live_view.md.
#pragma once

#include "live/picture.hpp"

#include <span>
#include <vector>

namespace tofgraph::live {

/// Linear coding: value = offset + (code - 1) step; code 0 means no value (NaN). The step is 1, 2 or 5 times a power of
/// ten, the finest that covers all values, so the error is at most half a step.
struct Coding {
  double offset = 0, step = 1;
};

/// Coding for the finite values of an image.
Coding coding_of(std::span<const float> values);

/// Writes the codes: 2 bytes for each value, little-endian.
void write_codes(char* bytes, std::span<const float> values, const Coding& coding);

/// Distances of points along the rays of their pixels, m; NaN for missing points. Empty if a point is more than 0.1 mm
/// away from its ray, because the cloud was moved or is not ordered by pixels.
std::vector<float> along_rays(const PlaneView& points, const NodeInfo& node);

/// Channels of a node for the page.
CodedChannels coded_channels(std::span<const PlaneView> planes, const NodeInfo& node);

}  // namespace tofgraph::live
