// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Camera files of other programs as profiles: ROS camera_info and OpenCV (YAML, JSON), librealsense and Azure Kinect
/// (JSON), mrcal (.cameramodel).
#pragma once

#include <filesystem>
#include <string>

namespace tofgraph::io {

/// Text of a profile with the lens that such a file states.
/// @param depth_mode of an Azure Kinect, which decides the part of the sensor: nfov, nfov_binned, wfov, wfov_binned
/// @throws config::ConfigurationError a file of no known kind, what is missing in it, or a lens that a profile cannot
/// hold
std::string profile_of_vendor_file(const std::filesystem::path& file, const std::string& depth_mode = {});

}  // namespace tofgraph::io
