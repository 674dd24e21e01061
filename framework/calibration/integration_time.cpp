// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The calibration `integration-time`: the file and its summary.
#include "calibration/integration_time.hpp"

#include "config/quantity.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace tofgraph::calibration {
namespace {

using config::format_quantity;

void check_enough(const Request& request, const Campaign& campaign, const IntegrationTimes& times) {
  const auto refuse = [&](const std::string& what, const std::string& hint) {
    throw config::ConfigurationError(fmt::format("{}: error: {}\n  {}", request.campaign.string(), what, hint));
  };
  if (campaign.boards.boards.empty()) refuse("no condition is left", "it needs boards at known distances");
  if (campaign.boards.boards.size() == 1)
    refuse("there is a single condition", "which time is best shows only among several: record the board at some more");
  if (times.wanted.empty())
    refuse(fmt::format("no board stands between {} and {}", format_quantity((*request.range)[0], "m"),
                       format_quantity((*request.range)[1], "m")),
           fmt::format("the boards stand from {} to {}", format_quantity(times.places.front().distance, "m"),
                       format_quantity(times.places.back().distance, "m")));
}

/// Lines, one per target, with the single integration time measured at each distance, for tables of published optima
/// that contain no others.
std::vector<std::string> given_times(const Boards& boards, const IntegrationTimes& times) {
  std::vector<std::string> lines = {"the optimum is the one integration time that each target and distance has here"};
  std::map<std::size_t, std::vector<std::string>> by_target;
  for (const Place* place : times.wanted) {
    if (place->best != nullptr)
      by_target[place->target].push_back(fmt::format("{} at {}",
                                                     format_quantity(place->best->condition.integration_time, "s"),
                                                     format_quantity(place->distance, "m")));
  }
  for (const auto& [target, list] : by_target)
    lines.push_back(fmt::format("  {}: {}", name_of(boards, target), fmt::join(list, ", ")));
  return lines;
}

/// Recommendation as lines of text.
std::vector<std::string> advice_of(const Boards& boards, const IntegrationTimes& times, const Request& request) {
  if (!times.compares) return given_times(boards, times);
  std::vector<std::string> lines;
  const auto mm = [](double metres) { return format_quantity(std::round(metres * 1e5) * 1e-5, "m"); };
  const std::string wanted =
      request.accuracy ? fmt::format(" (wanted: {})", format_quantity(*request.accuracy, "m")) : "";
  const Suggestion& single = times.single;
  if (!single.places.empty())
    lines.push_back(fmt::format("one integration time for all targets and distances ({}): {}, error at most {}{}",
                                single.places.size(), format_quantity(single.time, "s"), mm(single.worst), wanted));
  else
    lines.emplace_back("no integration time was measured, unsaturated, at all targets and distances");
  if (!times.several.empty()) {
    std::vector<std::string> list;
    for (const Suggestion& s : times.several)
      list.push_back(fmt::format("{} for {} of them", format_quantity(s.time, "s"), s.places.size()));
    lines.push_back(fmt::format("several together{}: {}", wanted, fmt::join(list, ", ")));
  }
  if (!times.out_of_reach.empty())
    lines.push_back(fmt::format("{} of {} targets and distances do not reach {} at any integration time",
                                times.out_of_reach.size(), times.wanted.size(),
                                request.accuracy ? format_quantity(*request.accuracy, "m") : "it"));
  if (times.held_out > 0)
    lines.push_back(
        fmt::format("best times interpolated from other distances: RMSE {:.2f} times the least (95 %: "
                    "{:.2f} to {:.2f}, {} places)",
                    times.excess.value, times.excess.low, times.excess.high, times.held_out));
  return lines;
}

void write_values(const Campaign& campaign, const IntegrationTimes& times, io::CalibrationWriter& writer) {
  std::vector<std::string> labels;
  for (const std::string& label : campaign.boards.targets) labels.push_back(config::yaml_word(label));
  writer.setting("targets", fmt::format("[{}]", fmt::join(labels, ", ")));
  io::Calibrated target, distance, time, rmse, shortest, longest, saturates;
  for (const Place& place : times.places) {
    if (place.best == nullptr) continue;
    target.value.push_back(static_cast<double>(place.target));
    distance.value.push_back(place.distance);
    time.value.push_back(place.best->condition.integration_time);
    rmse.value.push_back(place.best->rmse);
    rmse.sd.push_back(place.best->rmse / std::sqrt(2 * std::max(place.best->pixels - 1, 1.0)));
    shortest.value.push_back(place.shortest);
    longest.value.push_back(place.longest);
    saturates.value.push_back(place.saturates);
  }
  writer.column("target", target, "", 1);
  writer.column("distance", distance, "mm", 1e-3);
  writer.column("integration_time", time, "ms", 1e-3);
  writer.column("rmse", rmse, "mm", 1e-3);
  writer.column("shortest", shortest, "ms", 1e-3);
  writer.column("longest", longest, "ms", 1e-3);
  if (known(saturates)) writer.column("saturates", saturates, "ms", 1e-3);
  if (!times.single.places.empty()) {
    writer.number("recommended", times.single.time, unknown, "ms", 1e-3);
    writer.number("recommended_error", times.single.worst, unknown, "mm", 1e-3);
  }
  io::Calibrated several;
  for (const Suggestion& s : times.several) several.value.push_back(s.time);
  if (!several.value.empty()) writer.column("several", several, "ms", 1e-3);
  if (times.held_out > 0)
    writer.column("held_out_excess", {{times.excess.value, times.excess.low, times.excess.high}, {}}, "", 1);
}

}  // namespace

Result calibrate_integration_time(const Request& request) {
  const Campaign campaign = read(request);
  const IntegrationTimes times = choose_times(campaign, request);
  check_enough(request, campaign, times);
  io::CalibrationWriter writer = writer_for(request, campaign, "integration-time");
  if (request.range)
    writer.setting("range", fmt::format("[{}, {}]", format_quantity((*request.range)[0], "m"),
                                        format_quantity((*request.range)[1], "m")));
  if (request.accuracy) writer.setting("accuracy", format_quantity(*request.accuracy, "m"));
  write_values(campaign, times, writer);
  const std::vector<std::string> advice = advice_of(campaign.boards, times, request);
  Result result{.file = writer.text(),
                .page = integration_time_report(campaign, times, request,
                                                sentence_of(times.compares ? advice : std::vector{advice.front()})),
                .summary = fmt::format("{}\n{}", described(campaign.boards), fmt::join(advice, "\n")),
                .notes = campaign.boards.notes};
  if (times.held_out > 0)
    result.held_out = HeldOutErrors{.left_out = "each distance",
                                    .before = times.excess_of_one_time,
                                    .after = times.excess.value,
                                    .unit = "times the least RMSE",
                                    .scale = 1,
                                    .causes =
                                        "best times that scatter, as of few frames; a wrong distance or "
                                        "integration time of a condition; saturation",
                                    .used = used_of(campaign.boards),
                                    .tolerance = 0.05};
  return result;
}

}  // namespace tofgraph::calibration
