// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Camera profiles: what is known of a camera before anything is measured.
#pragma once

#include "config/document.hpp"
#include "io/camera.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Names of the profiles that came with the program.
std::vector<std::string> profile_names();

/// The file of a profile: one that came with the program, or, where it holds a / or ends in .yaml, a path relative to
/// `base`. Empty when there is no such name.
std::filesystem::path find_profile(const std::string& name, const std::filesystem::path& base);

/// Reads a profile. Mistakes go to the diagnostics; null when there are any.
io::CameraPtr read_profile(const config::Value& document, config::Diagnostics& diagnostics);

/// The profile that a document names, by name or path, or that of a camera's folder. Mistakes go to the diagnostics,
/// missing and changed files of the folder among them; null when there are any.
io::CameraPtr find_camera(const config::Value& name, config::Diagnostics& diagnostics);

/// Reads a profile by name or path. @throws config::ConfigurationError with every mistake.
io::CameraPtr load_profile(const std::filesystem::path& file);

/// The same; mistakes and warnings go to the diagnostics; null when there are mistakes.
/// @throws config::ConfigurationError when the file cannot be read
io::CameraPtr load_profile(const std::filesystem::path& file, config::Diagnostics& diagnostics);

/// Coefficients of a profile's `distortion`: k1 k2 k3 k4 of a fisheye; else k1 k2 p1 p2 k3, and k4 k5 k6 s1 s2 s3 s4
/// where the lens has any of these.
std::vector<double> distortion_of(const tofgraph_camera& camera);

/// A profile's text that reads as this camera: every value but its rays, which are those of the lens model.
std::string profile_text(const tofgraph_camera& camera);

}  // namespace tofgraph::io
