// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Combined errors of several conditions.
#include "calibration/plane_evaluation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace tofgraph::calibration {
namespace {

double rms_of_known(const std::vector<double>& values) {
  double sum = 0, n = 0;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    sum += v * v;
    ++n;
  }
  return n > 0 ? std::sqrt(sum / n) : io::unknown;
}

ErrorSummary summary_of_errors(std::string name, const std::vector<DepthErrors>& errors) {
  std::vector<double> bias, flatness, noise, rms;
  ErrorSummary summary{.name = std::move(name)};
  double sum = 0, magnitude = 0, largest = 0;
  for (const DepthErrors& e : errors) {
    if (e.pixels == 0) continue;
    ++summary.conditions;
    sum += e.bias;
    magnitude += std::abs(e.bias);
    largest = std::max(largest, std::abs(e.bias));
    flatness.push_back(e.flatness);
    noise.push_back(e.noise);
    rms.push_back(e.rms);
  }
  if (summary.conditions == 0) return summary;
  summary.bias = sum / static_cast<double>(summary.conditions);
  summary.mean_magnitude = magnitude / static_cast<double>(summary.conditions);
  summary.largest = largest;
  summary.flatness = rms_of_known(flatness);
  summary.noise = rms_of_known(noise);
  summary.rms = rms_of_known(rms);
  return summary;
}

}  // namespace

ErrorSummary summary_of_all(const PlaneEvaluation& evaluation) {
  std::vector<DepthErrors> errors;
  for (const EvaluatedCondition& c : evaluation.conditions) errors.push_back(c.all);
  return summary_of_errors("all", errors);
}

std::vector<ErrorSummary> summary_by_distance(const PlaneEvaluation& evaluation) {
  std::map<long, std::vector<DepthErrors>> levels;  // mm
  for (const EvaluatedCondition& c : evaluation.conditions)
    levels[std::lround(c.condition.board_distance * 1e3)].push_back(c.all);
  std::vector<ErrorSummary> summaries;
  for (const auto& [millimetres, errors] : levels)
    summaries.push_back(summary_of_errors(fmt::format("{} mm", millimetres), errors));
  return summaries;
}

std::vector<ErrorSummary> summary_by_radius(const PlaneEvaluation& evaluation) {
  std::vector<ErrorSummary> summaries;
  for (std::size_t r = 0; r < ring_count; ++r) {
    std::vector<DepthErrors> errors;
    for (const EvaluatedCondition& c : evaluation.conditions) errors.push_back(c.rings[r]);
    const double start = r == 0 ? 0 : evaluation.ring_ends[r - 1];
    summaries.push_back(summary_of_errors(fmt::format("{:.0f} to {:.0f} px", start, evaluation.ring_ends[r]), errors));
  }
  return summaries;
}

}  // namespace tofgraph::calibration
