// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Beginning and end that every calibration from boards has in common.
#pragma once

#include "calibration/board_measurements.hpp"
#include "calibration/calibrate.hpp"

#include <string>

namespace tofgraph::calibration {

/// A campaign with its boards.
struct Campaign {
  io::Campaign conditions;
  Boards boards;
};

/// Reads the campaign's file alone. @throws config::ConfigurationError with every mistake
io::Campaign read_conditions(const Request& request);
/// Reads the campaign and its captures. @throws config::ConfigurationError with every mistake
Campaign read(const Request& request);

/// A calibration file of this kind with the campaign's files and their hashes.
io::CalibrationWriter writer_for(const Request& request, const io::Campaign& campaign, const std::string& serial,
                                 const std::string& kind);
io::CalibrationWriter writer_for(const Request& request, const Campaign& campaign, const std::string& kind);

/// The first lines of a model of the campaign's camera for a file beside the calibration; the effects follow.
std::string model_head(const Request& request, const io::Campaign& campaign, const std::string& serial);

/// Boards that a stage corrected already do not show what that stage is to correct.
/// @throws config::ConfigurationError where the captures have it applied
void refuse_corrected(const Request& request, const Boards& boards, const std::string& stage);

/// A capture whose frames are in two conditions would count twice. @throws config::ConfigurationError with both places
void refuse_duplicates(const io::Campaign& campaign);

/// `84 conditions: 6 targets, 14 distances from 500 mm to 7 m, 18 integration times from 0.5 ms to 50 ms`
std::string described(const Boards& boards);
/// Counts of conditions, frames and pixels that a calibration was made from, and what was left out of them and why: for
/// a refusal, each line after a line break and two blanks.
std::string used_of(const Boards& boards);
/// Lines as one sentence for the top of a report.
std::string sentence_of(const std::vector<std::string>& lines);
/// Name of a target; without a label: `the board`.
std::string name_of(const Boards& boards, std::size_t target);
/// Columns of a table of values, one a board.
io::Calibrated column_of(const Boards& boards, const std::function<double(const Board&)>& value);
/// Returns whether a value is known of every board.
bool known(const io::Calibrated& column);

}  // namespace tofgraph::calibration
