// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Fits the effects of a model to the observations, with the targets' reflectivities and the variances.
#pragma once

#include "diagnosis/model/problem.hpp"

#include <limits>

namespace tofgraph::diagnosis {

/// A fitted model. Assigning a copy undoes a step.
struct ModelFit {
  State state;
  double deviance = std::numeric_limits<double>::infinity();
  double dimension = 0;  ///< number of effect parameters that the data determine
  /// Covariance of all free parameters in the order of the terms, in typical values, followed by reflectivities and
  /// shared unknowns. Taken at the iterate before the last.
  Eigen::MatrixXd covariance;
  std::vector<Column> jacobian = {};  ///< at or near the state; empty until computed, see with_jacobian()

  /// Bayesian information criterion, with the prior of refinements: normal about off, with one typical value as
  /// standard deviation, as for refinements that a term does not have (see intervals()). A refinement far beyond its
  /// typical value predicts nothing outside the measured settings.
  double bic(std::size_t conditions) const;
};

/// The fit, with the jacobian at its state.
ModelFit with_jacobian(const Problem& problem, ModelFit fit);

/// Minimises the deviance over all free parameters. @throws simulation::EffectError
/// @throws std::invalid_argument for too few conditions
ModelFit fit(const Problem& problem, State start);

/// Like fit(), with the accuracy that a comparison of models needs.
/// @param known derivatives of the first parameters, taken from another fit and not updated: all but those of an added
/// term, or all if a term was removed
ModelFit fit_roughly(const Problem& problem, State start, std::span<const Column> known = {});

/// Like fit() with the effects' parameters held: fits reflectivities and variances only.
ModelFit fit_nuisances(const Problem& problem, State start);

/// A model as it is written: like fit_nuisances(), with the grid bias of its effects.
ModelFit fit_as_written(const Problem& problem, State start);

/// Replaces negative amplitudes by their opposites with an angle half a turn further, if both are equivalent.
State with_positive_amplitudes(const Problem& problem, State state);

/// True if the order of measurement supports a drift of distance or light better than independent scatter of the same
/// size does; with few conditions the standard deviation alone is not evidence.
bool drift_shows(const Problem& problem, const State& state, double RandomEffectSd::*drift,
                 double RandomEffectSd::*scatter);

/// A state in which the mean of the distance drift has the standard deviation of the drift, if one is significant, else
/// the least, also if the drift is at its bound, where it replaces something else. All models are compared at the same
/// one: estimated with each model, it would absorb a constant offset that effects explain.
State with_drift_mean(const Problem& problem, State state);

/// Deviance of a state with its variances unchanged; only the reflectivities are those of least deviance.
double deviance_of(const Problem& problem, const State& state);

}  // namespace tofgraph::diagnosis
