// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Which effects explain what a model does not, by the information criterion alone: no question is put to them.
#pragma once

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/board_flatness.hpp"
#include "diagnosis/search/alternatives.hpp"
#include "diagnosis/search/maps.hpp"
#include "diagnosis/search/trace.hpp"
#include "diagnosis/search/trials.hpp"

#include <deque>
#include <functional>
#include <optional>

namespace tofgraph::diagnosis {

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

/// Gain of a set of effects in the linearised problem.
struct Promise {
  std::vector<std::string> names;
  double gain = 0;
};

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
  void linearise();
  /// Adds effects until none is worth its parameters, and takes out what is not.
  void forward_select();
  /// Looks for more effects beside what conditions have of their own. @param anew nothing is left of a model that was
  /// refuted: where something is left beside it and sets of effects promise what they promised then, they would lead to
  /// it again, and none are looked for
  /// @returns whether they were looked for
  bool select_beside_nuisances(bool anew = false);
  /// The best model without a piece: fitted once, and kept until there is another best one. @throws
  /// simulation::EffectError
  const ModelFit& without(const ModelTerm& piece);
  /// An effect beside a model, in those of its forms that promise most; those that give no number are not there.
  /// @param base whose light the problem has @throws simulation::EffectError
  std::vector<ModelFit> with(const ModelFit& base, const Candidate& one) const;
  /// A model without a piece in the place of the best one.
  void drop(const ModelTerm& piece);
  /// Others in the place of an effect, beside all that is there, where these explain as much; it is not added again.
  /// @returns whether they do
  bool exchange(const Candidate& one);
  /// Fits exactly, by every pixel.
  void refit();
  /// Another model, likewise. @throws simulation::EffectError
  ModelFit refitted(State state) const;

  const Problem& problem() const { return problem_; }
  const ModelFit& original() const { return original_; }  ///< the model as it is
  const ModelFit& best() const { return best_; }
  const std::vector<Term>& terms() const { return best_.state.terms; }
  /// Every addition: the effects, and the refinements of these and of the model's own.
  std::vector<ModelTerm> pieces() const;
  const std::map<std::string, std::string>& refused() const { return refused_; }
  /// Changes that candidates could make to the model as it is.
  const Alternatives& alternatives() const { return alternatives_; }
  double bic(const ModelFit& fit) const { return fit.bic(problem_.data.size()); }
  std::span<const double> weight() const { return weight_; }

 protected:
  /// State to which a step may have to be undone.
  struct Kept {
    ModelFit original, best;
    std::vector<const Candidate*> barred;
  };

  Kept kept() const;
  /// The last model to which effects were added: what there is where time ends before all have been.
  const Kept& reached() const { return *reached_; }
  void restore(Kept before);
  bool try_refine(State state);
  void accept(ModelFit fit);
  /// The parameters of the model as it was given, reflectivities and variances fitted, in the place of the best one.
  void return_to_given();
  void report_progress(const std::string& what) const {
    if (options_.progress) options_.progress(what);
  }
  void set_deadline(const Deadline& deadline) { deadline_ = deadline; }
  void note(Step step) { trace_.push_back(std::move(step)); }
  std::vector<Step> take_trace() { return std::move(trace_); }

 private:
  std::optional<ModelFit> search_subsets(double least = 0);
  bool add_best();
  bool leaves_nearly_all(const ModelFit& added) const;
  std::vector<Column> maps_of(const State& state) const;
  SubsetOptions set_options() const;
  SubsetOptions subset_options() const;
  bool promises_as_before() const;
  SubsetOptions alone(const Alternatives& all) const;
  std::optional<ModelFit> fitted_set(const State& from, const Alternatives& all, const Subset& subset,
                                     const Eigen::MatrixXd& information) const;
  std::optional<MapTrial> maps_on(const ModelFit& base);
  bool smooth_field_does_more(const ModelFit& base, const ModelFit& maps) const;
  std::optional<MapTrial> maps_alone(double enough);
  std::optional<ModelFit> good_maps();
  std::optional<ModelFit> maps_instead(const ModelFit& added);
  ModelFit original_beside_best() const;
  void select_from_maps();
  void replace_maps();
  bool reselect_without(const Candidate& one, double promised, double limit);
  void add_all();
  void backward_eliminate();
  void refine(State state);
  bool update_nuisances();
  bool allow_boards(std::shared_ptr<const Boards> boards);
  BoardTrial boards_beside(const State& state);
  void select_from_boards();
  bool allow(ConditionNuisances more);
  bool reshape_boards();
  double deviance_beside_boards() const;
  bool fit_beside_boards();
  void fit_boards();
  void note_ranks(const Alternatives& all, const Score& score);
  std::size_t left_out() const { return barred_.size() + refused_.size(); }
  double left() const { return lack_of_fit(problem_, best_); }

  Deadline deadline_;  ///< of the problem
  const Problem problem_;
  const std::vector<Term>& model_;
  const std::vector<std::unique_ptr<Candidate>>& candidates_;
  const SearchOptions& options_;
  std::map<std::string, std::string> refused_;
  std::vector<const Candidate*> barred_;  ///< roots that are not tried: exchanged, or they gave no number
  std::vector<double> weight_;
  ModelFit original_, best_;
  std::optional<Kept> reached_;
  std::deque<std::pair<ModelTerm, ModelFit>> without_;  ///< what was asked for of the best one; references stay
  Alternatives alternatives_;
  std::vector<Promise> promised_;                ///< beside the model as it is, when it was looked at first
  std::unique_ptr<const BoardFlatness> shapes_;  ///< when they are asked for
  bool any_boards_ = false;                      ///< whether their shapes need not be sure
  std::vector<Step> trace_;
};

}  // namespace tofgraph::diagnosis
