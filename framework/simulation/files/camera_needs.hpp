// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Optional values of a camera's profile that its simulation needs.
#pragma once

#include "io/camera.hpp"

#include <string>
#include <vector>

namespace tofgraph::simulation {

/// A key that is not there.
struct Need {
  std::string key;
  std::string example;  ///< as it would be written
};

/// Missing values for computing the light of a frame; a search for effects needs them too.
std::vector<Need> missing_for_light(const tofgraph_camera& camera);

bool has_noise(const tofgraph_camera& camera);

/// "gain, contrast and frame_rate"
std::string keys_of(const std::vector<Need>& missing);

/// The profile's file, or how it is called where it has none of the user's.
std::string place_of_profile(const io::Camera& camera);

/// The advice to write them into the profile, with an example of each.
std::string added_to_profile(const io::Camera& camera, const std::vector<Need>& missing);

}  // namespace tofgraph::simulation
