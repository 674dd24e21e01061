// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/folds.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace tofgraph::diagnosis {
namespace {

constexpr std::size_t fewest_levels = 4, interleaved = 3;
constexpr double end_share = 0.1;  ///< of the levels, at either end

/// Conditions by level, in the order of the levels.
using Levels = std::vector<std::pair<std::string, std::vector<std::size_t>>>;

template <class Key> Levels levels_of(const Design& design, const std::function<Key(const io::Condition&)>& key,
                                      const std::function<std::string(const Key&)>& label) {
  std::map<Key, std::vector<std::size_t>> by_key;
  for (std::size_t i = 0; i < design.size(); ++i) by_key[key(design.conditions()[i])].push_back(i);
  Levels levels;
  for (auto& [level, conditions] : by_key) levels.emplace_back(label(level), std::move(conditions));
  return levels;
}

class Folds {
 public:
  explicit Folds(const Design& design) : design_(design) {}

  std::vector<Fold> all() {
    const auto number = [](const char* unit, double scale) {
      return [=](const double& value) { return fmt::format("{:.4g} {}", scale * value, unit); };
    };
    const auto word = [](const std::string& text) { return text; };
    ordered("distance", levels_of<double>(
                            design_, [](const io::Condition& c) { return c.board_distance; }, number("m", 1)));
    if (folds_.empty())
      ordered("integration time",
              levels_of<double>(
                  design_, [](const io::Condition& c) { return c.integration_time; }, number("ms", 1e3)));
    each("target", levels_of<std::string>(
                       design_, [](const io::Condition& c) { return c.target; }, word));
    each("session", levels_of<std::string>(
                        design_, [](const io::Condition& c) { return c.session; }, word));
    return std::move(folds_);
  }

 private:
  void add(const std::string& setting, const Levels& levels, std::span<const std::size_t> chosen, bool extrapolates) {
    Fold fold{setting, "", {}, extrapolates};
    std::vector<std::string> names;
    for (const std::size_t level : chosen) {
      names.push_back(levels[level].first);
      std::ranges::copy(levels[level].second, std::back_inserter(fold.held));
    }
    std::ranges::sort(fold.held);
    fold.levels = fmt::format("{}", fmt::join(names, ", "));
    if (design_.size() - fold.held.size() >= fewest_conditions) folds_.push_back(std::move(fold));
  }

  void ordered(const std::string& setting, const Levels& levels) {
    if (levels.size() < fewest_levels) return;
    const auto ends = static_cast<std::size_t>(std::ceil(end_share * static_cast<double>(levels.size())));
    std::vector<std::size_t> nearest, farthest;
    for (std::size_t k = 0; k < ends; ++k) {
      nearest.push_back(k);
      farthest.insert(farthest.begin(), levels.size() - 1 - k);
    }
    add(setting, levels, nearest, true);
    const std::size_t inner = levels.size() - 2 * ends, groups = std::min(interleaved, inner);
    for (std::size_t g = 0; g < groups; ++g) {
      std::vector<std::size_t> chosen;
      for (std::size_t k = ends + g; k < levels.size() - ends; k += groups) chosen.push_back(k);
      add(setting, levels, chosen, false);
    }
    add(setting, levels, farthest, true);
  }

  void each(const std::string& setting, const Levels& levels) {
    if (levels.size() < 2) return;
    const std::size_t groups = std::min(fewest_levels, levels.size());
    for (std::size_t g = 0; g < groups; ++g) {
      std::vector<std::size_t> chosen;
      for (std::size_t k = g; k < levels.size(); k += groups) chosen.push_back(k);
      add(setting, levels, chosen, false);
    }
  }

  const Design& design_;
  std::vector<Fold> folds_;
};

}  // namespace

std::vector<Fold> folds_of(const Design& design) { return Folds(design).all(); }

}  // namespace tofgraph::diagnosis
