// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Comparison of a model with the one that was given: none is written that predicts distances worse.
#pragma once

#include "diagnosis/search/crossfit.hpp"

#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Distance gaps, m.
struct GapComparison {
  double given = 0, model = 0;  ///< NaN: not known

  /// By more than rounding and the coarse grid leave open: 1 % and 0.02 mm.
  bool is_worse() const { return model > settings.max_given_gap_growth * given + settings.given_gap_tolerance; }
};

/// On all data. @param given the parameters of the model as it was given, reflectivities fitted
/// @param problem with what suits `model`
GapComparison on_all_data(const Problem& problem, const std::vector<Term>& given, const State& model);

/// On what the folds put aside: the effects of a model, fitted without it. Folds that chose these effects are taken as
/// they are. @param known folds that were searched
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

}  // namespace tofgraph::diagnosis
