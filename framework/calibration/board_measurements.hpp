// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The boards of a campaign, read from its captures or its table, and what is wrong with them.
#pragma once

#include "calibration/board_measurement.hpp"
#include "io/campaign.hpp"

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace tofgraph::calibration {

struct Boards {
  std::vector<Board> boards;         ///< merged: by target, distance, integration time; kept: as in the campaign
  std::vector<std::string> targets;  ///< labels, in the order of the campaign
  std::array<double, 2> falloff{};   ///< see io::response_of
  std::string serial;                ///< camera's; empty: not recorded
  std::vector<std::string> notes;    ///< conditions left out or merged, and why
  std::vector<std::string> applied;  ///< corrections that the captures' distances have already, by stage
  std::size_t repeats = 0;           ///< conditions that were merged with another one
  std::size_t conditions = 0;        ///< the campaign's
  UnusablePixels unusable;           ///< of the conditions that are used

  std::size_t target_of(const Board& board) const;
};

/// Treatment of conditions of the same target, distance and integration time.
enum class Repeats { merged, kept };

/// Options for reading boards.
struct ReadBoards {
  std::function<void(double share)> progress;
  Repeats repeats = Repeats::merged;
  bool single_sources = false;  ///< conditions with some of the sources are used, too
  bool skip_wrapped = false;    ///< boards beyond the unambiguous range are left out with a note, not mistakes
  /// Called with each board that is used, its place in the campaign and its images; by several threads at once.
  std::function<void(std::size_t condition, const Board& board, const MeanImages& images)> visit;
};

/// Reads every condition with a board once, two at a time on two cores, one frame each in memory.
/// Mistakes, each at its condition: a capture that cannot be read, a window without pixels, wrapped distances,
/// distances that contradict the campaign, another serial.
/// @throws config::ConfigurationError with every mistake
Boards read_boards(const io::Campaign& campaign, io::OffsetVariant variant, const ReadBoards& options);

}  // namespace tofgraph::calibration
