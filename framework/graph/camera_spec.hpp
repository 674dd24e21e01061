// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A live camera as it is named on the command line: `camcube:usb`, `replay:FILE`, `simulated:SCENE.yaml`.
#pragma once

#include "config/document.hpp"

#include <string>

namespace tofgraph::graph {

inline constexpr std::string_view camera_specs =
    "camcube, camcube:usb, camcube:pmdsdk, replay:FILE, simulated:SCENE.yaml";

/// True for a word in the place of a stage that names a camera with what it is reached by: it has a colon.
bool is_camera_spec(std::string_view word);

/// The node that a camera's specification stands for: `stage: camcube` and the parameters that choose its backend.
/// Paths keep the specification's place, so that relative ones are relative to what it was written in.
/// @param at where it was written @throws config::ConfigurationError
config::Value camera_node(const std::string& spec, const config::Position& at);

}  // namespace tofgraph::graph
