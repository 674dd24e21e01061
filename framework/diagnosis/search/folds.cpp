// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/folds.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <random>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Conditions by level, in the order of the levels.
using Levels = std::vector<std::pair<std::string, std::vector<std::size_t>>>;

template <class Key> Levels levels_of(const Design& design, const std::function<Key(const io::Condition&)>& key,
                                      const std::function<std::string(const Key&)>& label) {
  std::map<Key, std::vector<std::size_t>> by_key;
  for (std::size_t i = 0; i < design.size(); ++i) {
    if (design.shows_board(i)) by_key[key(design.conditions()[i])].push_back(i);  // the others have no such levels
  }
  Levels levels;
  for (auto& [level, conditions] : by_key) levels.emplace_back(label(level), std::move(conditions));
  return levels;
}

class Folds {
 public:
  explicit Folds(const Design& design) : design_(design) {}

  std::vector<Fold> singly() {
    one_by_one(each_distance, distances());
    one_by_one(each_target, targets());
    return std::move(folds_);
  }

  std::vector<Fold> halves(std::size_t count, std::uint64_t seed) {
    const std::vector<std::size_t> cluster = clusters_of(design_);
    Levels levels(1 + std::ranges::max(cluster));
    for (std::size_t i = 0; i < cluster.size(); ++i) {
      const io::Condition& c = design_.conditions()[i];
      if (!design_.shows_board(i)) continue;
      levels[cluster[i]].first = fmt::format("{:.4g} m", c.board_distance) + (c.session.empty() ? "" : " " + c.session);
      levels[cluster[i]].second.push_back(i);
    }
    std::erase_if(levels, [](const auto& level) { return level.second.empty(); });
    std::vector<std::size_t> order(levels.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::mt19937_64 random(seed);
    for (std::size_t h = 0; h < count; ++h) {
      // Not std::shuffle, which is another one in another library.
      for (std::size_t k = order.size() - 1; k > 0; --k) std::swap(order[k], order[random() % (k + 1)]);
      add(any_half, levels, std::span(order).first(order.size() / 2), false);
    }
    return std::move(folds_);
  }

  std::vector<Fold> all() {
    ordered("distance", distances());
    if (folds_.empty())
      ordered("integration time",
              levels_of<double>(
                  design_, [](const io::Condition& c) { return c.integration_time; }, number("ms", 1e3)));
    each("target", targets());
    each("session", levels_of<std::string>(
                        design_, [](const io::Condition& c) { return c.session; }, word));
    return std::move(folds_);
  }

 private:
  static std::function<std::string(const double&)> number(const char* unit, double scale) {
    return [=](const double& value) { return fmt::format("{:.4g} {}", scale * value, unit); };
  }
  static std::string word(const std::string& text) { return text; }

  Levels distances() const {
    return levels_of<double>(
        design_, [](const io::Condition& c) { return c.board_distance; }, number("m", 1));
  }
  Levels targets() const {
    return levels_of<std::string>(
        design_, [](const io::Condition& c) { return c.target; }, word);
  }

  void one_by_one(const std::string& setting, const Levels& levels) {
    for (std::size_t k = 0; k < levels.size() && levels.size() > 1; ++k) add(setting, levels, std::span(&k, 1), false);
  }

  void add(const std::string& setting, const Levels& levels, std::span<const std::size_t> chosen, bool extrapolates) {
    Fold fold{setting, "", {}, extrapolates};
    std::vector<std::string> names;
    for (const std::size_t level : chosen) {
      names.push_back(levels[level].first);
      std::ranges::copy(levels[level].second, std::back_inserter(fold.held));
    }
    std::ranges::sort(fold.held);
    fold.levels = fmt::format("{}", fmt::join(names, ", "));
    const std::size_t left = design_.boards() - fold.held.size();
    // A few conditions of other sessions cannot predict a campaign that was joined with them.
    const double needed =
        setting == "session" ? settings.min_left_by_session * static_cast<double>(design_.boards()) : 0;
    if (left >= settings.min_conditions && static_cast<double>(left) >= needed) folds_.push_back(std::move(fold));
  }

  void ordered(const std::string& setting, const Levels& levels) {
    if (levels.size() < settings.min_levels) return;
    const auto ends = static_cast<std::size_t>(std::ceil(settings.end_share * static_cast<double>(levels.size())));
    std::vector<std::size_t> nearest, farthest;
    for (std::size_t k = 0; k < ends; ++k) {
      nearest.push_back(k);
      farthest.insert(farthest.begin(), levels.size() - 1 - k);
    }
    add(setting, levels, nearest, true);
    const std::size_t inner = levels.size() - 2 * ends, groups = std::min(settings.interleaved_groups, inner);
    for (std::size_t g = 0; g < groups; ++g) {
      std::vector<std::size_t> chosen;
      for (std::size_t k = ends + g; k < levels.size() - ends; k += groups) chosen.push_back(k);
      add(setting, levels, chosen, false);
    }
    add(setting, levels, farthest, true);
  }

  void each(const std::string& setting, const Levels& levels) {
    if (levels.size() < 2) return;
    const std::size_t groups = std::min(settings.min_levels, levels.size());
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
std::vector<Fold> single_levels(const Design& design) { return Folds(design).singly(); }
std::vector<Fold> random_halves(const Design& design, std::size_t count, std::uint64_t seed) {
  return Folds(design).halves(count, seed);
}

std::vector<std::size_t> clusters_of(const Design& design) {
  std::map<std::pair<double, std::string>, std::size_t> known;
  std::vector<std::size_t> together, single;
  for (const io::Condition& c : design.conditions()) {
    const double where = c.is_capped() ? 0 : c.board_distance;
    together.push_back(known.try_emplace({where, c.session}, known.size()).first->second);
    single.push_back(single.size());
  }
  return known.size() < settings.min_clusters ? single : together;
}

}  // namespace tofgraph::diagnosis
