// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Scores of groups of columns (amplitudes of an effect, a generic basis) in the residuals of a fit: the gain in
/// deviance that each would bring, and its significance by sign flips. The exchangeable unit is the condition, because
/// its pixels share board and light.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace tofgraph::diagnosis {

/// Columns that are tested together. They may omit rows; then all of them start at first_row.
struct Group {
  std::vector<Column> columns;
  std::size_t first_row = 0;
  /// Each column represents one column per superpixel, which is 0 elsewhere. In scores these are ordered by column,
  /// then by superpixel.
  bool by_superpixel = false;
  std::vector<const Column*> borrowed = {};  ///< further columns, which another group owns; it must live on
};

struct Score {
  double gain = 0;                   ///< in deviance, linearised, at the variances of the fit
  double dimension = 0;              ///< number of columns that the data determine
  double p_value = 1;                ///< of the largest score of all groups, by sign flips of whole conditions
  double own_p_value = 1;            ///< of this group alone, to control the false discovery rate
  double run_length = 1;             ///< conditions per run, which flip together: common parts count once
  double effective_sample_size = 0;  ///< units that carry the gain; if few, flips cannot prove significance
  Eigen::VectorXd values;            ///< of the columns
  Eigen::MatrixXd information;       ///< of the columns, nuisances projected out
  Eigen::MatrixXd shares;  ///< of the residual, projected likewise: per condition, then per shared random unknown
  std::vector<Eigen::Index> units;  ///< unit of each row of the shares; rows of a unit flip together
  Eigen::VectorXd score() const { return shares.colwise().sum(); }
};

/// True if chance is an insufficient explanation of the gain.
bool significant(const Score& score);

/// p-value of a gain: frequency with which the best of many groups gains as much under sign flips of whole conditions.
/// @param score of the columns of all groups @param groups indices of each group's columns @param seed of the flips
double chance_of(const Score& one, const Score& score, std::span<const std::vector<Eigen::Index>> groups,
                 std::uint64_t seed);

struct Scan {
  std::vector<Score> scores;  ///< one per group
  double square = 0;          ///< chi-square of the residuals, in C^-1
  double freedom = 0;         ///< its expectation for noise alone
};

// ---- Gram matrices of single conditions for candidate columns, before they are summed ----

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

// ---- Scores ----

/// Scores of the same columns at several variances between conditions; parts independent of them are computed once.
class Scanner {
 public:
  /// @param problem must outlive the scanner @param fit whose jacobian is projected out
  /// @param maps projected out, too: each represents one column per superpixel
  Scanner(const Problem& problem, const ModelFit& fit, std::span<const Group* const> groups,
          std::span<const Column> maps = {});
  Scanner(const Scanner&) = delete;
  Scanner& operator=(const Scanner&) = delete;

  /// @param dimension of the state's fit @param seed of the sign flips; nullopt: no p-values
  Scan scan(const RandomEffectSd& random_sd, double dimension, std::optional<std::uint64_t> seed = {}) const;

 private:
  const Problem& problem_;
  std::size_t own_, groups_;
  double run_length_;
  std::vector<Eigen::Index> units_;      ///< of sign flips: of each condition, then of each shared random unknown
  std::vector<ConditionGram> products_;  ///< one per condition, see products_of()
};

/// Scores at the fit's own variances, its jacobian projected out. @param seed of the sign flips; nullopt: no p-values
Scan scan(const Problem& problem, const ModelFit& fit, std::span<const Group* const> groups,
          std::optional<std::uint64_t> seed = {});

/// Chi-square of a fit's residuals over its expectation, the jacobian projected out.
double lack_of_fit(const Problem& problem, const ModelFit& fit);

/// Score of one group. @param seed see scan() @param maps see Scanner
Score score_of(const Problem& problem, const ModelFit& fit, const Group& group, std::optional<std::uint64_t> seed = {},
               std::span<const Column> maps = {});

/// Largest rejected p-value of Benjamini and Hochberg's procedure at the rate q; 0 if nothing is rejected.
double false_discovery_limit(std::vector<double> p_values, double q);

}  // namespace tofgraph::diagnosis
