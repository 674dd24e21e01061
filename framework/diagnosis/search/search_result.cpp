// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/search_result.hpp"

#include <set>

namespace tofgraph::diagnosis {

std::vector<std::string> names_of(const std::string& effect, std::span<const Rival> rivals) {
  std::vector<std::string> all = {effect};
  for (const Rival& rival : rivals) {
    if (rival.does_as_much()) all.push_back(rival.candidate->name());
  }
  return all;
}

bool beside_the_same(const State& one, std::span<const std::string> effects, const State& other,
                     const std::string& its) {
  const auto others = [](const State& of, std::span<const std::string> but) {
    std::multiset<std::string> names;
    for (const Term& term : of.terms) names.insert(term.candidate->name());
    for (const std::string& name : but) names.erase(name);
    return names;
  };
  return others(one, effects) == others(other, {&its, 1});
}

}  // namespace tofgraph::diagnosis
