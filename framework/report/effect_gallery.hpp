// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Pictures of every effect at its typical size: distance, amplitude and null channels.
#pragma once

#include "graph/plugin.hpp"

#include <filesystem>
#include <functional>
#include <vector>

namespace tofgraph::report {

struct GalleryOptions {
  bool physical = false;                       ///< light: physical
  std::function<void(double share)> progress;  ///< 0..1; may be empty
};

/// Writes a page (HTML, self-contained) with all effects of a catalogue for a camera.
/// @returns number of effects. @throws std::runtime_error
std::size_t write_effect_gallery(const graph::PluginRegistry& registry, const tofgraph_camera& camera,
                                 const std::filesystem::path& file, const GalleryOptions& options);

}  // namespace tofgraph::report
