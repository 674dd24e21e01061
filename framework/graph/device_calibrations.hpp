// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The calibrations of a camera's folder in a pipeline: corrections that it does not name are inserted, parameters that
/// it leaves out are filled in. Lens, noise and bad pixels need neither: they are in the folder's profile.
#pragma once

#include "graph/pipeline.hpp"
#include "graph/plugin.hpp"
#include "io/camera_folder.hpp"

#include <optional>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Inserts model_correction and offset_correction, in this order and as far as the folder has what they take, behind
/// every node that makes distances from raw samples; without such a node behind the one that the first stage for
/// distances reads. A pipeline that names one of the two stages itself is left as it is.
/// @param at place of the camera in the pipeline, which the inserted nodes get
/// @returns what was inserted and what is not used, for explain; the latter also as a warning
std::vector<std::string> insert_corrections(PipelineSpec& pipeline, const io::CameraFolder& folder,
                                            const PluginRegistry& registry, const config::Position& at,
                                            config::Diagnostics& diagnostics);

/// The folder's file for each parameter that the node leaves out: a parameter of kind INPUT_FILE names in its `choices`
/// the kinds of calibrations that it takes.
std::vector<config::Entry> calibration_entries(const NodeSpec& node, const Plugin& stage,
                                               const io::CameraFolder& folder);

/// Reports a recording of another device than the folder's, an error unless `other_serial`, and calibrations used
/// outside the date and temperature that they are valid for, warnings.
/// @param source what is known of the recording, JSON
void check_recording(const io::CameraFolder& folder, const std::string& source, bool other_serial,
                     const config::Position& at, config::Diagnostics& diagnostics);

}  // namespace tofgraph::graph
