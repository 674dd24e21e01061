// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/fold_agreement.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

using Names = std::set<std::string>;

/// Effects that more than half of the folds chose and a model lacks.
Names agreed_and_lacking(const CrossFit& folds, const State& model, std::size_t given) {
  std::map<std::string, std::size_t> times;
  for (const FoldResult& fold : folds.folds) {
    for (const std::string& name : fold.chosen) ++times[name];
  }
  for (std::size_t t = given; t < model.terms.size(); ++t) times.erase(model.terms[t].candidate->name());
  Names names;
  for (const auto& [name, count] : times) {
    if (2 * count > folds.folds.size()) names.insert(name);
  }
  return names;
}

}  // namespace

std::vector<State> agreed_models(const CrossFit& folds, const State& model, std::size_t given) {
  if (folds.folds.size() < settings.min_agreeing_folds) return {};
  const Names lacking = agreed_and_lacking(folds, model, given);
  std::map<Names, std::vector<const FoldResult*>> sets;
  for (const FoldResult& fold : folds.folds) {
    const Names chosen(fold.chosen.begin(), fold.chosen.end());
    if (std::ranges::any_of(lacking, [&](const std::string& name) { return chosen.contains(name); }))
      sets[chosen].push_back(&fold);
  }
  std::vector<const std::vector<const FoldResult*>*> ranked;
  for (const auto& [names, of_set] : sets) ranked.push_back(&of_set);
  std::ranges::stable_sort(ranked, std::greater<>{}, [](const auto* of_set) { return of_set->size(); });
  std::vector<State> models;
  for (const auto* of_set : ranked) {
    if (models.size() < settings.max_agreed_models) models.push_back(of_set->front()->state);
  }
  return models;
}

}  // namespace tofgraph::diagnosis
