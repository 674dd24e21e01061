// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Conversion of frames to messages of Foxglove's schemas, in JSON.
#pragma once

#include "live/picture.hpp"

#include <tofgraph/plugin.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace tofgraph::live {

enum class FoxgloveKind { point_cloud, raw_image, camera_calibration };

/// Topic of a node: /NODE/points, /NODE/CHANNEL, /NODE/camera.
struct FoxgloveTopic {
  std::string name;
  FoxgloveKind kind;
  std::size_t node;
  std::string channel;  ///< of an image or cloud
};

/// Sets the lens of a node in the terms of CameraCalibration: kannala_brandt is OpenCV's fisheye. Leaves it empty if it
/// is a table of rays or has a thin prism or a skew. https://docs.foxglove.dev/docs/sdk/schemas/camera-calibration
void set_lens(const tofgraph_camera& camera, NodeInfo& node);

/// @returns no camera for a lens that CameraCalibration cannot hold
std::vector<FoxgloveTopic> foxglove_topics(const std::vector<NodeInfo>& nodes);
const char* foxglove_schema_name(FoxgloveKind kind);
/// JSON schema as text. Binary data are base64.
std::string foxglove_schema(FoxgloveKind kind);
/// @param time_ns since 1970 @returns null if the frame has no such channel
nlohmann::json foxglove_message(const FoxgloveTopic& topic, const NodeInfo& node, const NodePicture& picture,
                                std::uint64_t time_ns);

}  // namespace tofgraph::live
