// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file What sinks that write one file a frame check before the first.
#pragma once

#include <tofgraph/stage.hpp>

#include <string>

#include "io/output_file.hpp"

namespace tofgraph {

/// The names of the files. A path without {frame} is right for a single frame; where more may come, _{frame:06} is put
/// before its extension, and the user is told.
/// @throws ConfigError for the parameter `path`: no pattern, not writable, or a file is there that may not be replaced
inline io::OutputPattern frame_files(const Stage& stage, const Setup& setup, const std::string& path, bool overwrite) {
  io::OutputPattern pattern;
  try {
    pattern = io::OutputPattern(path);
  } catch (const std::exception& problem) {
    throw ConfigError("path", problem.what());
  }
  if (!pattern.numbered() && setup.stream().frames != 1) {
    pattern = pattern.with_number();
    stage.warn("path names one file where more than one frame may come: they are written to " + pattern.text());
  }
  const std::string problem = io::output_problem(pattern, overwrite || setup.overwrite());
  if (!problem.empty()) throw ConfigError("path", problem);
  return pattern;
}

}  // namespace tofgraph
