// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conversion of camera files of other programs to profiles: ROS camera_info and OpenCV (YAML, JSON), librealsense and
/// Azure Kinect (JSON), mrcal (.cameramodel).
#pragma once

#include <filesystem>
#include <string>

namespace tofgraph::io {

/// Profile text with the lens from such a file.
/// @param depth_mode of an Azure Kinect, which selects the sensor region: nfov, nfov_binned, wfov, wfov_binned
/// @throws config::ConfigurationError for a file of an unknown kind, missing content, or a lens that profiles do not
/// support
std::string profile_of_vendor_file(const std::filesystem::path& file, const std::string& depth_mode = {});

}  // namespace tofgraph::io
