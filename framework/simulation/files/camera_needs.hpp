// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Optional values of a camera's profile that are required by a simulation.
#pragma once

#include "io/camera.hpp"

#include <string>
#include <vector>

namespace tofgraph::simulation {

/// Missing key of a profile.
struct Need {
  std::string key;
  std::string example;  ///< YAML syntax
};

/// Values missing for computing the light of a frame; a search for effects needs them too.
std::vector<Need> missing_for_light(const tofgraph_camera& camera);

bool has_noise(const tofgraph_camera& camera);

/// "gain, contrast and frame_rate"
std::string keys_of(const std::vector<Need>& missing);

/// File of the profile, or its name if it is an installed one.
std::string place_of_profile(const io::Camera& camera);

/// Advice to add them to the profile, with an example of each.
std::string added_to_profile(const io::Camera& camera, const std::vector<Need>& missing);

}  // namespace tofgraph::simulation
