// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/confidence.hpp"

#include "diagnosis/search/injection.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tofgraph::diagnosis {
namespace {

/// The only one that was found is the truth, or cannot be told from it; or several that it may stand for.
bool right(const SearchResult& result, const Candidate& truth) {
  const bool alone = result.found.size() == 1;
  const auto is_right = [&](const EffectFinding& found) {
    return (alone && &found.candidate->root() == &truth) || std::ranges::any_of(found.rivals, [&](const Rival& rival) {
             return rival.tied && rival.candidate == &truth && (alone || rival.of_several());
           });
  };
  return !result.found.empty() && std::ranges::all_of(result.found, is_right);
}

}  // namespace

Confidence confidence(const Problem& problem, const std::vector<Term>& model,
                      const std::vector<std::unique_ptr<Candidate>>& candidates, const Audit& audit, const State& found,
                      std::size_t cases, SearchOptions options) {
  std::vector<const Candidate*> truths = {nullptr};
  for (const Visibility& seen : audit.effects) {
    if (!seen.blind) truths.push_back(seen.candidate);
  }
  const auto progress = options.progress;
  options.progress = {};
  Confidence result;
  for (std::size_t k = 0; k < cases; ++k) {
    const Candidate* truth = truths[k % truths.size()];
    if (progress) progress(fmt::format("injecting case {} of {}", k + 1, cases));
    const std::uint64_t seed = options.seed + 1000 * (k + 1);
    State state{model, found.log_reflectivity, found.random_sd, found.nuisances};
    if (truth != nullptr) state.terms.push_back(random_term(*truth, 1, seed));
    const std::vector<Observations> data = injected(problem, state, seed + 1);
    const Problem injected_problem{problem.design, data, problem.targets, problem.target, problem.nuisances};
    const SearchResult searched = search(injected_problem, model, candidates, options);
    if (searched.found.empty()) {
      ++result.silent;
      result.silent_right += truth == nullptr ? 1U : 0U;
    } else {
      ++result.named;
      result.named_right += truth != nullptr && right(searched, *truth) ? 1U : 0U;
    }
  }
  return result;
}

}  // namespace tofgraph::diagnosis
