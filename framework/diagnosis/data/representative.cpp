// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/design.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <string_view>
#include <tuple>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Texts of the settings, the distance first.
std::vector<std::string> setting_texts(const io::Condition& c) {
  const auto text = [](const auto& value) { return fmt::format("{}", value); };
  return {text(c.board_distance),
          text(c.board_tilt_x),
          text(c.board_tilt_y),
          c.target,
          text(c.reflectivity),
          text(c.integration_time),
          fmt::format("{}", fmt::join(c.sources, " ")),
          c.ambient,
          text(c.roll),
          text(c.velocity),
          c.session,
          c.reference,
          c.lens,
          c.rail,
          text(c.time_since_power_on),
          text(c.temperature)};
}

using Indices = std::vector<std::size_t>;

/// Conditions with equal settings apart from the distance.
struct Group {
  std::vector<std::size_t> levels;  ///< index of the level of each setting
  std::vector<Indices> distances;   ///< conditions of each distance, ascending
};

/// Order of n positions in which every beginning is spread evenly over all of them, by the golden ratio.
/// @param start of the first one, 0 to 1
Indices spread_order(std::size_t n, double start) {
  Indices order;
  std::vector<bool> seen(n, false);
  for (double at = start; order.size() < n; at = std::fmod(at + 1 / std::numbers::phi, 1)) {
    const std::size_t position = std::min(static_cast<std::size_t>(at * static_cast<double>(n)), n - 1);
    if (!seen[position]) order.push_back(position);
    seen[position] = true;
  }
  return order;
}

/// Groups of the conditions. Settings with nearly as many levels as conditions are wanted, such as a temperature, do
/// not divide them.
std::vector<Group> groups_of(const std::vector<io::Condition>& conditions, std::size_t count) {
  std::vector<std::vector<std::string>> texts;
  for (const io::Condition& condition : conditions) texts.push_back(setting_texts(condition));
  std::vector<std::size_t> dividing;
  std::vector<std::map<std::string, std::size_t>> levels(texts.front().size());
  const double most = settings.max_level_share * static_cast<double>(count);
  for (std::size_t s = 1; s < levels.size(); ++s) {
    for (const auto& text : texts) levels[s].try_emplace(text[s], levels[s].size());
    if (levels[s].size() > 1 && static_cast<double>(levels[s].size()) <= std::max(most, 2.0)) dividing.push_back(s);
  }
  Indices sorted(conditions.size());
  std::iota(sorted.begin(), sorted.end(), std::size_t{0});
  const auto place = [&](std::size_t i) {
    const io::Condition& c = conditions[i];
    return std::tuple(c.has_board() ? c.board_distance : 0, c.order.value_or(0), std::string_view(c.id));
  };
  std::ranges::sort(sorted, {}, place);
  std::map<std::vector<std::string>, std::pair<Group, std::map<std::string, std::size_t>>> found;
  for (const std::size_t i : sorted) {
    std::vector<std::string> key;
    for (const std::size_t s : dividing) key.push_back(texts[i][s]);
    auto& [group, known] = found[key];
    const std::size_t at = known.try_emplace(settings_of(conditions[i]), known.size()).first->second;
    group.distances.resize(known.size());
    group.distances[at].push_back(i);
  }
  std::vector<Group> groups;
  for (auto& [key, of_key] : found) {
    groups.push_back(std::move(of_key.first));
    for (std::size_t k = 0; k < key.size(); ++k) groups.back().levels.push_back(levels[dividing[k]].at(key[k]));
  }
  return groups;
}

/// Order of the groups: each next has the level that was used least, so that the first ones represent every level.
/// @param most groups that are ordered; the others are dropped
std::vector<Group> in_turn(std::vector<Group> groups, std::size_t most) {
  std::mt19937_64 random(1);  // decides between equals, so that the levels of two settings are not tied to each other
  for (std::size_t k = groups.size() - 1; k > 0; --k) std::swap(groups[k], groups[random() % (k + 1)]);
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> index;
  for (Group& group : groups) {
    for (std::size_t s = 0; s < group.levels.size(); ++s)
      group.levels[s] = index.try_emplace({s, group.levels[s]}, index.size()).first->second;
  }
  std::vector<std::size_t> used(index.size(), 0);
  const auto uses = [&](const Group& group) {
    std::pair<std::size_t, std::size_t> result{std::numeric_limits<std::size_t>::max(), 0};  // least used level, all
    for (const std::size_t level : group.levels) {
      result.first = std::min(result.first, used[level]);
      result.second += used[level];
    }
    return result;
  };
  most = std::min(most, groups.size());
  for (std::size_t k = 0; k < most; ++k) {
    const auto rest = groups.begin() + static_cast<std::ptrdiff_t>(k);
    std::iter_swap(rest, std::ranges::min_element(rest, groups.end(), {}, uses));
    for (const std::size_t level : groups[k].levels) ++used[level];
  }
  groups.resize(most);
  return groups;
}

/// Conditions of each distance of each group, in the order in which they are chosen.
std::vector<const Indices*> turns_of(const std::vector<Group>& groups) {
  std::vector<Indices> orders;
  std::size_t rounds = 0;
  for (const Group& group : groups) {
    const double start = std::fmod(static_cast<double>(orders.size()) * std::numbers::sqrt2, 1);  // differs by group
    orders.push_back(spread_order(group.distances.size(), start));
    rounds = std::max(rounds, group.distances.size());
  }
  std::vector<const Indices*> turns;
  for (std::size_t round = 0; round < rounds; ++round) {
    for (std::size_t g = 0; g < groups.size(); ++g)
      if (round < orders[g].size()) turns.push_back(&groups[g].distances[orders[g][round]]);
  }
  return turns;
}

}  // namespace

std::string settings_of(const io::Condition& c) { return fmt::format("{}", fmt::join(setting_texts(c), "|")); }

std::vector<std::size_t> representative_conditions(const std::vector<io::Condition>& conditions, std::size_t count) {
  Indices chosen;
  if (conditions.size() <= count) {
    chosen.resize(conditions.size());
    std::iota(chosen.begin(), chosen.end(), std::size_t{0});
    return chosen;
  }
  const std::vector<Group> groups = in_turn(groups_of(conditions, count), count);
  const std::vector<const Indices*> turns = turns_of(groups);
  const auto choose = [&](const Indices& repeated, std::size_t k) {
    const bool chooses = k < repeated.size() && chosen.size() < count;
    if (chooses) chosen.push_back(repeated[k]);
    return chooses;
  };
  std::vector<std::size_t> done;  // repetitions that are chosen, one per turn
  double repetitions = 0;
  for (const Indices* const repeated : turns) {
    choose(*repeated, 0);
    done.push_back(1);
    if (repetitions < settings.share_of_repetitions * static_cast<double>(chosen.size()) && choose(*repeated, 1))
      ++done.back(), ++repetitions;
  }
  while (chosen.size() < count) {  // all settings are chosen
    for (std::size_t t = 0; t < turns.size(); ++t) done[t] += choose(*turns[t], done[t]) ? 1 : 0;
  }
  std::ranges::sort(chosen);
  return chosen;
}

}  // namespace tofgraph::diagnosis
