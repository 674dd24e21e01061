// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The best set of effects that may be added to a model: sets that the linearised problem promises are fitted.
#pragma once

#include "diagnosis/search/alternatives.hpp"
#include "diagnosis/search/board_flatness_search.hpp"
#include "diagnosis/search/map_search.hpp"

namespace tofgraph::diagnosis {

/// Gain of a set of effects in the linearised problem.
struct Promise {
  std::vector<std::string> names;
  double gain = 0;
};

class SubsetSearch {
  /// A set that was fitted, by its alternatives; no fit where it gives no number.
  struct FittedSet {
    std::vector<std::size_t> choices;
    std::optional<ModelFit> fit;
  };

 public:
  /// @param task all must live on
  SubsetSearch(SelectionTask& task, MapSearch& maps, BoardFlatnessSearch& boards)
      : task_(task), maps_(maps), boards_(boards) {}

  /// Linearises the candidates beside a model. To be called first. @throws TimeExpired
  void linearise(const State& state);
  const Alternatives& alternatives() const { return alternatives_; }

  /// The best sets of the linearised problem are fitted, and again in the noise that the best of these leaves, until no
  /// other comes out. @param min_promise gain that a set must promise @returns nothing where none is worth it
  std::optional<ModelFit> best_set(const SelectedModel& selected, double min_promise = 0);
  /// An effect beside a model, in those of its forms that promise most; those that give no number are not there.
  /// @throws simulation::EffectError
  std::vector<ModelFit> forms_of(const ModelFit& base, const Candidate& one) const;
  /// True if sets of effects promise beside the model as it is what they promised at first.
  bool promises_as_before(const SelectedModel& selected) const;

 private:
  Alternatives alternatives_beside_best(const SelectedModel& selected) const;
  std::optional<ModelFit> best_of_round(const SelectedModel& selected, const Alternatives& all,
                                        const Eigen::MatrixXd& information, const std::vector<Subset>& sets,
                                        std::vector<FittedSet>& tried, ModelFit& best);
  std::vector<State> starts_of(const ModelFit& from, const Alternatives& all, const Subset& subset,
                               const Eigen::VectorXd& values) const;
  std::optional<ModelFit> fitted(const ModelFit& from, const Alternatives& all, const Subset& subset,
                                 const Eigen::MatrixXd& information) const;
  std::optional<ModelFit> fitted_beyond(const SelectedModel& selected, const Alternatives& all, const Subset& subset,
                                        const Eigen::MatrixXd& information, std::span<const FittedSet> tried);

  SelectionTask& task_;
  MapSearch& maps_;
  BoardFlatnessSearch& boards_;
  Alternatives alternatives_;      ///< beside the model as it is
  std::vector<Promise> promised_;  ///< likewise, when it was looked at first
};

}  // namespace tofgraph::diagnosis
