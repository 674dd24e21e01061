// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Boards of a campaign, read from its captures or its table, with checks for errors.
#pragma once

#include "calibration/board_measurement.hpp"
#include "io/campaign.hpp"

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace tofgraph::calibration {

struct Boards {
  std::vector<Board> boards;         ///< merged: ordered by target, distance, integration time; kept: in campaign order
  std::vector<std::string> targets;  ///< labels, in the order of the campaign
  std::array<double, 2> falloff{};   ///< see io::response_of
  std::string serial;                ///< of the camera; empty: not recorded
  std::vector<std::string> notes;    ///< excluded or merged conditions, and why
  std::vector<std::string> applied;  ///< corrections already applied to the captures' distances, by stage
  std::size_t repeats = 0;           ///< conditions that were merged with another one
  std::size_t conditions = 0;        ///< number of conditions in the campaign
  UnusablePixels unusable;           ///< sums over the conditions used

  std::size_t target_of(const Board& board) const;
};

/// Treatment of conditions of the same target, distance and integration time.
enum class Repeats { merged, kept };

/// Options for reading boards.
struct ReadBoards {
  std::function<void(double share)> progress;
  Repeats repeats = Repeats::merged;
  bool single_sources = false;  ///< also use conditions with only some of the sources on
  bool skip_wrapped = false;    ///< exclude boards beyond the unambiguous range with a note instead of an error
  /// Called for each board that is used, with its index in the campaign and its images; by several threads at once.
  std::function<void(std::size_t condition, const Board& board, const MeanImages& images)> visit;
};

/// Reads every condition with a board once, two at a time on two cores, with one frame each in memory.
/// Errors, each at its condition: an unreadable capture, a window without pixels, wrapped distances, distances that
/// contradict the campaign, a different serial number.
/// @throws config::ConfigurationError with all errors
Boards read_boards(const io::Campaign& campaign, io::OffsetVariant variant, const ReadBoards& options);

}  // namespace tofgraph::calibration
