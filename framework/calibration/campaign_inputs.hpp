// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file First and last steps common to all calibrations from boards.
#pragma once

#include "calibration/board_measurements.hpp"
#include "calibration/calibrate.hpp"

#include <string>

namespace tofgraph::calibration {

/// Campaign with its boards.
struct Campaign {
  io::Campaign conditions;
  Boards boards;
};

/// Reads the campaign's file alone. @throws config::ConfigurationError with all errors
io::Campaign read_conditions(const Request& request);
/// Reads the campaign and its captures. @throws config::ConfigurationError with all errors
Campaign read(const Request& request);

/// Writer of a calibration file of this kind with the campaign's files and their hashes.
io::CalibrationWriter writer_for(const Request& request, const io::Campaign& campaign, const std::string& serial,
                                 const std::string& kind);
io::CalibrationWriter writer_for(const Request& request, const Campaign& campaign, const std::string& kind);

/// First lines of a model of the campaign's camera for a file beside the calibration; the effects follow.
std::string model_head(const Request& request, const io::Campaign& campaign, const std::string& serial);

/// Rejects boards that are already corrected by a stage, because they no longer show the error to be calibrated.
/// @throws config::ConfigurationError if the captures have the correction applied
void refuse_corrected(const Request& request, const Boards& boards, const std::string& stage);

/// Rejects captures whose frames belong to two conditions. @throws config::ConfigurationError with both positions
void refuse_duplicates(const io::Campaign& campaign);

/// `84 conditions: 6 targets, 14 distances from 500 mm to 7 m, 18 integration times from 0.5 ms to 50 ms`
std::string described(const Boards& boards);
/// Numbers of conditions, frames and pixels used for a calibration, and of those excluded with their reasons: for a
/// rejection message, each line preceded by a line break and two blanks.
std::string used_of(const Boards& boards);
/// Joins lines to one sentence for the top of a report.
std::string sentence_of(const std::vector<std::string>& lines);
/// Name of a target; without a label: `the board`.
std::string name_of(const Boards& boards, std::size_t target);
/// Table column with one value per board.
io::Calibrated column_of(const Boards& boards, const std::function<double(const Board&)>& value);
/// Returns true if the value of every board is known.
bool known(const io::Calibrated& column);

}  // namespace tofgraph::calibration
