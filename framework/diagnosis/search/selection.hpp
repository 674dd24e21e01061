// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Selection of the effects that explain the residual of a model, one class for each kind of addition.
#pragma once

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/board_nuisances.hpp"
#include "diagnosis/model/fit.hpp"
#include "diagnosis/search/alternatives.hpp"
#include "diagnosis/search/maps.hpp"
#include "diagnosis/search/trials.hpp"

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Steps of a search, which show why an effect was accepted or rejected ----

struct Step {
  /// ranked: predicted gain of an effect alone; fitted, fitted again: a set; maps; taken out: by backward elimination;
  /// allowed: nuisances; questioned: tests on all data; valued: identifiability failed; exchanged: replaced by others;
  /// followed: model of a fold; proved: tests on held-out data
  std::string what;
  std::vector<std::string> effects;                     ///< effects concerned, "effect.parameter" for refinements
  std::vector<std::pair<std::string, double>> numbers;  ///< NaN: unknown
  std::string outcome;
};

// ---- Task of a selection and the model that it has reached, shared by all its steps ----

class GivenModel;

struct SearchOptions {
  std::size_t max_effects = settings.max_effects;
  std::uint64_t seed = 1;
  std::function<void(const std::string& what)> progress;             ///< may be empty
  std::function<void(std::size_t done, std::size_t all)> fold_done;  ///< may be empty; called from any thread
  Deadline deadline = {};       ///< for the search; its results until then are verified
  GivenModel* given = nullptr;  ///< holds those of its values that the data do not determine; null: they are fitted
  Deadline following = {};      ///< for what follows from the folds that were searched before the deadline
  Deadline verification = {};   ///< for the verification; if it passes, the given model is kept
  Deadline comparison = {};     ///< for the comparison of the written model with rivals
  std::span<const Alike> alike = {};  ///< of audit(); beside maps, the fit of a rival uses it
};

/// Model that a selection has reached. Selection::select() of a copy undoes a step, except the log and refused effects.
struct SelectedModel {
  ModelFit refitted_given, best;  ///< given model with refitted parameters, and the model with additions
  /// Forms not tried while it is selected, nor those that contain them: replaced by others, or failed.
  std::vector<const Candidate*> barred;
  /// Best model, with its effects as fitted while the drift had a mean, if that has just been removed: it replaced a
  /// constant, and in the fit without either, other effects may be distorted to compensate.
  std::optional<ModelFit> about_drift_mean = {};
  bool unsure_boards = false;  ///< true: board heights without evidence of their own are accepted, see BoardTrial::sure

  /// Given model, with the nuisances and the grid bias of the best one, so that both can be compared.
  ModelFit given_comparable_with_best() const {
    ModelFit given = refitted_given;
    given.state.nuisances = best.state.nuisances;
    given.state.precomputed.grid_bias = best.state.precomputed.grid_bias;
    return given;
  }
};

/// Data, candidates and options of a selection, with its log.
struct SelectionTask {
  const Problem problem;
  std::vector<Term> given_terms;  ///< of the given model; in the main search a copy of GivenModel::terms()
  const Candidates& candidates;
  const SearchOptions& options;
  std::map<std::string, std::string> refused;  ///< effects that are not tried, with reasons; never undone
  std::vector<Step> trace = {};

  double bic(const ModelFit& fit) const { return fit.bic(problem.data.size()); }
  std::size_t added(const ModelFit& fit) const { return fit.state.terms.size() - given_terms.size(); }
  bool may_add(const ModelFit& fit) const { return fit.state.terms.size() < given_terms.size() + options.max_effects; }
  void report_progress(const std::string& what) const {
    if (options.progress) options.progress(what);
  }
  void note(Step step) { trace.push_back(std::move(step)); }
};

// ---- Effects with a value per pixel: added last, possibly in place of others ----

class MapSearch {
 public:
  /// @param task must outlive this object
  explicit MapSearch(SelectionTask& task) : task_(task) {}

  /// Maps in addition to the effects found or in place of them, if they are worth their parameters. Called once no
  /// effect with few parameters helps any more.
  std::optional<ModelFit> best(const SelectedModel& selected);
  /// Maps added to the given model without the additions: those of one effect, then those of others while they are
  /// worth their parameters and the lack of fit exceeds `enough`. @param enough chi-square over its expectation
  std::optional<MapTrial> alone(const SelectedModel& selected, double enough);
  /// Maps alone, if they explain all or nearly all of the given model's residual and the addition does not: it then
  /// imitates a part of them. @param added including its jacobian
  std::optional<ModelFit> in_place_of(const ModelFit& added, const SelectedModel& selected);

 private:
  std::optional<MapTrial> best_added_to(const ModelFit& base);

  SelectionTask& task_;
};

// ---- Boards that are not flat: their heights are estimated with the model, again for each other model ----

class BoardFlatnessSearch {
 public:
  /// @param task must outlive this object
  explicit BoardFlatnessSearch(const SelectionTask& task) : task_(task) {}

  /// Board heights in addition to a model; empty if it has some already or they are not accepted.
  BoardTrial trial_for(const State& state);
  /// Fits boards and effects alternately until neither changes. Effects partly absorbed by the heights regain that part
  /// when the heights are estimated again. A model without board heights stays unchanged.
  /// @param unsure see SelectedModel::unsure_boards @throws simulation::EffectError, unless extrapolated values cause
  /// it
  ModelFit refit(ModelFit fit, bool unsure) const;

 private:
  bool refit_once(ModelFit& fit, bool unsure) const;

  const SelectionTask& task_;
  std::unique_ptr<const BoardFlatness> shapes_;  ///< made when first needed
};

// ---- Best set of effects to add: sets with the largest predicted gains are fitted ----

/// Predicted gain of a set of effects, from the linearised problem.
struct Promise {
  std::vector<std::string> names;
  double gain = 0;
};

class SubsetSearch {
  /// A fitted set, as indices of its alternatives; no fit if it failed.
  struct FittedSet {
    std::vector<std::size_t> choices;
    std::optional<ModelFit> fit;
  };

 public:
  /// @param task and the other arguments must outlive this object
  SubsetSearch(SelectionTask& task, MapSearch& maps, BoardFlatnessSearch& boards)
      : task_(task), maps_(maps), boards_(boards) {}

  /// Linearises the candidates about a model. To be called first. @throws TimeExpired
  void linearise_candidates(const State& state);
  const Alternatives& alternatives() const { return alternatives_; }

  /// Fits the best sets of the linearised problem, again with the best fit's variances, until no other set results.
  /// @param min_promise lowest predicted gain of a set @returns nullopt if none is worth its parameters
  std::optional<ModelFit> best_set(const SelectedModel& selected, double min_promise = 0);
  /// Fits of an effect added to a model, in its forms with the largest predicted gains; forms that fail are omitted.
  /// @throws simulation::EffectError
  std::vector<ModelFit> forms_of(const ModelFit& base, const Candidate& one) const;
  /// True if sets of effects predict the same gains for the present model as at first.
  bool promises_as_before(const SelectedModel& selected) const;

 private:
  Alternatives missing_alternatives(const SelectedModel& selected) const;
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
  Alternatives alternatives_;      ///< for the given model
  std::vector<Promise> promised_;  ///< predicted when first searched
};

// ---- Selection by the information criterion alone, without tests ----

/// Effects of a model and those added to it, fitted to some conditions.
class Selection {
 public:
  /// @param model terms of the given model, which are refitted; all arguments must outlive this object
  /// @param refused effects that are not tried, with reasons
  Selection(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
            const SearchOptions& options, std::map<std::string, std::string> refused);
  Selection(const Selection&) = delete;
  Selection& operator=(const Selection&) = delete;

  /// Fits the given model; the deadline applies from then on. To be called first. @throws simulation::EffectError
  void begin();
  /// Linearises the candidates about the given model. To be called next. @throws TimeExpired
  void linearise_candidates() { subsets_.linearise_candidates(best().state); }
  /// Adds effects until none is worth its parameters, and removes those that are not.
  void forward_select();
  /// Searches for more effects with the nuisances of conditions included. @param anew nothing remains of a model that
  /// was refuted: if the residual is unexplained and sets of effects predict the same gains as before, the search would
  /// lead to the same model, so it is skipped
  /// @returns true if effects were searched for
  bool select_beside_nuisances(bool anew = false);
  /// Best model without an addition: fitted once, and kept until the best model changes.
  /// @throws simulation::EffectError
  const ModelFit& without(const ModelTerm& addition);
  /// See SubsetSearch::forms_of().
  std::vector<ModelFit> forms_of(const ModelFit& base, const Candidate& one) const {
    return subsets_.forms_of(base, one);
  }
  /// Accepts the best model without an addition.
  void drop(const ModelTerm& addition);
  /// Replaces an effect by others that explain as much together with the rest of the model.
  /// @param barred form that is not added again @returns true if there are such others
  bool exchange(const Candidate& one, const Candidate& barred);
  bool exchange(const Candidate& one) { return exchange(one, one.root()); }
  /// Refits the best model with the grid bias of every pixel, with positive amplitudes and map means in the constant.
  void refit();
  /// Result of a comparison with another set of effects.
  struct Comparison {
    double bic_fall = NAN;  ///< NaN: an effect of the other set fails
    bool accepted = false;
  };
  /// Fits another set of effects, such as one found without some of the conditions or with more of them, and accepts it
  /// if it is better by settings.min_bic_gain; additions that are not worth their parameters are then removed.
  /// @param other its reflectivities and nuisances are not used
  Comparison take_if_better(State other);
  /// Fit of another model with the grid bias of every pixel and the nuisances of the best one; nothing is stored.
  /// @throws simulation::EffectError
  ModelFit fit_at_every_pixel(State state) const;
  /// Fits a model and accepts it as the best one. If an effect fails, nothing changes, and a new effect that failed is
  /// not tried again. @returns true if it was accepted
  bool try_accept(State state);
  /// Accepts a fit as the best one, with its jacobian. If the mean of its drift differs, it and the given model are
  /// refitted with that mean.
  void accept(ModelFit fit);
  /// Accepts the given model as the best one: its parameters as given, reflectivities and variances fitted.
  void return_to_given();

  const SelectedModel& selected() const { return selected_; }
  /// Restores an earlier selection.
  void select(SelectedModel model);
  /// Last model to which effects were added: the result if time ends before the selection is complete.
  const SelectedModel& reached() const { return *reached_; }
  void set_deadline(const Deadline& deadline) { deadline_ = deadline; }

  SelectionTask& task() { return task_; }
  const SelectionTask& task() const { return task_; }
  const Problem& problem() const { return task_.problem; }
  const ModelFit& refitted_given() const { return selected_.refitted_given; }
  const ModelFit& best() const { return selected_.best; }
  const std::vector<Term>& terms() const { return best().state.terms; }
  /// All additions: effects, and refinements of them and of the given model's effects.
  std::vector<ModelTerm> additions() const;
  /// Changes that candidates could make to the given model.
  const Alternatives& alternatives() const { return subsets_.alternatives(); }
  double bic(const ModelFit& fit) const { return task_.bic(fit); }

 private:
  void update_drift_mean();
  void refit_given(State start);
  bool add_best();
  void add_all();
  bool reselect_without(const Candidate& one, double promised, double limit, double loss);
  void backward_eliminate();
  void fit_and_accept(State state);
  void select_from_boards();
  void select_from_maps();
  void replace_maps();
  bool update_nuisances();
  bool allow_boards(std::shared_ptr<const Boards> boards);
  bool allow(ConditionNuisances more);
  std::size_t untried_count() const { return selected_.barred.size() + task_.refused.size(); }
  double lack_of_fit_of_best() const { return lack_of_fit(problem(), best()); }

  Deadline deadline_;  ///< the problem's deadline
  SelectionTask task_;
  MapSearch maps_{task_};
  BoardFlatnessSearch boards_{task_};
  SubsetSearch subsets_{task_, maps_, boards_};
  SelectedModel selected_;
  std::optional<SelectedModel> reached_;
  std::deque<std::pair<ModelTerm, ModelFit>> without_;  ///< fits without one addition; references stay valid
};

// ---- Fits without one addition, and lower limits of the deviance that it costs ----

/// Model without an addition. The derivatives are those of the model with it. @throws simulation::EffectError
ModelFit fit_without(const Problem& problem, const ModelFit& best, const ModelTerm& addition);

/// Lower limits of the rise of the deviance when each of some additions is removed: from the linearised part of its
/// change that no other effect and no map can make, if boards and light take over as much as they can. 0 if unknown:
/// for additions with maps, and if the other effects fail without the addition.
std::vector<double> min_deviance_rises(const Problem& problem, const ModelFit& best,
                                       std::span<const ModelTerm> additions);

}  // namespace tofgraph::diagnosis
