// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Candidates scored against what a fit leaves, and the most promising fitted jointly with what the fit has.
#pragma once

#include "diagnosis/model/scan.hpp"

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Changes that each candidate would make, before any is fitted ----

/// A candidate with shapes at which its sizes are scored.
struct Probe {
  const Candidate* candidate = nullptr;
  std::vector<double> values;
  std::vector<std::size_t> amplitudes;  ///< the parameters that the columns of its group stand for
  std::vector<double> steps;            ///< of these, SI: what one column is for

  /// A state with it. @param chosen values of its parameters
  State placed(State state, std::span<const double> chosen) const;
};

/// Probes and their columns: the change that a typical step of each size makes. A whole step and not a derivative,
/// for some effects begin with the square of their size.
struct Probes {
  std::vector<Probe> list;
  std::vector<Group> groups;
  std::map<std::string, std::string> refused;  ///< candidates that cannot be used, and why
};

/// @param state what the changes are made to; candidates that are in it are left out
Probes probes_of(const Problem& problem, const State& state, const std::vector<std::unique_ptr<Candidate>>& candidates,
                 NonlinearRange range = NonlinearRange::any);

/// Change of the rows by one step of a parameter, and where the effect cannot do that by one to the other side.
/// @param rows without the step @param placed makes the state with some values of the parameters
/// @throws simulation::EffectError it can do neither
Column change_by_step(const Problem& problem, const Rows& rows, std::vector<double> values, std::size_t parameter,
                      double step, const std::function<State(std::span<const double>)>& placed);

/// True if a state has an effect of this name.
bool is_in(const State& state, const Candidate& candidate);

// ---- Candidates scored against what a fit leaves, and the most promising fitted jointly with what the fit has ----

/// A candidate in a model, with its score before it was fitted.
struct Trial {
  const Candidate* candidate = nullptr;
  ModelFit fit;
  Score score;
};

class Trials {
 public:
  Trials(const Problem& problem, const std::vector<std::unique_ptr<Candidate>>& candidates)
      : problem_(problem), candidates_(candidates) {}

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
  Probes probes_;
};

/// Names of the effects that are confused with one, as its author or theirs say.
std::vector<std::string> confused_with(const Candidate& one, const std::vector<std::unique_ptr<Candidate>>& candidates);

/// The model without a piece. The derivatives are those of the model with it. @throws simulation::EffectError
ModelFit without(const Problem& problem, const ModelFit& best, const ModelTerm& piece);

// ---- Lower limits of the deviance that a model loses without a term, before it is fitted without it ----

/// Least rises of the deviance where each of some pieces is taken out of a model: what its change of the data makes
/// that no other effect and no map can make, linearised, if boards and light take over as much as they can. 0 where
/// that is not known: of pieces with maps, and of those without which others give no number.
std::vector<double> min_deviance_rises(const Problem& problem, const ModelFit& best, std::span<const ModelTerm> pieces);

}  // namespace tofgraph::diagnosis
