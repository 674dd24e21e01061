// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/fixed_pattern_problem.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace tofgraph::calibration {
namespace {

using pattern::Problem;
using pattern::ViewUse;

constexpr double evidence_deviations = 5;  ///< for a slope: chance alone reaches it once in 2e6

double mean_of(const std::vector<double>& values, const std::vector<double>& sd) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(sd[i])) continue;
    sum += values[i];
    count += 1;
  }
  return sum / std::max(count, 1.0);
}

/// The means belong to the offsets of whole views: slopes in proportion to Z / D are k Z for all pixels alike.
void take_means_out(const PatternData& data, PatternFit& fit) {
  const std::vector<double> spread = pattern::inverse_spread(data);
  const double growth = mean_of(fit.slope, fit.map_sd) / mean_of(spread, fit.map_sd);
  for (std::size_t i = 0; i < fit.map.size(); ++i) {
    if (!std::isfinite(fit.map_sd[i])) continue;
    fit.slope[i] -= growth * spread[i];
    fit.map[i] -= slope_origin * growth * spread[i];
  }
  const double offset = mean_of(fit.map, fit.map_sd);
  for (std::size_t i = 0; i < fit.map.size(); ++i) fit.map[i] -= std::isfinite(fit.map_sd[i]) ? offset : 0;
  for (std::size_t v = 0; v < fit.poses.size(); ++v)
    fit.poses[v].offset +=
        offset + growth * data.campaign.conditions.conditions[data.views[v].condition].board_distance;
}

Problem fitted(const PatternData& data, const ViewUse& use, bool slope, PatternFit& fit) {
  Problem problem(data, use, slope);
  problem.assemble();
  problem.solve(fit);
  problem.back_substitute(fit);
  return problem;
}

std::size_t distances_of(const PatternData& data, std::map<double, std::vector<std::size_t>>& levels) {
  for (std::size_t v = 0; v < data.views.size(); ++v) {
    const io::Condition& c = data.campaign.conditions.conditions[data.views[v].condition];
    levels[std::round(c.board_distance * 1e3)].push_back(v);
  }
  return levels.size();
}

void hold_out(const PatternData& data, bool slope, PatternFit& result, const std::function<void(double)>& progress) {
  std::map<double, std::vector<std::size_t>> levels;
  if (distances_of(data, levels) < 3) return;
  std::map<double, std::vector<double>> before, after;
  double noise = 0, count = 0, done = 0;
  for (const auto& [level, members] : levels) {
    ViewUse use(data.views.size(), 1);
    for (const std::size_t v : members) use[v] = 0;
    PatternFit fit;
    const Problem problem = fitted(data, use, slope && levels.size() > 3, fit);
    for (const std::size_t v : members) {
      const auto [b, a, n] = problem.predict(v, fit);
      before[level].push_back(b);
      after[level].push_back(a);
      noise += n * n;
      count += 1;
    }
    if (progress) progress(0.3 + 0.7 * ++done / static_cast<double>(levels.size()));
  }
  result.before = interval_of(before);
  result.after = interval_of(after);
  result.noise_floor = std::sqrt(noise / count);
}

}  // namespace

std::array<double, shape_terms.size()> shape_terms_at(double x, double y) {
  std::array<double, 5> xs{1}, ys{1};
  for (std::size_t k = 1; k < xs.size(); ++k) {
    xs[k] = x * xs[k - 1];
    ys[k] = y * ys[k - 1];
  }
  std::array<double, shape_terms.size()> terms{};
  for (std::size_t k = 0; k < terms.size(); ++k)
    terms[k] = xs[static_cast<std::size_t>(shape_terms[k][0])] * ys[static_cast<std::size_t>(shape_terms[k][1])];
  return terms;
}

double shape_at(const std::vector<double>& shape, double x, double y) {
  const auto terms = shape_terms_at(x, y);
  return std::inner_product(shape.begin(), shape.end(), terms.begin(), 0.0);
}

PatternFit fit_pattern(const PatternData& data, const std::function<void(double share)>& progress) {
  PatternFit fit;
  const ViewUse all(data.views.size(), 1);
  std::map<double, std::vector<std::size_t>> levels;
  fit.has_slope = distances_of(data, levels) >= 3;
  fitted(data, all, fit.has_slope, fit);
  if (fit.has_slope) {
    double squares = 0, count = 0;
    take_means_out(data, fit);
    for (std::size_t i = 0; i < fit.slope.size(); ++i) {
      if (!(fit.slope_sd[i] > 0)) continue;
      squares += std::pow(fit.slope[i] / fit.slope_sd[i], 2);
      count += 1;
    }
    const double misfit = data.noise_known ? std::max(fit.misfit, 1.0) : fit.misfit;
    fit.slope_evidence = squares / std::max(count, 1.0) / (misfit * misfit);
    fit.has_slope = fit.slope_evidence > 1 + evidence_deviations * std::sqrt(2 / std::max(count, 1.0));
    if (!fit.has_slope) fitted(data, all, false, fit);
  }
  if (!fit.has_slope) take_means_out(data, fit);
  if (progress) progress(0.3);
  // Where the noise is not known, or something else is left beside it, the scatter says how uncertain all is.
  const double scale = data.noise_known ? std::max(fit.misfit, 1.0) : fit.misfit;
  for (std::vector<double>* sds : {&fit.map_sd, &fit.slope_sd, &fit.shape_sd}) {
    for (double& sd : *sds) sd *= scale;
  }
  if (!data.noise_known) fit.noise *= fit.misfit;
  hold_out(data, fit.has_slope, fit, progress);
  if (!data.noise_known) fit.noise_floor *= fit.misfit;
  return fit;
}

}  // namespace tofgraph::calibration
