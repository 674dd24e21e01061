// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Camera profiles: properties of a camera that are known before any measurement.
#pragma once

#include "config/document.hpp"
#include "io/camera.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Names of the profiles installed with the program.
std::vector<std::string> profile_names();

/// File of a profile: an installed one, or, if the name contains a / or ends in .yaml, a path relative to `base`.
/// Empty if there is no such profile.
std::filesystem::path find_profile(const std::string& name, const std::filesystem::path& base);

/// Reads a profile. Errors are reported to the diagnostics; null if there are any.
io::CameraPtr read_profile(const config::Value& document, config::Diagnostics& diagnostics);

/// Profile named by a document, by name or path, or that of a camera's folder. Errors are reported to the diagnostics,
/// including missing and changed files of the folder; null if there are any.
io::CameraPtr find_camera(const config::Value& name, config::Diagnostics& diagnostics);

/// Camera named by a document, as written in a document in another folder: a name is kept, a path to a profile or to a
/// camera's folder becomes relative to that folder.
std::string camera_name_in(const config::Value& name, const std::filesystem::path& folder);

/// Reads a profile by name or path. @throws config::ConfigurationError with all errors.
io::CameraPtr load_profile(const std::filesystem::path& file);

/// The same; errors and warnings are reported to the diagnostics; null if there are errors.
/// @throws config::ConfigurationError if the file cannot be read
io::CameraPtr load_profile(const std::filesystem::path& file, config::Diagnostics& diagnostics);

/// Keys of a profile's `distortion`: k1 k2 k3 k4 for a fisheye; otherwise k1 k2 p1 p2 k3, and k4 k5 k6 s1 s2 s3 s4 if
/// the lens has any of these.
std::vector<double> distortion_of(const tofgraph_camera& camera);

/// Profile text that reproduces this camera: every value except its rays, which are those of the lens model.
std::string profile_text(const tofgraph_camera& camera);

}  // namespace tofgraph::io
