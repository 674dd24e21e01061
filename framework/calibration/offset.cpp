// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Offset by integration time and reflectivity, chapter 6 of the reference.
#include "calibration/offset_report.hpp"
#include "calibration/outlying_boards.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tofgraph/physics/constants.hpp>

#include <algorithm>
#include <cmath>
#include <set>

namespace tofgraph::calibration {
namespace {

void check_enough(const Request& request, const Boards& boards) {
  const auto refuse = [&](const std::string& what) {
    throw config::ConfigurationError(
        fmt::format("{}: error: {}\n  an offset changes with the distance: it needs boards at two distances or more, "
                    "better one every 250 mm",
                    request.campaign.string(), what));
  };
  std::set<double> distances;
  for (const Board& b : boards.boards) distances.insert(b.distance);
  if (boards.boards.empty()) refuse("no condition is left");
  if (boards.boards.size() == 1) refuse("there is a single condition");
  if (distances.size() == 1)
    refuse(fmt::format("all boards stand at {}", config::format_quantity(*distances.begin(), "m")));
}

/// Writes the measurement of each condition, for users and other programs.
void write_statistics(const Boards& boards, io::CalibrationWriter& writer) {
  struct Column {
    const char* key;
    Moments Board::*moments;
  };
  static constexpr Column columns[] = {{"modelled", &Board::modelled},
                                       {"measured", &Board::measured},
                                       {"remodelled", &Board::remodelled},
                                       {"offset", &Board::offset},
                                       {"final", &Board::final}};
  const io::Calibrated amplitude = column_of(boards, [](const Board& b) { return b.amplitude; });
  if (known(amplitude)) writer.column("amplitude", amplitude, "counts", 1);
  for (const Column& c : columns) {
    const auto mean = column_of(boards, [&](const Board& b) { return (b.*c.moments).mean; });
    const auto sd = column_of(boards, [&](const Board& b) { return (b.*c.moments).sd; });
    if (known(mean)) writer.column(fmt::format("{}_mean", c.key), mean, "mm", 1e-3);
    if (known(sd)) writer.column(fmt::format("{}_sd", c.key), sd, "mm", 1e-3);
  }
  const auto rmse = column_of(boards, [](const Board& b) { return b.rmse; });
  if (known(rmse)) writer.column("rmse", rmse, "mm", 1e-3);
}

/// Writes root mean squares with their 95 % intervals: value, low, high.
void write_held_out(const std::vector<HeldOut>& axes, io::CalibrationWriter& writer) {
  const auto write = [&](const std::string& key, const Interval& i) {
    std::vector<double> values = {i.value};
    if (std::isfinite(i.low)) values.insert(values.end(), {i.low, i.high});
    writer.column(key, {values, {}}, "mm", 1e-3);
  };
  if (!axes.empty()) write("uncorrected", axes.front().before);
  for (const HeldOut& axis : axes) write("held_out_" + axis.axis, axis.after);
}

/// Accuracy of the calibration, one line per axis.
std::vector<std::string> worth_of(const std::vector<HeldOut>& axes) {
  if (axes.empty()) return {"too few levels to judge the calibration by what was left out"};
  std::vector<std::string> lines;
  for (const HeldOut& axis : axes) {
    std::string name = axis.axis;
    std::ranges::replace(name, '_', ' ');
    std::string line = fmt::format("each {} left out and predicted from the others: {:.1f} mm remain of {:.1f} mm",
                                   name, axis.after.value * 1e3, axis.before.value * 1e3);
    if (axis.levels > 1)
      line += fmt::format(" (95 %: {:.1f} to {:.1f} mm, {} levels)", axis.after.low * 1e3, axis.after.high * 1e3,
                          axis.levels);
    else
      line += " (1 level)";
    lines.push_back(line);
  }
  return lines;
}

/// Reports boards at wrong positions as errors, or as notes if the calibration is forced.
/// @throws config::ConfigurationError with all of them
void judge_places(const Request& request, const Boards& boards, const tofgraph_camera& camera,
                  std::vector<std::string>& notes) {
  config::Diagnostics diagnostics;
  for (const OutlyingBoard& one : outlying_boards(boards, physics::unambiguous_range(camera.modulation_frequency))) {
    const Board& board = boards.boards[one.board];
    const std::string text = fmt::format(
        "condition '{}': the board at {} was measured {:.1f} mm {} than the others predict, who agree within {:.1f} mm "
        "(robust standard deviation): is its distance right?",
        board.condition.id, config::format_quantity(board.distance, "m"), std::abs(one.error) * 1e3,
        one.error > 0 ? "farther" : "nearer", one.usual * 1e3);
    if (request.force)
      notes.push_back(text);
    else
      diagnostics.error(board.condition.place("distance"), text,
                        "correct it, or leave the condition out; --force calibrates with it");
  }
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
}

/// Sets the errors of the first axis, the distance, which decides; others are noted.
void judge(const std::vector<HeldOut>& axes, Result& result) {
  if (axes.empty()) return;
  const auto words = [](const HeldOut& axis) {
    std::string name = axis.axis;
    std::ranges::replace(name, '_', ' ');
    return "each " + name;
  };
  result.held_out = HeldOutErrors{
      .left_out = words(axes.front()),
      .before = axes.front().before.value,
      .after = axes.front().after.value,
      .causes =
          "boards too far apart for the period of the error (one every 250 mm is enough for wiggling at 20 MHz), a "
          "wrong distance, target or integration time of a condition, boards that were corrected already"};
  for (std::size_t i = 1; i < axes.size(); ++i) {
    if (axes[i].after.value >= axes[i].before.value)
      result.notes.push_back(fmt::format(
          "{} left out and predicted from the others, {:.1f} mm remain of {:.1f} mm: the calibration does not help "
          "between those that were measured; measure more of them",
          words(axes[i]), axes[i].after.value * 1e3, axes[i].before.value * 1e3));
  }
}

}  // namespace

Result calibrate_offset(const Request& request) {
  const Campaign campaign = read(request);
  const Boards& boards = campaign.boards;
  refuse_corrected(request, boards, "offset_correction");
  check_enough(request, boards);
  const tofgraph_camera& camera = campaign.conditions.camera->view();
  std::vector<std::string> notes = boards.notes;
  judge_places(request, boards, camera, notes);
  io::OffsetCalibration calibration{.camera = camera.name,
                                    .serial = boards.serial,
                                    .modulation_frequency = camera.modulation_frequency,
                                    .gain = camera.gain,
                                    .variant = request.variant,
                                    .targets = boards.targets,
                                    .samples = samples_of(boards),
                                    .falloff = boards.falloff};
  for (const Board& b : boards.boards) calibration.depth_sd.push_back(b.depth_sd);
  std::vector<HeldOut> axes;
  std::optional<physics::OffsetTable> table;
  try {
    table.emplace(calibration.samples);
    axes = hold_out(boards);
  } catch (const std::invalid_argument& problem) {
    throw config::ConfigurationError(fmt::format("{}: error: {}", request.campaign.string(), problem.what()));
  }
  io::CalibrationWriter writer = writer_for(request, campaign, "offset");
  write_offset_calibration(calibration, writer);
  write_statistics(boards, writer);
  write_held_out(axes, writer);
  const std::vector<std::string> worth = worth_of(axes);
  Result result{.file = writer.text(),
                .page = offset_report(campaign, *table, axes, sentence_of(worth)),
                .summary = fmt::format("{}\n{}", described(boards), fmt::join(worth, "\n")),
                .notes = std::move(notes)};
  judge(axes, result);
  if (result.held_out) result.held_out->used = used_of(boards);
  if (!table->knows_reflectivities())
    result.notes.emplace_back(
        "the targets' reflectivities are not known (no amplitude, no reflectivity): offset_correction has to be told "
        "the target");
  return result;
}

}  // namespace tofgraph::calibration
