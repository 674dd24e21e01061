// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Pipelines of a recorder: from a live camera to a capture, and for viewing its image.
#pragma once

#include "config/document.hpp"
#include "graph/graph.hpp"

#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::recording {

/// Choice of the camera, as on the command line.
struct CameraRequest {
  std::string spec;                   ///< camcube, camcube:usb, replay:FILE, simulated:SCENE.yaml
  std::string profile;                ///< by name or path; empty: the camera's own
  std::vector<std::string> settings;  ///< PARAMETER=VALUE of the camera, or capture.PARAMETER=VALUE
  double integration_time = std::numeric_limits<double>::quiet_NaN();  ///< s; NaN: that of the settings, or default
};

/// Names of the nodes.
inline constexpr const char *camera_node_name = "camera", *capture_node_name = "capture", *depth_node_name = "depth";

/// Graph camera -> capture_writer. @param comment stored in the capture @param sources switched on; empty: all
/// @throws config::ConfigurationError listing all errors
std::unique_ptr<graph::Graph> recording_graph(const CameraRequest& camera, const std::filesystem::path& capture,
                                              const std::string& comment, const std::vector<std::string>& sources,
                                              const graph::GraphOptions& options);

/// Graph camera -> decoder -> distance model; the frames of `depth` have depth, amplitude and flags. Settings of the
/// capture are ignored. @throws config::ConfigurationError
std::unique_ptr<graph::Graph> looking_graph(const CameraRequest& camera, const graph::GraphOptions& options);

/// Identity of a graph's camera; empty if unknown.
struct CameraIdentity {
  std::string name, profile, serial;  ///< profile: its text
};
CameraIdentity identity_of(const graph::Graph& graph);

}  // namespace tofgraph::recording
