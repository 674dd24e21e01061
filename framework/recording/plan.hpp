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
  io::Campaign campaign;            ///< captures are only names
  std::vector<std::string> scenes;  ///< per condition of a scene: its own scene as YAML, if it is more than a board
  std::uint64_t frames = 20;        ///< per condition
};

/// @throws config::ConfigurationError listing all errors
Plan read_plan(const std::filesystem::path& file);

/// Set-up of a condition by the user: board, target, sources, room; without camera settings.
std::string setup_text(const io::Condition& condition);

/// Set-up and integration time: the content of a capture of this condition.
std::string condition_text(const io::Condition& condition);

}  // namespace tofgraph::recording
