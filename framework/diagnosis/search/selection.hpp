// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Selection of the effects that explain what a model does not, by the information criterion alone: none is
/// tested.
#pragma once

#include "diagnosis/search/subset_search.hpp"

#include <deque>

namespace tofgraph::diagnosis {

/// A model's effects and those that were added to it, fitted to some conditions.
class Selection {
 public:
  /// @param model terms of the model as it is; these are refitted; all must live on
  /// @param refused effects that are not tried, and why
  Selection(const Problem& problem, const std::vector<Term>& model,
            const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options,
            std::map<std::string, std::string> refused);
  Selection(const Selection&) = delete;
  Selection& operator=(const Selection&) = delete;

  /// Fits the model as it is; after that the deadline counts. To be called first. @throws simulation::EffectError
  void begin();
  /// Linearises the candidates beside it. To be called next. @throws TimeExpired
  void linearise() { subsets_.linearise(best().state); }
  /// Adds effects until none is worth its parameters, and takes out what is not.
  void forward_select();
  /// Looks for more effects beside the nuisances of conditions. @param anew nothing is left of a model that was
  /// refuted: where something is left beside it and sets of effects promise what they promised then, they would lead to
  /// it again, and none are looked for
  /// @returns whether they were looked for
  bool select_beside_nuisances(bool anew = false);
  /// The best model without an addition: fitted once, and kept until there is another best one.
  /// @throws simulation::EffectError
  const ModelFit& without(const ModelTerm& addition);
  /// See SubsetSearch::forms_of().
  std::vector<ModelFit> forms_of(const ModelFit& base, const Candidate& one) const {
    return subsets_.forms_of(base, one);
  }
  /// A model without an addition in the place of the best one.
  void drop(const ModelTerm& addition);
  /// Others in the place of an effect, beside all that is there, where these explain as much; it is not added again.
  /// @returns whether they do
  bool exchange(const Candidate& one);
  /// Fits exactly, by every pixel.
  void refit();
  /// Another model, likewise, with the nuisances of the best one. @throws simulation::EffectError
  ModelFit refitted(State state) const;
  /// A model in the place of the best one, fitted; where an effect cannot do its images all stays as it was, and if it
  /// was new it is not tried again. @returns whether it can
  bool try_accept(State state);
  /// A fit in the place of the best one, as it is.
  void accept(ModelFit fit);
  /// The parameters of the model as it was given, reflectivities and variances fitted, in the place of the best one.
  void return_to_given();

  const SelectedModel& selected() const { return selected_; }
  /// Undoes what was selected since.
  void select(SelectedModel model);
  /// The last model to which effects were added: what there is where time ends before all have been.
  const SelectedModel& reached() const { return *reached_; }
  void set_deadline(const Deadline& deadline) { deadline_ = deadline; }

  SelectionTask& task() { return task_; }
  const SelectionTask& task() const { return task_; }
  const Problem& problem() const { return task_.problem; }
  const ModelFit& original() const { return selected_.original; }  ///< the model as it is
  const ModelFit& best() const { return selected_.best; }
  const std::vector<Term>& terms() const { return best().state.terms; }
  /// Every addition: the effects, and the refinements of these and of the model's own.
  std::vector<ModelTerm> additions() const;
  /// Changes that candidates could make to the model as it is.
  const Alternatives& alternatives() const { return subsets_.alternatives(); }
  double bic(const ModelFit& fit) const { return task_.bic(fit); }
  std::span<const double> weight() const { return task_.weight; }

 private:
  void update_drift_mean();
  bool add_best();
  void add_all();
  bool leaves_nearly_all(const ModelFit& added) const;
  bool reselect_without(const Candidate& one, double promised, double limit);
  void backward_eliminate();
  void refine(State state);
  void select_from_boards();
  void select_from_maps();
  void replace_maps();
  bool update_nuisances();
  bool allow_boards(std::shared_ptr<const Boards> boards);
  bool allow(ConditionNuisances more);
  std::size_t left_out() const { return selected_.barred.size() + task_.refused.size(); }
  double left() const { return lack_of_fit(problem(), best()); }

  Deadline deadline_;  ///< of the problem
  SelectionTask task_;
  MapSearch maps_{task_};
  BoardFlatnessSearch boards_{task_};
  SubsetSearch subsets_{task_, maps_, boards_};
  SelectedModel selected_;
  std::optional<SelectedModel> reached_;
  std::deque<std::pair<ModelTerm, ModelFit>> without_;  ///< what was asked for of the best one; references stay
};

}  // namespace tofgraph::diagnosis
