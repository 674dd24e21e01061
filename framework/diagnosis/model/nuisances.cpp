// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/nuisances.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace tofgraph::diagnosis {
namespace {

/// Nothing where the order is not told of all, or the conditions are too few.
std::size_t waves_of(const Design& design) {
  return design.tells_order() ? std::min(settings.max_drift_waves, design.size() / settings.conditions_per_drift_wave)
                              : 0;
}

class Builder {
 public:
  Builder(const Design& design, bool contrast) : design_(design), contrast_(contrast) {
    result_.of_condition.resize(design.size());
  }

  Nuisances build() {
    add_waves();
    add_sessions();
    if (contrast_) add_contrast();
    return std::move(result_);
  }

 private:
  /// An unknown of the camera's distance, and one of the light. @param factor of each condition
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
    for (std::size_t wave = 0; whole > 0 && wave <= waves; ++wave) {  // what wanders may do so about any mean
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

}  // namespace

Nuisances nuisances_of(const Design& design, bool contrast) { return Builder(design, contrast).build(); }

double drift_of(const Design& design, double sd) {
  double sum = 0;
  for (std::size_t wave = 1; wave <= waves_of(design); ++wave) sum += 0.5 / static_cast<double>(wave * wave);
  return sd * std::sqrt(sum);
}

}  // namespace tofgraph::diagnosis
