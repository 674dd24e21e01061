// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Frames as the live view sends them, and the description of their nodes.
#pragma once

#include <nlohmann/json.hpp>

#include <boost/container/vector.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::live {

/// Channel of one frame. Exactly one of the two containers has values: lengths, amplitudes, points; or flags.
template <class Values, class Bits> struct BasicPlane {
  std::string name, unit;
  std::size_t rows = 0, columns = 0, depth = 1;  ///< depth: values per pixel, 3 for points
  Values values;
  Bits bits;
};
using Plane = BasicPlane<std::vector<float>, std::vector<std::uint16_t>>;
using PlaneView = BasicPlane<std::span<const float>, std::span<const std::uint16_t>>;

inline PlaneView view_of(const Plane& p) { return {p.name, p.unit, p.rows, p.columns, p.depth, p.values, p.bits}; }
inline Plane copy_of(const PlaneView& p) {
  return {
      p.name, p.unit, p.rows, p.columns, p.depth, {p.values.begin(), p.values.end()}, {p.bits.begin(), p.bits.end()}};
}

/// Channels of a node as the page gets them: docs/live_view.md.
struct CodedChannels {
  nlohmann::json descriptions;           ///< array of objects; `at` counts from the first byte
  boost::container::vector<char> bytes;  ///< a multiple of 8
};

/// Channels of one node, in one form or in both.
struct NodePicture {
  std::size_t node = 0;  ///< index in the list of NodeInfo
  std::optional<std::vector<Plane>> planes;
  std::shared_ptr<const CodedChannels> coded;  ///< may be null
};

/// Nodes that clients are waiting for, as bits.
struct Wanted {
  std::uint64_t planes = 0, coded = 0;
  bool any() const { return (planes | coded) != 0; }
};

/// Frame with the nodes that are being viewed.
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
  double focal_px[2] = {}, principal_point[2] = {};
  std::string camera;
  std::string distortion_model;  ///< of Foxglove's CameraCalibration; empty: it has none for this lens
  std::vector<double> distortion;
};

}  // namespace tofgraph::live
