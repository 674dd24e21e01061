// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/mistakes.hpp"

#include <set>
#include <tuple>
#include <utility>

namespace tofgraph::hidden {
namespace {

/// Another one of the conditions' values.
template <class T>
bool replace(io::Campaign& campaign, std::size_t condition, T io::Condition::*member, std::mt19937_64& random) {
  std::set<T> values;
  for (const io::Condition& c : campaign.conditions) values.insert(c.*member);
  T& value = campaign.conditions[condition].*member;
  values.erase(value);
  if (values.empty()) return false;
  value = *std::next(values.begin(), static_cast<std::ptrdiff_t>(random() % values.size()));
  return true;
}

/// Swapping two repetitions with the same settings is no error.
bool same_settings(const io::Condition& a, const io::Condition& b) {
  const auto settings = [](const io::Condition& c) {
    return std::tie(c.board_distance, c.board_tilt_x, c.board_tilt_y, c.target, c.integration_time, c.sources, c.roll);
  };
  return settings(a) == settings(b);
}

}  // namespace

std::vector<std::size_t> make_mistake(io::Campaign& campaign, Mistake mistake, std::mt19937_64& random) {
  const std::size_t n = campaign.conditions.size(), first = random() % n;
  io::Condition& condition = campaign.conditions[first];
  const bool up = random() % 2 == 0;
  switch (mistake) {
    case Mistake::factor_ten:
      condition.board_distance *= up ? 10 : 0.1;
      return {first};
    case Mistake::distance: {
      const double factor = 1 + std::uniform_real_distribution<double>(0.13, 1)(random);
      condition.board_distance *= up ? factor : 1 / factor;
      return {first};
    }
    case Mistake::swapped: {
      std::size_t second = first;
      while (same_settings(condition, campaign.conditions[second])) second = random() % n;
      std::swap(condition.capture, campaign.conditions[second].capture);
      return {first, second};
    }
    case Mistake::target:
      if (replace(campaign, first, &io::Condition::target, random)) return {first};
      return {};
    case Mistake::integration_time:
      if (replace(campaign, first, &io::Condition::integration_time, random)) return {first};
      return {};
  }
  return {};
}

}  // namespace tofgraph::hidden
