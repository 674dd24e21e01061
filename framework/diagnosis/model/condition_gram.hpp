// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Gram matrices of single conditions for candidate columns, before they are summed.
#pragma once

#include "diagnosis/model/scan.hpp"

#include <memory>

namespace tofgraph::diagnosis {

/// A column of a condition that belongs to an unknown.
struct SharedColumn {
  Eigen::Index column = 0;  ///< among the condition's effect columns and random directions
  Eigen::Index unknown = 0;
  double factor = 1;
};

/// Columns of a condition's unknowns: effects, reflectivity of the target, and nuisances shared by conditions.
std::vector<SharedColumn> shared_columns_of(const Problem& problem, std::size_t condition, Eigen::Index own);

/// Gram matrix of a group, columns x columns: the one in D^-1 minus the square of what is projected out. The first is
/// shared by copies; for columns by superpixel it is stored as diagonals, one per pair of columns.
struct CandidateGram {
  bool by_superpixel = false;
  std::shared_ptr<const Eigen::MatrixXd> whole;
  std::vector<Eigen::VectorXd> diagonals;
  Eigen::MatrixXd taken;  ///< projected out: directions x columns

  Eigen::Index columns() const { return taken.cols(); }
  void add_to(Eigen::MatrixXd& sum) const;
};

/// Gram matrix of a condition for candidate columns.
struct ConditionGram {
  Eigen::MatrixXd projected;              ///< projected x projected
  std::vector<Eigen::MatrixXd> cross;     ///< one per group: projected x columns
  std::vector<CandidateGram> candidates;  ///< one per group, including what a smooth field projects out
};

/// Gram matrix in D^-1, independent of the variances between conditions; projected: the effect columns and the tail.
/// @param rows expectation of the model @param own effect columns of all conditions
/// @param maps columns of maps, each standing for one effect column per superpixel
ConditionGram products_of(const Problem& problem, const State& state, const std::vector<double>& rows,
                          std::span<const Column> own, std::span<const Column> maps,
                          std::span<const Group* const> groups, std::size_t condition);

/// Gram matrix in C^-1; projected: the columns of the unknowns, then the residual. @param products the same in D^-1
ConditionGram condition_gram_of(const ConditionGram& products, std::span<const SharedColumn> parts,
                                const RandomEffectSd& random_sd);

}  // namespace tofgraph::diagnosis
