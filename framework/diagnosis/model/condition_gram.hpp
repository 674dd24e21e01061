// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Gram matrices of single conditions for candidate columns, before they are summed.
#pragma once

#include "diagnosis/model/scan.hpp"

namespace tofgraph::diagnosis {

/// A column of a condition that belongs to an unknown.
struct SharedColumn {
  Eigen::Index column = 0;  ///< among the condition's effect columns and random directions
  Eigen::Index unknown = 0;
  double factor = 1;
};

/// Columns of a condition's unknowns: effects, reflectivity of the target, and nuisances shared by conditions.
std::vector<SharedColumn> shared_columns_of(const Problem& problem, std::size_t condition, Eigen::Index own);

/// Products of a condition's columns in D^-1, independent of the variances between conditions. `held`: the effect
/// columns and the tail.
struct Products {
  Eigen::MatrixXd held;                ///< held x held
  std::vector<Eigen::MatrixXd> cross;  ///< one per group: held x columns
};

/// @param rows expectation of the model @param own effect columns of all conditions
/// @param maps columns of maps, each standing for one effect column per superpixel
/// @param information output: the Gram matrix of each group's columns, to whose lower triangle this condition is added
Products products_of(const Problem& problem, const State& state, const std::vector<double>& rows,
                     std::span<const Column> own, std::span<const Column> maps, std::span<const Group* const> groups,
                     std::size_t condition, std::vector<Eigen::MatrixXd>& information);

/// Products of a condition in C^-1. `held`: the columns of the unknowns, then the residual.
struct ConditionGram {
  Eigen::MatrixXd held;                ///< held x held
  std::vector<Eigen::MatrixXd> cross;  ///< one per group: held x columns
  /// One per group, random directions x columns: its square is the part of the information in D^-1 that C^-1 lacks.
  std::vector<Eigen::MatrixXd> taken;
};

ConditionGram condition_gram_of(const Products& products, std::span<const SharedColumn> parts,
                                const RandomEffectSd& random_sd);

}  // namespace tofgraph::diagnosis
