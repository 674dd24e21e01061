// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Target labels that are probably misspelled: a misspelling adds a target with its own reflectivity without any error.
#include "io/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace tofgraph::io {
namespace {

constexpr std::size_t few = 2, many = 3;  ///< conditions of a target
constexpr std::size_t shortest = 3;       ///< characters: shorter labels are all similar to each other
constexpr std::size_t times_as_many = 2;  ///< minimum ratio to the conditions of a rare target

std::string without_numbers(std::string label) {
  std::erase_if(label, [](char c) { return c >= '0' && c <= '9'; });
  return label;
}

}  // namespace

void warn_of_targets(const Campaign& campaign, config::Diagnostics& diagnostics) {
  std::map<std::string, std::vector<const Condition*>> targets;
  for (const Condition& condition : campaign.conditions) {
    if (!condition.target.empty()) targets[condition.target].push_back(&condition);
  }
  for (const auto& [label, conditions] : targets) {
    if (conditions.size() > few || label.size() < shortest) continue;
    std::vector<std::string> usual;
    for (const auto& [other, its] : targets) {
      if (its.size() >= std::max(many, times_as_many * conditions.size()) && other.size() >= shortest &&
          without_numbers(other) != without_numbers(label))
        usual.push_back(other);
    }
    const std::string meant = config::nearest(label, usual);
    if (meant.empty()) continue;
    diagnostics.warning(
        conditions.front()->place("target"),
        fmt::format("target '{}' has {} only", label, conditions.size() == 1 ? "one condition" : "two conditions"),
        fmt::format("did you mean '{}'?", meant));
  }
}

}  // namespace tofgraph::io
