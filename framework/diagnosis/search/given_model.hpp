// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Comparison of a model with the given one: a model that predicts distances worse is not written.
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
  double given = 0, model = 0;  ///< NaN: unknown

  /// True beyond the tolerance for rounding and the coarse grid: 1 % and 0.02 mm.
  bool is_worse() const { return model > settings.max_given_gap_growth * given + settings.given_gap_tolerance; }
  /// True if it grows, though within the tolerance. NaN: false
  bool grows() const { return model > given; }
};

/// Comparison on held-out data: in each fold the effects of a model are fitted without the held-out conditions. Results
/// of folds that chose these effects are reused. @param known folds that were searched
GapComparison on_held_out_data(const std::vector<Fold>& folds, const CrossFit& known, const Problem& problem,
                               const std::vector<Term>& given, const State& model);

/// Comparisons on all data and on the problem's own folds.
struct Verification {
  GapComparison all{NAN, NAN}, held_out{NAN, NAN};

  /// Reason why the model must not be written; empty: none.
  std::string why_worse() const;
  /// True if the gap grows both on all and on held-out data.
  bool grows() const { return all.grows() && held_out.grows(); }
};
/// @param known folds that were searched @param given terms with the parameters as given; reflectivities are fitted
Verification compared_with_given(const CrossFit& known, const Problem& problem, const std::vector<Term>& given,
                                 const State& model);

// ---- Parameters of the given model that the data do not determine ----

/// Effects of the given model, with those of their parameters that may be refitted.
class GivenModel {
 public:
  /// @param effects must outlive this object @param seed of the bootstrap
  explicit GivenModel(const std::vector<simulation::ModelEffect>& effects, std::uint64_t seed = 1);
  GivenModel(const GivenModel&) = delete;
  GivenModel& operator=(const GivenModel&) = delete;

  const std::vector<Term>& terms() const { return terms_; }

  /// Holds parameters that the data do not determine in the given model alone, or with one simpler effect that it
  /// lacks: a warm-up drift of a camera that was always warm must not replace a constant.
  /// @param candidates effects that may be added @throws simulation::EffectError
  void hold_undetermined(const Problem& problem, const Candidates& candidates);
  /// Holds parameters that the data do not determine in a model whose first terms are these, one after the other.
  /// @returns the model refitted with these held; nullopt if all are determined
  /// @throws simulation::EffectError, TimeExpired; nothing is held then
  std::optional<ModelFit> hold_undetermined_in(const Problem& problem, ModelFit fit);

  /// "warm_up drift stays at -0.0107 m: these conditions do not determine it.", for each held parameter.
  std::vector<std::string> notes() const;

 private:
  struct Held {
    std::string parameter, why;
  };

  std::optional<ModelFit> hold_one_after_the_other(const Problem& problem, ModelFit fit);
  void hold(std::size_t term, const FreeParameter& parameter, const std::string& why);
  bool hold_beside_simpler(const Problem& problem, const State& state, const Candidates& candidates);

  const std::vector<simulation::ModelEffect>& effects_;
  std::uint64_t seed_;
  Candidates candidates_;  ///< replaced ones are kept: states of a search point to them
  std::vector<Term> terms_;
  std::vector<Held> held_;
};

}  // namespace tofgraph::diagnosis
