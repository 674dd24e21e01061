// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Selection of the effects that explain what a model does not, one class for each kind of addition.
#pragma once

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/board_nuisances.hpp"
#include "diagnosis/model/fit.hpp"
#include "diagnosis/search/alternatives.hpp"
#include "diagnosis/search/maps.hpp"

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Steps of a search, so that a reader can follow why an effect was accepted or rejected ----

struct Step {
  /// ranked, fitted, fitted again, maps, taken out, allowed, questioned, valued, exchanged, followed, proved
  std::string what;
  std::vector<std::string> effects;                     ///< that it was done with, "effect.parameter" for refinements
  std::vector<std::pair<std::string, double>> numbers;  ///< NaN: there is none
  std::string outcome;
};

// ---- Task of a selection and the model that it has reached, which all its steps share ----

struct SearchOptions {
  std::size_t max_effects = settings.max_effects;
  std::uint64_t seed = 1;
  std::size_t flips = settings.sign_flips;
  std::function<void(const std::string& what)> progress;             ///< may be empty
  std::function<void(std::size_t done, std::size_t all)> fold_done;  ///< may be empty; from any thread
  Deadline deadline = {};  ///< of the search; what it has established by then is verified
  /// Refits a model with those of the given values held that the data do not determine; nothing where all are
  /// determined. May be empty.
  std::function<std::optional<ModelFit>(const Problem& problem, const ModelFit& fit)> hold_given;
  Deadline verification = {};  ///< of that; where it passes, the model stays as it was given
  Deadline comparison = {};    ///< of what is written with what else could stand in its place
};

/// The model that a selection has reached. Undoing a step is assigning a copy.
struct SelectedModel {
  ModelFit original, best;               ///< the model as it is, and with what was added
  std::vector<const Candidate*> barred;  ///< roots that are not tried: exchanged, or they gave no number
  /// The best model with its effects as they were while the drift had a mean, where that has just been taken away: it
  /// stood for a constant, and in the fit without either other effects may bend to make up for that.
  std::optional<ModelFit> about_drift_mean = {};

  /// The model as it is, with the nuisances of the best one and at its grid bias, so that both can be compared.
  ModelFit original_beside_best() const {
    ModelFit given = original;
    given.state.nuisances = best.state.nuisances;
    given.state.linearisation.grid_bias = best.state.linearisation.grid_bias;
    return given;
  }
};

/// Data, candidates and options of a selection, with its log.
struct SelectionTask {
  const Problem problem;
  const std::vector<Term>& model;  ///< as it is
  const std::vector<std::unique_ptr<Candidate>>& candidates;
  const SearchOptions& options;
  std::map<std::string, std::string> refused;  ///< effects that are not tried, and why
  std::vector<Step> trace = {};

  double bic(const ModelFit& fit) const { return fit.bic(problem.data.size()); }
  std::size_t added(const ModelFit& fit) const { return fit.state.terms.size() - model.size(); }
  bool may_add(const ModelFit& fit) const { return fit.state.terms.size() < model.size() + options.max_effects; }
  void report_progress(const std::string& what) const {
    if (options.progress) options.progress(what);
  }
  void note(Step step) { trace.push_back(std::move(step)); }
};

// ---- Effects with a number for every pixel: they come last, and may take the place of others ----

class MapSearch {
 public:
  /// @param task must live on
  explicit MapSearch(SelectionTask& task) : task_(task) {}

  /// When no effect with a few parameters helps any more: maps beside what was found or in its place, if these are
  /// worth their parameters.
  std::optional<ModelFit> best(const SelectedModel& selected);
  /// Maps beside the model as it was, without what was added: those of one effect, and beside them those of others
  /// while these are worth it and more than enough is left. @param enough chi-square over its expectation
  std::optional<MapTrial> alone(const SelectedModel& selected, double enough);
  /// Maps alone where they explain all there is beside the model as it was, or nearly, and what was added to it does
  /// not: that stands for a part of them. @param added with its jacobian
  std::optional<ModelFit> in_place_of(const ModelFit& added, const SelectedModel& selected);

 private:
  std::optional<MapTrial> beside(const ModelFit& base);

  SelectionTask& task_;
};

// ---- The mean of a map of lengths and a constant offset are one and the same ----

/// A state in which the constant has all of it, where the model has one: estimated maps of lengths then have no mean
/// over the pixels. It expects the same as before. @throws simulation::EffectError
State with_means_in_constant(const Problem& problem, State state);

// ---- Boards that are not flat: their shapes are found with the model, anew for another one ----

class BoardFlatnessSearch {
 public:
  /// @param task must live on
  explicit BoardFlatnessSearch(const SelectionTask& task) : task_(task) {}

  /// Shapes beside a model; nothing if it has some already, or none are worth it.
  BoardTrial beside(const State& state);
  /// Boards and effects in turn, until neither changes. Effects that have a part in the shapes of boards take that back
  /// when they are found anew beside them. A model without boards stays as it is.
  /// @throws simulation::EffectError, but where the values went too far
  ModelFit refit(ModelFit fit);
  /// Shapes need not be the boards' by themselves, see BoardTrial::sure.
  void accept_unsure(bool accepted) { accept_unsure_ = accepted; }

 private:
  bool refit_once(ModelFit& fit) const;

  const SelectionTask& task_;
  std::unique_ptr<const BoardFlatness> shapes_;  ///< when they are asked for
  bool accept_unsure_ = false;
};

// ---- The best set of effects that may be added: sets that the linearised problem promises are fitted ----

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

// ---- Selection by the information criterion alone: none is tested ----

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
  /// Takes the best model without an addition as the best one.
  void drop(const ModelTerm& addition);
  /// Replaces an effect by others that explain as much beside the rest of the model; it is not added again.
  /// @returns true if there are such others
  bool exchange(const Candidate& one);
  /// Fits the best model again with the grid bias of every pixel.
  void refit();
  /// The same fit of another model with the nuisances of the best one; nothing is stored.
  /// @throws simulation::EffectError
  ModelFit refitted(State state) const;
  /// Fits a model and takes it as the best one. Where an effect cannot make its images, everything stays as it was, and
  /// an effect that was new is not tried again. @returns true if it was taken
  bool try_accept(State state);
  /// Takes a fit as the best one, with its jacobian. Where it leaves another mean of the drift, it and the original
  /// model are fitted again about that.
  void accept(ModelFit fit);
  /// Takes the given model as the best one: its parameters as they were given, reflectivities and variances fitted.
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
