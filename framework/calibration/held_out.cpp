// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/held_out.hpp"

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

namespace tofgraph::calibration {
namespace {

using physics::OffsetSample;
using physics::OffsetTable;

/// What a table says of one sample.
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

/// Value at x of the polynomial through the points.
double through_points(const std::vector<std::array<double, 2>>& points, double x) {
  double value = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    double weight = 1;
    for (std::size_t j = 0; j < points.size(); ++j) {
      if (j != k) weight *= (x - points[j][0]) / (points[k][0] - points[j][0]);
    }
    value += weight * points[k][1];
  }
  return value;
}

using Series = std::vector<std::size_t>;  ///< boards by distance

std::vector<Series> series_of(const Boards& boards) {
  std::map<std::pair<std::size_t, double>, Series> series;
  for (std::size_t i = 0; i < boards.boards.size(); ++i)
    series[{boards.target_of(boards.boards[i]), boards.boards[i].condition.integration_time}].push_back(i);
  std::vector<Series> result;
  for (auto& [key, members] : series) {
    std::ranges::sort(members, {}, [&](std::size_t i) { return boards.boards[i].distance; });
    const auto same = [&](std::size_t a, std::size_t b) {
      return boards.boards[a].distance == boards.boards[b].distance;
    };
    members.erase(std::unique(members.begin(), members.end(), same), members.end());
    result.push_back(std::move(members));
  }
  return result;
}

/// The error of each inner board of a series against two neighbours on each side; one where there is no second.
std::vector<double> errors_of(const Boards& boards, const Series& series) {
  std::vector<double> errors(series.size(), unknown);
  if (series.size() < 5) return errors;
  for (std::size_t k = 1; k + 1 < series.size(); ++k) {
    std::vector<std::array<double, 2>> points;
    const std::size_t first = k == 1 ? 0 : std::min(k - 2, series.size() - 5);
    for (std::size_t j = first; j < std::min(first + 5, series.size()); ++j) {
      const Board& b = boards.boards[series[j]];
      if (j != k) points.push_back({b.distance, -b.error()});
    }
    const Board& own = boards.boards[series[k]];
    errors[k] = -own.error() - through_points(points, own.distance);
  }
  return errors;
}

}  // namespace

std::vector<OutlyingBoard> outlying_boards(const Boards& boards) {
  constexpr double min_error = 5e-3, min_spreads = 6;  // m; of the robust standard deviation
  constexpr std::size_t reach = 2, few = 6;            // neighbours that an outlier spoils; errors for a spread
  const std::vector<Series> all = series_of(boards);
  std::vector<std::vector<double>> errors;
  std::vector<double> sizes;
  for (const Series& series : all) {
    errors.push_back(errors_of(boards, series));
    for (const double e : errors.back()) {
      if (std::isfinite(e)) sizes.push_back(std::abs(e));
    }
  }
  if (sizes.size() < few) return {};
  const double usual = physics::sd_of_deviations * physics::median(sizes);
  std::vector<OutlyingBoard> result;
  for (std::size_t s = 0; s < all.size(); ++s) {
    for (std::size_t k = 0; k < all[s].size(); ++k) {
      const double size = std::abs(errors[s][k]);
      if (!(size > std::max(min_error, min_spreads * usual))) continue;
      bool largest = true;
      for (std::size_t j = k - std::min(k, reach); j < std::min(k + reach + 1, all[s].size()); ++j)
        largest = largest && !(std::abs(errors[s][j]) > size);
      if (largest) result.push_back({all[s][k], errors[s][k], usual});
    }
  }
  return result;
}

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
