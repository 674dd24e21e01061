// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The map of bad pixels of a camera profile.
#pragma once

#include "config/document.hpp"
#include "io/camera.hpp"

namespace tofgraph::io {

/// Reads the map that a profile names, `FILE` or `{file: FILE, dataset: NAME}`, into the camera: pixels whose value is
/// not 0 are bad. Mistakes go to the diagnostics: a missing or damaged file, a map of another size than the camera's.
/// A map that the profile inside a recording names and that is not found only becomes `missing_bad_pixels`.
/// @param named the value of the key `bad_pixels`
void read_bad_pixels(const config::Value& named, Camera& camera, config::Diagnostics& diagnostics);

}  // namespace tofgraph::io
