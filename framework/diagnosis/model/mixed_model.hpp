// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Generalised least squares over conditions. A condition's covariance is D + jitter^2 g g^T + offset^2 o o^T + light^2
/// h h^T: the noise of its superpixels, a board that is not quite where it should be (g: change of the observables for
/// a metre), a camera whose distances wander (o, which differs from g where a board is tilted) and
/// light that is not quite the same (h: change for a factor e). Each target has one unknown reflectivity, and other
/// unknowns may be shared along h and u: a wander, sessions. A condition comes as the Gram matrix of its columns in
/// D^-1, so that all that follows is small.
#pragma once

#include <Eigen/Dense>

#include <limits>
#include <span>
#include <vector>

namespace tofgraph::diagnosis {

/// Standard deviations between conditions.
struct RandomEffectSd {
  double jitter = 5e-4;         ///< m, of the board
  double offset = 1e-4;         ///< m, of the camera; 0 stays 0, where nothing tells it from the board's
  double light = 1e-3;          ///< of ln amplitude
  double drift = 1e-4;          ///< m, of the slowest wave of what wanders while the conditions are measured
  double drift_light = 1e-3;    ///< of ln amplitude, likewise
  double mean = 1e-6;           ///< m, of the mean about which the distances drift; held, see with_drift_mean()
  double session = 1e-4;        ///< m, of the camera from one session to the next
  double session_light = 1e-3;  ///< of ln amplitude, likewise
  double contrast = 0.1;        ///< prior of ln contrast about the profile's; held, not estimated
};

/// Columns: any number of effects' columns, then the random directions g, o and h, then u, a distance that is the same
/// in all pixels, c, the change for a contrast that is lower by a factor e, and the residual r.
using Gram = Eigen::MatrixXd;
inline constexpr Eigen::Index random_directions = 3, gram_tail = random_directions + 3;
inline constexpr Eigen::Index light_direction = 2, uniform_direction = 3, contrast_direction = 4;  ///< h, u and c

using RandomMatrix = Eigen::Matrix<double, random_directions, random_directions>;
/// T of the inverse covariance D^-1 - (T R^T D^-1)^T (T R^T D^-1), R the random directions (Woodbury): squares are
/// taken off. With T^T T in their place, what is left where boards may stand anywhere would be its rounding.
/// @param gram of R in D^-1 @param log_determinant of C D^-1
RandomMatrix downdate_factor(const RandomMatrix& gram, const RandomEffectSd& random_sd, double& log_determinant);

/// The Gram matrix in C^-1 in place of D^-1. @param log_determinant of C D^-1
Gram marginal(const Gram& gram, const RandomEffectSd& random_sd, double& log_determinant);

/// Replaces Gram matrices by those in C^-1. @returns ln determinants of C D^-1
std::vector<double> marginalise(std::vector<Gram>& grams, const RandomEffectSd& random_sd);

/// A condition's part in an unknown that it shares with others: so much of it, along h, u or c.
struct Shared {
  Eigen::Index direction = 0, unknown = 0;
  double factor = 1;
};

/// Unknowns: the effects' columns, then the targets' ln reflectivities, then what else conditions share.
struct Unknowns {
  Eigen::Index effects;         ///< columns of every Gram before its tail
  std::span<const int> target;  ///< of each condition, -1: its reflectivity is known
  Eigen::Index targets;
  std::span<const std::vector<Shared>> shared = {};  ///< of each condition, or nothing
  std::span<double RandomEffectSd::*const> sd = {};  ///< of the priors of what is shared
  /// Scale of the half-normal prior of RandomEffectSd::jitter, m; infinity: it has none.
  double jitter = std::numeric_limits<double>::infinity();

  Eigen::Index count() const { return effects + targets + static_cast<Eigen::Index>(sd.size()); }
  /// Inverse variances of the unknowns' priors. Effects and reflectivities have a wide one, in their units.
  Eigen::VectorXd prior(const RandomEffectSd& random_sd) const;
};

/// The normal equations over conditions.
struct NormalEquations {
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
  double square = 0;           ///< r^T C^-1 r
  double log_determinant = 0;  ///< sum of the conditions'
};

/// @param weight times that each condition counts; empty: once
NormalEquations assemble(std::span<const Gram> marginals, std::span<const double> log_determinants,
                         const Unknowns& unknowns, std::span<const double> weight = {});

struct Solution {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
  double deviance = 0;   ///< -2 ln likelihood but for a constant of the data
  double dimension = 0;  ///< how many of the effects' columns the data determine
};

Solution solve(const NormalEquations& equations, const Unknowns& unknowns, const RandomEffectSd& random_sd);

/// True if one of the standard deviations is as large as it may be: then it is not an estimate.
bool is_at_bound(const RandomEffectSd& random_sd, double RandomEffectSd::*which);

/// The variances with the least deviance, and that solution. `mean` and `contrast` stay as they are, so the deviance of
/// a model that contains another one is never larger.
/// @param start of the search for them; where that ends at a large jitter, it is repeated from the usual one
struct Profile {
  RandomEffectSd random_sd;
  Solution solution;
};
Profile profile(std::span<const Gram> grams, const Unknowns& unknowns, const RandomEffectSd& start);

}  // namespace tofgraph::diagnosis
