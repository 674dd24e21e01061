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
  std::uint64_t frames = 0;  ///< 0: without limit, or what the plan says
  std::string duration;      ///< as written, "30 s"
  std::string comment;
  std::string tolerance, alignment;  ///< for a plan, as written, "250 mm"
  bool still = false;                ///< for a plan: begins when the board stands still
  bool align = false;                ///< records nothing, shows how the board stands
  bool force = false, quiet = false;
  std::vector<std::filesystem::path> plugin_folders;
};

}  // namespace tofgraph::cli
