// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Candidates scored against what a fit leaves, and the most promising fitted jointly with what the fit has.
#pragma once

#include "diagnosis/search/probes.hpp"

namespace tofgraph::diagnosis {

/// A candidate in a model, with its score before it was fitted.
struct Trial {
  const Candidate* candidate = nullptr;
  ModelFit fit;
  Score score;
};

class Trials {
 public:
  Trials(const Problem& problem, const std::vector<std::unique_ptr<Candidate>>& candidates,
         std::span<const double> weight)
      : problem_(problem), candidates_(candidates), weight_(weight) {}

  /// Probes the candidates anew. @param state what their changes are made to @param refused which are not tried, and
  /// why
  void prepare(const State& state, const std::map<std::string, std::string>& refused) {
    probes_ = probes_of(problem_, state, candidates_);
    probes_.refused.insert(refused.begin(), refused.end());
  }
  const std::map<std::string, std::string>& refused() const { return probes_.refused; }

  /// The best candidates, fitted, best first by BIC.
  /// @param except a candidate that is scored and not fitted, or nullptr
  /// @param promising share of the best score below which none is fitted
  /// @param always names of those that are fitted whatever their score
  std::vector<Trial> best(const ModelFit& base, const Candidate* except, double promising,
                          std::span<const std::string> always = {}) const;

 private:
  std::vector<State> starts(const State& state, const Probe& probe, const Score& score) const;
  Trial fitted(const ModelFit& base, const Probe& probe, const Score& score) const;

  const Problem& problem_;
  const std::vector<std::unique_ptr<Candidate>>& candidates_;
  std::span<const double> weight_;
  Probes probes_;
};

/// Names of the effects that are confused with one, as its author or theirs say.
std::vector<std::string> confused_with(const Candidate& one, const std::vector<std::unique_ptr<Candidate>>& candidates);

/// The model without a piece. The derivatives are those of the model with it. @throws simulation::EffectError
ModelFit without(const Problem& problem, const ModelFit& best, const ModelTerm& piece, std::span<const double> weight);

}  // namespace tofgraph::diagnosis
