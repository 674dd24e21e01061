// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Scores groups of columns (an effect's sizes, a generic basis) against what a fit leaves: the gain in deviance that
/// each would bring, and its significance by sign flips. The exchangeable unit is the condition: pixels of one
/// condition share its board and its light.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <cstdint>

namespace tofgraph::diagnosis {

/// Columns that are tried together. They may leave out rows: then all have the rows from first_row on.
struct Group {
  std::string name;
  std::vector<Column> columns;
  std::size_t first_row = 0;
  /// Each column stands for as many as there are superpixels: what it changes there, and nothing elsewhere. In scores
  /// they come one column after the other, its superpixels in their order.
  bool by_superpixel = false;
};

struct Score {
  double gain = 0;                   ///< of the deviance, linearised, at the variances of the fit
  double dimension = 0;              ///< columns that the data determine
  double p_value = 1;                ///< of the largest score of all groups under sign flips of whole conditions
  double own_p_value = 1;            ///< of this group alone, for tables with control of false discoveries
  double stays = 1;                  ///< conditions that change their signs together: what they have alike counts once
  double effective_sample_size = 0;  ///< how many units carry the gain; where they are few, flips can prove nothing
  Eigen::VectorXd values;            ///< of the columns
  Eigen::MatrixXd information;       ///< of the columns, nuisances taken out
  Eigen::MatrixXd shares;  ///< of the residual in them, likewise: of each condition, then of what they share at random
  std::vector<Eigen::Index> units;  ///< of each row of the shares, which ones change their signs together
  Eigen::VectorXd score() const { return shares.colwise().sum(); }
};

/// True if chance does not explain as much.
bool significant(const Score& score);

/// Frequency with which the best of many groups gains as much as one did when whole conditions change their signs.
/// @param score of all their columns @param groups columns of each
double chance_of(const Score& one, const Score& score, std::span<const std::vector<Eigen::Index>> groups,
                 std::size_t flips, std::uint64_t seed);

struct Scan {
  std::vector<Score> scores;  ///< one a group
  double square = 0;          ///< what is left of the residuals in C^-1, and
  double freedom = 0;         ///< how much noise alone would leave
};

struct Products;

/// Scores of the same columns in several variances between conditions: what does not depend on these is made once.
class Scanner {
 public:
  /// @param problem must live on @param fit whose jacobian is taken out
  /// @param maps taken out, too: each stands for one column a superpixel
  Scanner(const Problem& problem, const ModelFit& fit, std::span<const Group* const> groups,
          std::span<const Column> maps = {});
  ~Scanner();
  Scanner(const Scanner&) = delete;
  Scanner& operator=(const Scanner&) = delete;

  /// @param dimension of the state's fit @param flips draws; 0: no p-values
  Scan scan(const RandomEffectSd& random_sd, double dimension, std::size_t flips, std::uint64_t seed) const;

 private:
  const Problem& problem_;
  std::size_t own_, groups_;
  double run_length_;
  std::vector<Eigen::Index> units_;  ///< of sign flips: of conditions, and then of what they share at random
  std::vector<Products> products_;   ///< one a condition
};

/// Scores at the fit's own variances. Its jacobian is taken out. @param flips draws; 0: no p-values
Scan scan(const Problem& problem, const ModelFit& fit, std::span<const Group* const> groups, std::size_t flips,
          std::uint64_t seed);

/// Chi-square of what a fit leaves over what noise alone would. Its jacobian is taken out.
double lack_of_fit(const Problem& problem, const ModelFit& fit);

/// The score of one group. @param maps see Scanner
Score score_of(const Problem& problem, const ModelFit& fit, const Group& group, std::size_t flips, std::uint64_t seed,
               std::span<const Column> maps = {});

/// Largest rejected p-value of Benjamini and Hochberg's procedure at the rate q; 0 when nothing is rejected.
double false_discovery_limit(std::vector<double> p_values, double q);

}  // namespace tofgraph::diagnosis
