// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Generalised least squares over conditions. A condition's covariance is D + jitter^2 g g^T + offset^2 o o^T +
/// light^2 h h^T: noise of the superpixels, position error of the board (g: change of the observables per metre),
/// offset of the camera (o: differs from g for tilted boards) and variation of the light (h: change by a factor e).
/// Each target has one unknown reflectivity; further unknowns are shared along h, u and c: drift, sessions,
/// contrast. A condition is represented by the Gram matrix of its columns in D^-1, so that all further matrices are
/// small.
#pragma once

#include <Eigen/Dense>

#include <limits>
#include <span>
#include <vector>

namespace tofgraph::diagnosis {

/// Standard deviations between conditions.
struct RandomEffectSd {
  double jitter = 5e-4;         ///< m, of the board's position
  double offset = 1e-4;         ///< m, of the camera; stays 0 if it cannot be distinguished from the board's
  double light = 1e-3;          ///< of ln amplitude
  double drift = 1e-4;          ///< m, of the slowest half cosine of the drift over the campaign
  double drift_light = 1e-3;    ///< of ln amplitude, of the slowest half cosine of its drift
  double mean = 1e-6;           ///< m, of the mean of the distance drift; held, see with_drift_mean()
  double session = 1e-4;        ///< m, of the camera's offset between sessions
  double session_light = 1e-3;  ///< of ln amplitude, between sessions
  double contrast = 0.1;        ///< prior of ln contrast relative to the profile's; held, not estimated
};

/// Columns: those of the effects, the random directions g, o and h, then u, a distance that is equal in all pixels, c,
/// the change for a contrast that is lower by a factor e, and the residual r.
using Gram = Eigen::MatrixXd;
inline constexpr Eigen::Index random_directions = 3, gram_tail = random_directions + 3;
inline constexpr Eigen::Index light_direction = 2, uniform_direction = 3, contrast_direction = 4;  ///< h, u and c

using RandomMatrix = Eigen::Matrix<double, random_directions, random_directions>;
/// T of the inverse covariance D^-1 - (T R^T D^-1)^T (T R^T D^-1), R the random directions (Woodbury), so that squares
/// are subtracted. With T^T T instead, rounding errors would dominate if board positions are nearly free.
/// @param gram of R in D^-1 @param log_determinant of C D^-1
RandomMatrix downdate_factor(const RandomMatrix& gram, const RandomEffectSd& random_sd, double& log_determinant);

/// Gram matrix in C^-1 instead of D^-1. @param log_determinant of C D^-1
Gram marginal(const Gram& gram, const RandomEffectSd& random_sd, double& log_determinant);

/// Replaces Gram matrices by those in C^-1. @returns ln determinants of C D^-1
std::vector<double> marginalise(std::vector<Gram>& grams, const RandomEffectSd& random_sd);

/// Part of a condition in a shared unknown: factor and direction (h, u or c).
struct Shared {
  Eigen::Index direction = 0, unknown = 0;
  double factor = 1;
};

/// Unknowns: the effects' columns, the targets' ln reflectivities, then the other shared unknowns.
struct Unknowns {
  Eigen::Index effects;         ///< number of columns of every Gram before its tail
  std::span<const int> target;  ///< of each condition; -1: known reflectivity
  Eigen::Index targets;
  std::span<const std::vector<Shared>> shared = {};  ///< of each condition; empty: none
  std::span<double RandomEffectSd::*const> sd = {};  ///< of the priors of the shared unknowns
  /// Scale of the half-normal prior of RandomEffectSd::jitter, m; infinity: none.
  double jitter = std::numeric_limits<double>::infinity();

  /// Appends the unknowns that a condition shares with others, numbered from 0: reflectivity of its target, then the
  /// further ones.
  void append_shared(std::size_t condition, std::vector<Shared>& to) const;
  Eigen::Index count() const { return effects + targets + static_cast<Eigen::Index>(sd.size()); }
  /// Inverse variances of the unknowns' priors; effects and reflectivities have a wide one, in their units.
  Eigen::VectorXd prior(const RandomEffectSd& random_sd) const;
};

/// Normal equations summed over conditions.
struct NormalEquations {
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
  double square = 0;           ///< r^T C^-1 r
  double log_determinant = 0;  ///< sum over the conditions
};

/// @param weight number of times that each condition counts; empty: once
NormalEquations assemble(std::span<const Gram> marginals, std::span<const double> log_determinants,
                         const Unknowns& unknowns, std::span<const double> weight = {});

struct Solution {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
  double deviance = 0;   ///< -2 ln likelihood except for a constant of the data
  double dimension = 0;  ///< number of effect columns that the data determine
};

Solution solve(const NormalEquations& equations, const Unknowns& unknowns, const RandomEffectSd& random_sd);

/// True if a standard deviation is at its upper bound, so that it is not an estimate.
bool is_at_bound(const RandomEffectSd& random_sd, double RandomEffectSd::*which);

/// Variances of least deviance, and the solution there. `mean` and `contrast` are held, so the deviance of a model is
/// never larger than that of a model nested in it.
/// @param start of the search for the variances; if it ends at a large jitter, it is repeated from the usual one
struct Profile {
  RandomEffectSd random_sd;
  Solution solution;
};
Profile profile(std::span<const Gram> grams, const Unknowns& unknowns, const RandomEffectSd& start);

}  // namespace tofgraph::diagnosis
