// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/nuisances.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/problem.hpp"

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <vector>

namespace tofgraph::diagnosis {
namespace {

/// Number of half cosines of a drift; 0 if some conditions state no order, or too few conditions exist.
std::size_t waves_of(const Design& design) {
  return design.tells_order() ? std::min(settings.max_drift_waves, design.size() / settings.conditions_per_drift_wave)
                              : 0;
}

class Builder {
 public:
  Builder(const Design& design, bool contrast) : design_(design), contrast_(contrast) {
    result_.of_condition.resize(design.size());
    result_.jitter = design.jitter();
  }

  Nuisances build() {
    add_waves();
    add_sessions();
    if (contrast_) add_contrast();
    return std::move(result_);
  }

 private:
  /// Adds an unknown of the camera's distance and one of the light. @param factor of each condition
  void add(const std::vector<double>& factor, double RandomEffectSd::*distance, double RandomEffectSd::*light) {
    for (const auto& [direction, sd] : {std::pair(uniform_direction, distance), std::pair(light_direction, light)}) {
      const auto unknown = static_cast<Eigen::Index>(result_.sd.size());
      result_.sd.push_back(sd);
      for (std::size_t i = 0; i < factor.size(); ++i) {
        if (factor[i] != 0) result_.of_condition[i].push_back({direction, unknown, factor[i]});
      }
    }
  }

  void add_waves() {
    const std::vector<io::Condition>& conditions = design_.conditions();
    const std::size_t waves = waves_of(design_);
    if (waves == 0) return;
    const auto [first, last] = std::ranges::minmax(conditions, {}, [](const io::Condition& c) { return *c.order; });
    const auto whole = static_cast<double>(*last.order - *first.order);
    for (std::size_t wave = 0; whole > 0 && wave <= waves; ++wave) {  // wave 0: the mean about which it drifts
      std::vector<double> factor;
      for (const io::Condition& c : conditions) {
        const double place = static_cast<double>(*c.order - *first.order) / whole;
        factor.push_back(std::cos(static_cast<double>(wave) * std::numbers::pi * place) /
                         static_cast<double>(std::max<std::size_t>(wave, 1)));
      }
      add(factor, wave == 0 ? &RandomEffectSd::mean : &RandomEffectSd::drift, &RandomEffectSd::drift_light);
    }
  }

  void add_sessions() {
    std::map<std::string, std::vector<double>> sessions;
    for (const io::Condition& c : design_.conditions()) sessions[c.session].resize(design_.size());
    if (sessions.size() < 2) return;
    for (std::size_t i = 0; i < design_.size(); ++i) sessions[design_.conditions()[i].session][i] = 1;
    for (const auto& [name, factor] : sessions) add(factor, &RandomEffectSd::session, &RandomEffectSd::session_light);
  }

  void add_contrast() {
    const auto unknown = static_cast<Eigen::Index>(result_.sd.size());
    result_.sd.push_back(&RandomEffectSd::contrast);
    for (std::size_t i = 0; i < design_.size(); ++i) {
      if (design_.shows_board(i)) result_.of_condition[i].push_back({contrast_direction, unknown, 1});
    }
  }

  const Design& design_;
  bool contrast_;
  Nuisances result_;
};

/// ln of the profile's contrast over that of a condition: median over the superpixels. Independent of reflectivity and
/// board position. nullopt if intensities or amplitudes are unknown.
std::optional<double> lower_contrast(const Design& design, const Observations& data) {
  const std::size_t n = design.superpixels();
  std::vector<double> lower;
  for (std::size_t s = 0; s < n; ++s) {
    const std::size_t a = amplitude * n + s, i = intensity * n + s;
    if (std::isfinite(data.variance[a]) && std::isfinite(data.variance[i]))
      lower.push_back(data.value[i] - data.value[a]);
  }
  if (lower.empty()) return std::nullopt;
  return physics::median(lower);
}

/// ln of the profile's contrast over the estimated one, given a model, for a problem that has it as an unknown.
struct Lower {
  double value = 0, variance = 0;
};
Lower fitted_lower_contrast(const Problem& problem, const State& state) {
  const auto& sd = problem.nuisances.sd;
  const auto rows = expected(problem, state);
  const std::vector<Column> columns = jacobian(problem, state, rows);
  const Unknowns unknowns = problem.unknowns(columns.size());
  const Solution solution = solve_linear(problem, state, rows, columns, unknowns);
  const Eigen::Index at =
      unknowns.effects + unknowns.targets + (std::ranges::find(sd, &RandomEffectSd::contrast) - sd.begin());
  return {solution.values(at), solution.covariance(at, at)};
}

}  // namespace

Nuisances nuisances_of(const Design& design, bool contrast) { return Builder(design, contrast).build(); }

double drift_of(const Design& design, double sd) {
  double sum = 0;
  for (std::size_t wave = 1; wave <= waves_of(design); ++wave) sum += 0.5 / static_cast<double>(wave * wave);
  return sd * std::sqrt(sum);
}

bool shows_another_contrast(const Design& design, const std::vector<Observations>& data) {
  struct Seen {
    double brightness = 0, lower = 0;
  };
  std::vector<Seen> seen;
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (!design.shows_board(i)) continue;
    if (const std::optional<double> lower = lower_contrast(design, data[i]))
      seen.push_back({std::abs(design.ideal(i)[design.superpixels() / 2].phasor), *lower});
  }
  if (seen.empty()) return false;
  std::ranges::stable_sort(seen, std::greater<>{}, &Seen::brightness);
  seen.resize((seen.size() + 1) / 2);
  std::vector<double> lower;
  for (const Seen& one : seen) lower.push_back(one.lower);
  const double middle = physics::median(lower);
  const auto same = std::ranges::count_if(
      lower, [&](double one) { return std::abs(one - middle) < settings.contrast_agreement * std::abs(middle); });
  return std::abs(middle) > settings.contrast_tolerance &&
         static_cast<double>(same) >= settings.contrast_min_agreeing * static_cast<double>(lower.size());
}

bool MeasuredContrast::profile_is_off() const {
  return (profile < low || profile > high) && std::abs(value / profile - 1) > settings.contrast_tolerance;
}

double log_lower_contrast(const Problem& problem, const State& state) {
  return fitted_lower_contrast(problem, state).value;
}

std::optional<MeasuredContrast> contrast_of(const Problem& problem, const State& state, double lack_of_fit) {
  if (!are_seen(intensity, problem.design, problem.data)) return std::nullopt;
  const Problem floating{
      problem.design,  problem.data, problem.targets, problem.target, nuisances_of(problem.design, true),
      problem.deadline};
  const Lower lower = fitted_lower_contrast(floating, state);
  const double half = 1.96 * std::sqrt(lower.variance * std::max(lack_of_fit, 1.0));
  const double profile = problem.design.camera().contrast;
  return MeasuredContrast{profile, profile * std::exp(-lower.value), profile * std::exp(-lower.value - half),
                          profile * std::exp(-lower.value + half)};
}

}  // namespace tofgraph::diagnosis
