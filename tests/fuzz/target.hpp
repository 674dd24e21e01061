// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Fuzz targets: every reader of third-party input, with arbitrary bytes.
#pragma once

#include "graph/plugin.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::fuzz {

/// A reader of untrusted bytes.
struct Target {
  std::string_view name;
  std::string_view reads;  ///< description, for --list
  /// Reads the bytes. Returns if they are rejected with an error of the project; any other exception is a finding.
  void (*read)(std::string_view bytes);
};

std::vector<Target> document_targets();   ///< YAML files and units
std::vector<Target> recording_targets();  ///< captures, and files of other programs
std::vector<Target> device_targets();     ///< a USB camera's protocol and packets, plugin descriptors, the live view

/// The project's own plugins.
const graph::PluginRegistry& plugins();

/// File with these bytes in a folder of this process, overwritten by the next call.
std::filesystem::path file_of(std::string_view bytes, const std::string& name);

}  // namespace tofgraph::fuzz
