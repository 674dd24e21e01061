// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Copies of frames for the live view, and the description of their nodes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace tofgraph::live {

/// Channel of one frame. Exactly one of the two vectors has values: lengths, amplitudes, points; or flags.
struct Plane {
  std::string name, unit;
  std::size_t rows = 0, columns = 0, depth = 1;  ///< depth: values per pixel, 3 for points
  std::vector<float> values;
  std::vector<std::uint16_t> bits;
};

/// Images of one node. node: its index in the list of NodeInfo.
struct NodePicture {
  std::size_t node = 0;
  std::vector<Plane> planes;
};

/// Copy of one frame, with the nodes that are being viewed.
struct Picture {
  std::uint64_t frame = 0;
  std::int64_t timestamp_ns = 0;
  double integration_time = 0;  ///< s
  std::vector<NodePicture> nodes;
};

/// Channel of a node, known before the first frame.
struct ChannelInfo {
  std::string name, unit, applied;  ///< applied: stages so far, blank-separated
};

/// Node whose frames can be viewed. The rays live as long as the stage.
struct NodeInfo {
  std::string name;
  std::vector<ChannelInfo> channels;
  std::size_t rows = 0, columns = 0;  ///< of the camera; 0: none
  const float* rays = nullptr;        ///< rows x columns x 3 unit vectors; null: no camera
  double focal_length = 0;            ///< m, NaN: unknown
  double focal_px[2] = {}, principal_point[2] = {}, distortion[5] = {};
  std::string camera;
};

}  // namespace tofgraph::live
