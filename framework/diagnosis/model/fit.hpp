// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Fits the effects of a model to the observations, with the targets' reflectivities and the variances.
#pragma once

#include "diagnosis/model/linearisation.hpp"

#include <limits>

namespace tofgraph::diagnosis {

/// A fitted model. Its copy is all that is needed to undo a step.
struct ModelFit {
  State state;
  double deviance = std::numeric_limits<double>::infinity();
  double dimension = 0;        ///< parameters of effects that the data determine
  Eigen::MatrixXd covariance;  ///< of the free parameters of all terms in their order, in units of their typical values
  std::vector<Column> jacobian = {};  ///< at the state, or nearly there; empty until it is asked for: see linearised()

  /// Bayesian information criterion, with the prior of refinements: normal about off, a typical value their standard
  /// deviation, as for those that a term does not have (see intervals()). One that is far beyond what is typical
  /// predicts nothing outside the settings that were measured.
  double bic(std::size_t conditions) const;
};

/// A fit with the jacobian at its state.
ModelFit linearised(const Problem& problem, ModelFit fit);

/// Minimises the deviance over all free parameters. @throws simulation::EffectError
/// @throws std::invalid_argument for too few conditions
ModelFit fit(const Problem& problem, State start);

/// As fit(), as exactly as a comparison of models needs.
ModelFit fit_roughly(const Problem& problem, State start);

/// As fit(), less exactly, for a comparison of candidates: the derivatives of all terms but the last are taken from
/// a fit of those alone. @param known jacobian() there
ModelFit fit_last(const Problem& problem, State start, std::span<const Column> known);

/// As fit() with the parameters of effects held, for reflectivities and variances alone.
ModelFit fit_nuisances(const Problem& problem, State start);

/// Replaces an amplitude below zero by its opposite with an angle half a turn on where both mean the same.
State with_positive_amplitudes(const Problem& problem, State state);

/// True if the order of measurement supports a drift of the distances, or of the light, more than conditions that
/// scatter by as much: the standard deviation alone may be anything where few conditions determine it.
bool drift_shows(const Problem& problem, const State& state, double RandomEffectSd::*drift,
                 double RandomEffectSd::*scatter);

/// A state whose mean about which the distances drift has the standard deviation of a drift that shows, else the least,
/// as where the drift is at its bound: there it stands for something else. Models are compared at the same one:
/// estimated with each model, it would take up a constant offset that effects explain.
State with_drift_mean(const Problem& problem, State state);

/// Deviance of a state as it is, its variances included; only the reflectivities are those with the least.
double deviance_of(const Problem& problem, const State& state);

}  // namespace tofgraph::diagnosis
