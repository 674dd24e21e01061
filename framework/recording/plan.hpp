// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Plan of a recording: a campaign without captures, or a scene with a sequence.
#pragma once

#include "io/campaign.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::recording {

struct Plan {
  std::filesystem::path file;
  io::Campaign campaign;            ///< its captures are names only
  std::vector<std::string> scenes;  ///< per condition of a scene: its own, as YAML, if it is not just a board
  std::uint64_t frames = 20;        ///< per condition
};

/// @throws config::ConfigurationError with every mistake
Plan read_plan(const std::filesystem::path& file);

/// Set-up of a condition by the user: board, target, sources, room; without settings of the camera.
std::string setup_text(const io::Condition& condition);

/// The set-up and the integration time: what a capture of this condition is of.
std::string condition_text(const io::Condition& condition);

}  // namespace tofgraph::recording
