// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Change of a model by one term; residuals without nuisances, and their principal components.
#pragma once

#include "diagnosis/model/fit.hpp"
#include "diagnosis/model/scan.hpp"

#include <cstdint>

namespace tofgraph::diagnosis {

// ---- Contribution of one effect: an extended model compared with the model refitted without it ----

/// True if two models differ by no more than the scatter between conditions, and otherwise by less than the practical
/// threshold, even where that is significant.
bool practically_equivalent(const Problem& problem, const State& one, const State& other);

/// Change by a model term at its values, and its derivatives there: compared with generic patterns.
/// @param with a state that has the term @throws simulation::EffectError
std::vector<Column> signature(const Problem& problem, const State& without, const State& with,
                              const ModelTerm& addition);

/// Shares of the conditions in the gain of an effect, sum 1: s_i b / sum(s_j b), with s_i the contribution of a
/// condition to the score of the effect's change, and b the common amplitude. The other effects and the reflectivities
/// are projected out (linearly). A condition that contradicts the effect has a negative share.
/// @param term of the state @returns one per condition; empty if the effect changes nothing
std::vector<double> influence(const Problem& problem, const State& state, std::size_t term);

/// Correlations of the fit's parameters, in the order of the terms' free parameters; 0 for parameters without
/// variance.
Eigen::MatrixXd correlations(const ModelFit& fit);

// ---- Patterns in residuals that follow no axis ----

/// Whitened residuals, jitter, camera offset and light projected out: conditions x superpixels, one per observable.
std::vector<Eigen::MatrixXd> whitened_residuals(const Problem& problem, const State& state);

/// Projects jitter, camera offset and light out of a condition's rows.
/// @returns the fitted amounts, in that order: m, m, ln of the light
Eigen::Vector<double, random_directions> project_out_nuisances(const Problem& problem, const State& state,
                                                               std::size_t condition, std::vector<double>& rows);

/// Largest principal component of an observable's residuals over the image: one value per superpixel, root mean square
/// over conditions, SI. It has the component's sign, which may differ between conditions.
std::vector<double> leading_pattern(const Problem& problem, const State& state, std::size_t observable);

/// Number of principal components of each observable that exceed those of noise (parallel analysis: random signs of all
/// elements; for distances beside a smooth field, of its waves in each run).
std::array<std::size_t, observables> parallel_analysis(const Problem& problem, const State& state, std::uint64_t seed);

}  // namespace tofgraph::diagnosis
