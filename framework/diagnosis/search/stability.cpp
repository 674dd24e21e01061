// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/stability.hpp"

#include <utility>

namespace tofgraph::diagnosis {

std::vector<Stability> stability(const Problem& problem, const std::vector<Term>& model,
                                 const std::vector<std::unique_ptr<Candidate>>& candidates, std::size_t halves,
                                 const SearchOptions& options) {
  std::vector<Fold> folds = single_levels(problem.design);
  for (Fold& half : random_halves(problem.design, halves, options.seed)) folds.push_back(std::move(half));
  const CrossFit all = cross_fit(folds, problem.design, problem.data, model, candidates, options);
  std::vector<Stability> result;
  for (const char* setting : {each_distance, each_target, any_half}) {
    Stability one{setting, 0, {}, all.gap(distance, setting, options.seed)};
    for (const FoldResult& fold : all.folds) {
      if (fold.fold.setting != setting || !fold.failed.empty()) continue;
      ++one.runs;
      for (const std::string& name : fold.chosen) ++one.chosen[name];
    }
    if (one.runs > 0) result.push_back(std::move(one));
  }
  return result;
}

}  // namespace tofgraph::diagnosis
