// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Applies the calibrations in a camera's folder to a pipeline: inserts the corrections that it does not name and sets
/// the parameters that it leaves out. Lens, noise and bad pixels are part of the folder's profile and need no stage.
#pragma once

#include "graph/pipeline.hpp"
#include "graph/plugin.hpp"
#include "io/camera_folder.hpp"

#include <optional>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Inserts model_correction and offset_correction, in this order and as far as the folder has the files they need,
/// behind every node that computes distances from raw samples; if there is none, behind the node that the first stage
/// for distances reads. A pipeline that names one of the two stages itself is left unchanged.
/// @param at position of the camera in the pipeline, used for the inserted nodes
/// @returns the inserted nodes and the unused calibrations, for explain; unused ones are also reported as a warning
std::vector<std::string> insert_corrections(PipelineSpec& pipeline, const io::CameraFolder& folder,
                                            const PluginRegistry& registry, const config::Position& at,
                                            config::Diagnostics& diagnostics);

/// Returns the folder's file for each parameter that the node leaves out: the `choices` of a parameter of kind
/// INPUT_FILE name the kinds of calibrations that it accepts.
std::vector<config::Entry> calibration_entries(const NodeSpec& node, const Plugin& stage,
                                               const io::CameraFolder& folder);

/// Reports a recording made by a device other than the folder's (an error unless `other_serial`) and calibrations used
/// outside their valid dates or temperatures (warnings).
/// @param source known origin of the recording, JSON
void check_recording(const io::CameraFolder& folder, const std::string& source, bool other_serial,
                     const config::Position& at, config::Diagnostics& diagnostics);

}  // namespace tofgraph::graph
