// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Comparison of a model with the one that was given: none is written that predicts distances worse.
#pragma once

#include "diagnosis/model/fit.hpp"
#include "diagnosis/search/crossfit.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Distance gaps, m.
struct GapComparison {
  double given = 0, model = 0;  ///< NaN: not known

  /// By more than rounding and the coarse grid leave open: 1 % and 0.02 mm.
  bool is_worse() const { return model > settings.max_given_gap_growth * given + settings.given_gap_tolerance; }
};

/// On all data. @param given the parameters of the model as it was given; reflectivities are fitted
GapComparison on_all_data(const Problem& problem, const std::vector<Term>& given, const State& model);

/// Held-out predictions of the folds: the effects of a model, fitted without it. Folds that chose these effects are
/// taken as they are. @param known folds that were searched
GapComparison on_held_out_data(const std::vector<Fold>& folds, const CrossFit& known, const Problem& problem,
                               const std::vector<Term>& given, const State& model);

/// Both, of the problem's own folds.
struct Verification {
  GapComparison all{NAN, NAN}, held_out{NAN, NAN};

  /// Why the model must not be written, or nothing.
  std::string why_worse() const;
};
/// @param known folds that were searched
Verification compared_with_given(const CrossFit& known, const Problem& problem, const std::vector<Term>& given,
                                 const State& model);

// ---- Parameters of the given model that the data do not determine ----

/// The effects of the given model, with those of their parameters that may be refitted.
class GivenModel {
 public:
  /// @param effects must live on
  explicit GivenModel(const std::vector<simulation::ModelEffect>& effects);
  GivenModel(const GivenModel&) = delete;
  GivenModel& operator=(const GivenModel&) = delete;

  const std::vector<Term>& terms() const { return terms_; }

  /// Holds what the data do not determine in the given model alone, or beside one simpler effect that it lacks: a drift
  /// of a camera that was warm all the time must not take the place of a constant.
  /// @param candidates effects that may be added @throws simulation::EffectError
  void hold_undetermined(const Problem& problem, const std::vector<std::unique_ptr<Candidate>>& candidates);
  /// Holds what the data do not determine in a model whose first terms are these, one parameter after the other.
  /// @returns the model fitted with these held; nothing where all are determined @throws simulation::EffectError
  std::optional<ModelFit> hold_undetermined_in(const Problem& problem, ModelFit fit);

  /// "warm_up drift stays at -0.0107 m: these conditions do not determine it.", for each that is held.
  std::vector<std::string> notes() const;

 private:
  struct Held {
    std::string parameter, why;
  };

  void hold(std::size_t term, const FreeParameter& parameter, const std::string& why);
  bool hold_beside_simpler(const Problem& problem, const State& state,
                           const std::vector<std::unique_ptr<Candidate>>& candidates);

  const std::vector<simulation::ModelEffect>& effects_;
  std::vector<std::unique_ptr<Candidate>> candidates_;  ///< replaced ones stay: states of a search point to them
  std::vector<Term> terms_;
  std::vector<Held> held_;
};

}  // namespace tofgraph::diagnosis
