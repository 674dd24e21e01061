// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/held_out.hpp"

#include <algorithm>
#include <functional>
#include <map>

namespace tofgraph::calibration {
namespace {

using physics::OffsetSample;
using physics::OffsetTable;

/// Predicts a sample with a table.
double predict(const OffsetTable& table, const OffsetSample& s, bool by_label) {
  return by_label ? table.of_target(s.target, s.depth, s.integration_time).depth
                  : table.across(s.depth, s.integration_time).at(s.reflectivity).depth;
}

HeldOut hold_out_axis(const std::string& axis, const std::vector<OffsetSample>& samples, bool by_label,
                      const std::function<double(const OffsetSample&)>& level_of) {
  HeldOut result{.axis = axis};
  std::map<double, std::vector<std::size_t>> levels;
  for (std::size_t i = 0; i < samples.size(); ++i) levels[level_of(samples[i])].push_back(i);
  if (levels.size() < 3) return result;
  std::map<double, std::vector<double>> before, after;
  for (const auto& [level, members] : levels) {
    if (level == levels.begin()->first || level == levels.rbegin()->first) continue;
    std::vector<OffsetSample> others;
    for (const OffsetSample& s : samples) {
      if (level_of(s) != level) others.push_back(s);
    }
    const OffsetTable table(others);
    for (const std::size_t i : members) {
      const OffsetSample& s = samples[i];
      const bool target_left = std::ranges::any_of(others, [&](const auto& o) { return o.target == s.target; });
      if (by_label && !target_left) continue;
      result.predictions.push_back({i, s.depth - s.distance, predict(table, s, by_label) - s.distance});
      before[level].push_back(result.predictions.back().before);
      after[level].push_back(result.predictions.back().after);
    }
  }
  result.levels = after.size();
  result.before = interval_of(before);
  result.after = interval_of(after);
  return result;
}

}  // namespace

std::vector<OffsetSample> samples_of(const Boards& boards) {
  std::vector<OffsetSample> samples;
  for (const Board& b : boards.boards)
    samples.push_back(
        {boards.target_of(b), b.distance, b.corrected.mean, b.condition.integration_time, b.reflectivity});
  return samples;
}

std::vector<HeldOut> hold_out(const Boards& boards) {
  const std::vector<OffsetSample> samples = samples_of(boards);
  const OffsetTable table(samples);
  const bool by_label = !table.knows_reflectivities();
  std::vector<HeldOut> result;
  result.push_back(hold_out_axis("distance", samples, by_label, [](const OffsetSample& s) { return s.distance; }));
  if (!by_label) {
    result.push_back(
        hold_out_axis("target", samples, false, [&](const OffsetSample& s) { return table.reflectivity(s.target); }));
  }
  result.push_back(
      hold_out_axis("integration_time", samples, by_label, [](const OffsetSample& s) { return s.integration_time; }));
  std::erase_if(result, [](const HeldOut& axis) { return axis.predictions.empty(); });
  return result;
}

}  // namespace tofgraph::calibration
