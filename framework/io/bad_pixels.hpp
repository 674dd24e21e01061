// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Bad-pixel map of a camera profile.
#pragma once

#include "config/document.hpp"
#include "io/camera.hpp"

namespace tofgraph::io {

/// Reads the map named by a profile, `FILE` or `{file: FILE, dataset: NAME}`, into the camera: pixels whose value is
/// not 0 are bad. A missing or damaged file, or a map of the wrong size, is reported to the diagnostics. If the profile
/// is stored in a recording and its map is not found, only `missing_bad_pixels` is set.
/// @param named value of the key `bad_pixels`
void read_bad_pixels(const config::Value& named, Camera& camera, config::Diagnostics& diagnostics);

}  // namespace tofgraph::io
