// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Changes between the conditions of a scene.
#pragma once

#include "simulation/files/objects.hpp"
#include "simulation/files/scene_file.hpp"

#include <string_view>
#include <vector>

namespace tofgraph::simulation {

/// Part of "board.distance" before the dot; empty for a key of the scene.
inline std::string_view object_in(std::string_view key) {
  const auto dot = key.find('.');
  return dot == std::string_view::npos ? std::string_view{} : key.substr(0, dot);
}

/// Reads `sequence:`; the keys must be those of an object (`board.distance`) or of the scene.
std::vector<SequenceStep> read_sequence(const config::Value& list, const SceneFile& scene,
                                        config::Diagnostics& diagnostics);

/// Reads every value of the sequence once, in place of that of the scene.
void check_values(const SceneFile& scene, config::Diagnostics& diagnostics);

/// Reports every condition in which the camera cannot see an object; repeated errors once.
void check_geometry(const SceneFile& scene, config::Diagnostics& diagnostics);

}  // namespace tofgraph::simulation
