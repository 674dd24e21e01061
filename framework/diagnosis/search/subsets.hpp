// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Best sets of effects of a linearised problem, by enumeration.
#pragma once

#include "diagnosis/data/search_settings.hpp"

#include <Eigen/Dense>

#include <cstddef>
#include <span>
#include <vector>

namespace tofgraph::diagnosis {

/// Form in which an effect may enter a model: at one combination of its nonlinear values, with some of its
/// refinements.
struct Choice {
  std::size_t effect = 0;             ///< a set never contains two choices of the same effect
  std::vector<Eigen::Index> columns;  ///< indices among the columns of the information
  double dimension = 0;               ///< number of parameters it costs, nonlinear ones included
};

struct Subset {
  std::vector<std::size_t> choices;  ///< ascending
  double gain = 0;                   ///< decrease of the deviance
  double merit = 0;                  ///< gain minus the price of the parameters
  Eigen::VectorXd values;            ///< values, one per column, choice after choice
};

struct SubsetOptions {
  std::size_t max_effects = settings.max_set_effects;
  std::size_t kept = settings.kept_sets;        ///< returned sets of each size above one, each of different effects
  std::size_t singles = settings.sure_singles;  ///< returned sets of one effect
  double price = 0;                             ///< deviance per parameter: ln of the number of conditions
  double prior = 0;                             ///< added to the diagonal of the information, see prior_width
  std::size_t beam = settings.beam;  ///< sets of one size that are extended; if fewer exist, none is left out
  /// Once a set gains share_of_all of the gain of all columns, minus less_than_all, only one larger size is evaluated.
  double share_of_all = 1, less_than_all = 0;
};

/// Sets of each size with the greatest merit, greatest first; sets of the same effects count once, with their best
/// choices. A set of k effects extends one of k - 1. All pairs are evaluated, and all larger sets as long as the number
/// of sets with one effect less does not exceed the beam; beyond that only the best of these are extended.
/// @param information of all columns, nuisances projected out @param score of the residual in the same columns: the
/// gain of columns S is score_S' (information_SS + prior)^-1 score_S
std::vector<Subset> best_subsets(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                                 std::span<const Choice> choices, const SubsetOptions& options);

}  // namespace tofgraph::diagnosis
