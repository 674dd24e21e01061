// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph record`, implemented in record_module.cpp.
#pragma once

#include "recording/pipelines.hpp"

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace tofgraph::cli {

struct RecordArguments {
  recording::CameraRequest camera;
  std::filesystem::path out, plan;
  std::uint64_t frames = 0;  ///< 0: no limit, or the plan's number
  std::string duration;      ///< as written, "30 s"
  std::string comment;
  std::string tolerance, alignment;  ///< for a plan, as written, "250 mm"
  bool still = false;                ///< for a plan: starts when the board stands still
  bool align = false;                ///< records nothing, displays the position of the board
  bool force = false, quiet = false;
  std::vector<std::filesystem::path> plugin_folders;
};

}  // namespace tofgraph::cli
