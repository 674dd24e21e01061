// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The best sets of effects of a linearised problem, by enumeration.
#pragma once

#include "diagnosis/data/search_settings.hpp"

#include <Eigen/Dense>

#include <cstddef>
#include <span>
#include <vector>

namespace tofgraph::diagnosis {

/// A way in which an effect may enter a model: with one value of its nonlinear parameters, with some of its
/// refinements.
struct Choice {
  std::size_t effect = 0;             ///< two choices of one effect are never together in a set
  std::vector<Eigen::Index> columns;  ///< among those of the information
  double dimension = 0;               ///< parameters that it costs, shapes included
};

struct Subset {
  std::vector<std::size_t> choices;  ///< ascending
  double gain = 0;                   ///< of the deviance
  double merit = 0;                  ///< gain less what its parameters cost
  Eigen::VectorXd values;            ///< of its columns, choice after choice
};

struct SubsetOptions {
  std::size_t max_effects = settings.max_set_effects;
  std::size_t kept = settings.kept_sets;  ///< sets of each size above one that are returned, each of other effects
  std::size_t singles = settings.sure_singles;  ///< likewise, of one effect
  double price = 5;                             ///< of a parameter, in deviance: ln of the number of conditions
  double prior = 1e-4;                          ///< added to the diagonal of the information, see prior_width
  std::size_t beam = settings.beam;  ///< sets of one size that are enlarged; with fewer in all, nothing is left out
  /// A set that gains this share of what all columns gain at once, or so much less, is enlarged once and no more.
  double share_of_all = 1, less_than_all = 0;
};

/// The sets of each size with the greatest merit, greatest first; sets of the same effects count once, with their best
/// choices. A set of k effects is one of k - 1 with one more. All pairs are looked at, and all larger sets as long as
/// those of one effect less are fewer than the beam; beyond that only the best of these are enlarged.
/// @param information of all columns, nuisances taken out, and @param score of the residual in them: the gain of
/// columns S is score_S' (information_SS + prior)^-1 score_S
std::vector<Subset> best_subsets(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                                 std::span<const Choice> choices, const SubsetOptions& options = {});

}  // namespace tofgraph::diagnosis
