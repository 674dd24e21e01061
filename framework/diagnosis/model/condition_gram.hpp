// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Gram matrices of single conditions for columns that are tried, before they are summed.
#pragma once

#include "diagnosis/model/scan.hpp"

namespace tofgraph::diagnosis {

/// A column of a condition that stands for an unknown.
struct SharedColumn {
  Eigen::Index column = 0;  ///< among the condition's own and random ones
  Eigen::Index unknown = 0;
  double factor = 1;
};

/// The own columns, the light of the target, and what is shared.
std::vector<SharedColumn> shared_columns_of(const Problem& problem, std::size_t condition, Eigen::Index own);

/// Columns x columns of a group. Of columns by superpixel it is kept as what it is made of: diagonals in D^-1, one for
/// each pair of columns, less the squares of what is taken out.
struct CandidateGram {
  bool by_superpixel = false;
  Eigen::MatrixXd whole;
  std::vector<Eigen::VectorXd> diagonals;
  Eigen::MatrixXd taken;  ///< directions x columns

  Eigen::Index columns() const { return by_superpixel ? taken.cols() : whole.cols(); }
  void add_to(Eigen::MatrixXd& sum) const;
};

/// Products of a condition's columns in D^-1, whatever the variances between conditions. Held are the condition's own
/// columns and its tail.
struct Products {
  Eigen::MatrixXd held;                ///< held x held
  std::vector<Eigen::MatrixXd> cross;  ///< one a group: held x columns
  std::vector<CandidateGram> tried;    ///< one a group, with what a smooth residue takes out
};

/// @param rows of the model @param own columns of all conditions
/// @param maps likewise, each for one own column a superpixel
Products products_of(const Problem& problem, const State& state, const std::vector<double>& rows,
                     std::span<const Column> own, std::span<const Column> maps, std::span<const Group* const> groups,
                     std::size_t condition);

/// Gram matrix of a condition for the columns that are tried, in C^-1. Held are the columns of unknowns, then the
/// residual.
struct ConditionGram {
  Eigen::MatrixXd held;                ///< held x held
  std::vector<Eigen::MatrixXd> cross;  ///< one a group: held x columns
  std::vector<CandidateGram> tried;    ///< one a group
};

ConditionGram condition_gram_of(const Products& products, std::span<const SharedColumn> parts,
                                const RandomEffectSd& random_sd);

}  // namespace tofgraph::diagnosis
