// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Specification of a live camera on the command line: `camcube:usb`, `replay:FILE`, `simulated:SCENE.yaml`.
#pragma once

#include "config/document.hpp"

#include <string>

namespace tofgraph::graph {

inline constexpr std::string_view camera_specs =
    "camcube, camcube:usb, camcube:pmdsdk, replay:FILE, simulated:SCENE.yaml";

/// Returns whether a word in the position of a stage is a camera specification, i.e. contains a colon.
bool is_camera_spec(std::string_view word);

/// Returns the node for a camera specification: `stage: camcube` and the parameters that choose its backend. Relative
/// paths are resolved against the place where the specification was written.
/// @param at where it was written @throws config::ConfigurationError
config::Value camera_node(const std::string& spec, const config::Position& at);

}  // namespace tofgraph::graph
