// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/fixed_pattern_problem.hpp"

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace tofgraph::calibration {
namespace {

using pattern::Problem;
using pattern::ViewUse;

constexpr double loose_slope = 50e-3;      ///< m/m, prior
constexpr double evidence_deviations = 5;  ///< for a slope: reached by chance once in 2e6

/// Moves the mean of the map to the offsets of the views.
void take_mean_out(PatternFit& fit) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < fit.map.size(); ++i) {
    if (!std::isfinite(fit.map_sd[i])) continue;
    sum += fit.map[i];
    count += 1;
  }
  const double mean = sum / std::max(count, 1.0);
  for (std::size_t i = 0; i < fit.map.size(); ++i) fit.map[i] -= std::isfinite(fit.map_sd[i]) ? mean : 0;
  for (ViewPose& pose : fit.poses) pose.offset += mean;
}

/// Standard deviation of the slopes of neighbouring pixels beyond their noise: slopes that are smooth over the image
/// may be due to wiggling or the board. @returns m/m; 0 if it can be explained by noise
double roughness_of_slopes(const PatternData& data, PatternFit& fit) {
  double squares = 0, noise = 0, ratio = 0, count = 0;
  for (std::size_t i = 0; i + 1 < fit.slope.size(); ++i) {
    if ((i + 1) % data.columns == 0 || !(fit.slope_sd[i] > 0) || !(fit.slope_sd[i + 1] > 0)) continue;
    const double square = std::pow(fit.slope[i] - fit.slope[i + 1], 2);
    const double expected = std::pow(fit.slope_sd[i], 2) + std::pow(fit.slope_sd[i + 1], 2);
    squares += square / 2;
    noise += expected / 2;
    ratio += square / expected;
    count += 1;
  }
  if (count == 0) return 0;
  const double misfit = data.noise_known ? std::max(fit.misfit, 1.0) : fit.misfit;
  fit.slope_evidence = ratio / count / (misfit * misfit);
  // Neighbouring differences share a pixel: the variance of their squares is 1.5 times that of independent ones.
  if (fit.slope_evidence < 1 + evidence_deviations * std::sqrt(3 / count)) return 0;
  return std::sqrt(std::max(squares - noise * misfit * misfit, 0.0) / count);
}

enum class Deviations { wanted, not_wanted };

Problem fitted(const PatternData& data, const ViewUse& use, double slope_sd, PatternFit& fit, Deviations deviations,
               ViewPose start = pattern::first_jitter) {
  Problem problem(data, use, slope_sd);
  problem.assemble();
  problem.solve(fit, start);
  problem.back_substitute(fit, deviations == Deviations::wanted);
  return problem;
}

/// Root mean square difference of two maps of the same pixels, after removing their means.
double difference_of(const PatternFit& a, const PatternFit& b) {
  std::vector<double> differences;
  for (std::size_t i = 0; i < a.map.size(); ++i) {
    if (std::isfinite(a.map_sd[i])) differences.push_back(a.map[i] - b.map[i]);
  }
  const Moments moments = moments_of(differences);
  return differences.size() < 2 ? 0 : moments.sd;
}

/// Robust standard deviation over the pixels of the views' residuals, median of the views.
double spread_of_input(const PatternData& data) {
  std::vector<double> spreads;
  for (const PatternView& view : data.views) {
    std::vector<double> residuals;
    for (const float r : view.residual) {
      if (std::isfinite(r)) residuals.push_back(r);
    }
    if (residuals.empty()) continue;
    const double middle = physics::median(std::vector(residuals));
    for (double& r : residuals) r = std::abs(r - middle);
    spreads.push_back(physics::sd_of_deviations * physics::median(std::move(residuals)));
  }
  return spreads.empty() ? unknown : physics::median(std::move(spreads));
}

std::size_t distances_of(const PatternData& data, std::map<double, std::vector<std::size_t>>& levels) {
  for (std::size_t v = 0; v < data.views.size(); ++v) {
    const io::Condition& c = data.campaign.conditions.conditions[data.views[v].condition];
    levels[std::round(c.board_distance * 1e3)].push_back(v);
  }
  return levels.size();
}

void hold_out(const PatternData& data, double slope_sd, PatternFit& result,
              const std::function<void(double)>& progress) {
  std::map<double, std::vector<std::size_t>> levels;
  if (distances_of(data, levels) < 3) return;
  std::map<double, std::vector<double>> before, after;
  double noise = 0, count = 0, done = 0;
  for (const auto& [level, members] : levels) {
    ViewUse use(data.views.size(), 1);
    for (const std::size_t v : members) use[v] = 0;
    PatternFit fit;
    const Problem problem =
        fitted(data, use, levels.size() > 3 ? slope_sd : 0, fit, Deviations::not_wanted, result.jitter);
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
  double slope_sd = 0;
  if (distances_of(data, levels) >= 3) {
    fitted(data, all, loose_slope, fit, Deviations::wanted);
    slope_sd = roughness_of_slopes(data, fit);
  }
  fit.has_slope = slope_sd > 0;
  fitted(data, all, slope_sd, fit, Deviations::wanted);
  PatternFit again;
  fitted(data, all, slope_sd, again, Deviations::not_wanted, pattern::second_jitter);
  fit.settled = fit.settled && again.settled;
  fit.restart_difference = difference_of(fit, again);
  fit.input_spread = spread_of_input(data);
  take_mean_out(fit);
  if (progress) progress(0.3);
  // If the noise is unknown or other errors remain, uncertainties are scaled by the scatter of the residuals.
  const double scale = data.noise_known ? std::max(fit.misfit, 1.0) : fit.misfit;
  for (std::vector<double>* sds : {&fit.map_sd, &fit.slope_sd, &fit.shape_sd}) {
    for (double& sd : *sds) sd *= scale;
  }
  if (!data.noise_known) fit.noise *= fit.misfit;
  hold_out(data, slope_sd, fit, progress);
  if (!data.noise_known) fit.noise_floor *= fit.misfit;
  return fit;
}

}  // namespace tofgraph::calibration
