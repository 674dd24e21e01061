// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/patterns.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tofgraph::diagnosis {
namespace {}  // namespace

std::string name_of(const Pattern& pattern) {
  const bool along = pattern.axis != everywhere && !pattern.axis.starts_with("period") && pattern.axis != no_setting &&
                     pattern.axis != smooth_over_image;
  return fmt::format("{}{} {}", observable_names[pattern.observable], along ? " along" : ",", pattern.axis);
}

std::optional<Pattern> unsteady_camera(const Problem& problem, const ModelFit& fit, std::span<const double> weight) {
  const RandomEffectSd& sd = fit.state.random_sd;
  if (sd.offset < settings.unsteady_sd) return std::nullopt;
  State merged = fit.state;
  merged.random_sd = {.jitter = std::hypot(sd.jitter, sd.offset), .offset = 0, .light = sd.light};
  const double gain = fit_nuisances(problem, merged, weight).deviance - fit.deviance;
  if (gain < settings.unsteady_min_gain) return std::nullopt;
  return Pattern{.observable = distance,
                 .axis = no_setting,
                 .gain = gain,
                 .p_value = std::erfc(std::sqrt(gain / 2)),
                 .size = sd.offset,
                 .significant = true,
                 .largest = sd.offset,
                 .share = std::numeric_limits<double>::quiet_NaN()};
}

std::optional<Pattern> large_smooth_field(const Problem& problem, const ModelFit& fit) {
  const SmoothField* const field = fit.state.nuisances.smooth_field.get();
  if (field == nullptr || field->sd() < settings.field_max_nuisance_sd) return std::nullopt;
  State without = fit.state;
  without.nuisances.smooth_field = nullptr;
  double gain = deviance_of(problem, without) - deviance_of(problem, fit.state);
  for (std::size_t i = 0; i < problem.data.size(); ++i) gain -= field->log_determinant(i);
  return Pattern{.observable = distance,
                 .axis = smooth_over_image,
                 .gain = gain,
                 .p_value = std::erfc(std::sqrt(std::max(gain, 0.0) / 2)),
                 .size = field->sd(),
                 .significant = true,
                 .largest = field->sd(),
                 .share = std::numeric_limits<double>::quiet_NaN()};
}

PatternFinder::PatternFinder(const Problem& problem) : bases_(generic_bases(problem)) {
  for (const Group& group : bases_.groups) groups_.push_back(&group);
}

PatternScan PatternFinder::find(const Problem& problem, const ModelFit& fit, std::size_t flips,
                                std::uint64_t seed) const {
  const Scan scanned = scan(problem, fit, groups_, flips, seed);
  PatternScan result{{}, {}, 0, scanned.square, scanned.freedom};
  std::vector<double> p_values;
  for (const Score& score : scanned.scores) {
    p_values.push_back(score.own_p_value);
    result.gains.push_back(score.gain - score.dimension);
    result.most = std::max(result.most, result.gains.back());
  }
  if (flips == 0) return result;
  const double limit = false_discovery_limit(p_values, settings.false_discoveries);
  const double beyond = scanned.square - scanned.freedom;
  for (std::size_t b = 0; b < bases_.patterns.size(); ++b) {
    const Score& score = scanned.scores[b];
    // One among many that nothing goes with is below what the false discoveries' limit can see of so many draws.
    const bool beyond_chance = score.own_p_value <= limit || significant(score);
    if (!beyond_chance || score.gain < settings.min_pattern_gain) continue;
    const BasisSize size = size_of(bases_.patterns[b], bases_.groups[b], score.values, problem);
    result.patterns.push_back({bases_.patterns[b].observable, bases_.patterns[b].axis, score.gain, score.own_p_value,
                               size.mean, significant(score), size.largest,
                               std::clamp(score.gain / std::max(beyond, score.gain), 0.0, 1.0)});
  }
  std::ranges::stable_sort(result.patterns, [](const Pattern& a, const Pattern& b) {
    return std::pair(a.p_value, -a.gain) < std::pair(b.p_value, -b.gain);
  });
  return result;
}

}  // namespace tofgraph::diagnosis
