// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Patterns in residuals that follow no axis: principal components against what noise alone gives.
#pragma once

#include "diagnosis/model/fit.hpp"
#include "diagnosis/model/scan.hpp"

#include <cstdint>
#include <string>

namespace tofgraph::diagnosis {

// ---- Contribution of one effect to an extended model, compared with the one that is fitted anew without it ----

/// True if two models differ by no more than conditions do from one to the next, and beyond that by less than matters
/// anywhere: however sure that is, it tells nothing apart. @param limit of chi-square for the former
bool practically_equivalent(const Problem& problem, const State& one, const State& other, double limit);

/// The change that a piece makes at its values, and its derivatives there: what is scored against generic patterns.
/// @param with a state that has the piece @throws simulation::EffectError
std::vector<Column> signature(const Problem& problem, const State& without, const State& with, const ModelTerm& piece);

/// Shares of the conditions in the deviance that an effect gains, sum 1: s_i b / sum(s_j b), with s_i what a condition
/// adds to the score of the effect's change and b the size that suits all of them. The other effects and the
/// reflectivities make up for what they can (linearly). A condition that speaks against the effect has a share below 0.
/// @param term of the state @returns one a condition; empty where the effect changes nothing
std::vector<double> influence(const Problem& problem, const State& state, std::size_t term);

/// Correlations of the fit's parameters, in the order of the terms' free parameters. 0 where a parameter has no
/// variance.
Eigen::MatrixXd correlations(const ModelFit& fit);

// ---- Patterns in residuals that follow no axis ----

/// Conditions x superpixels, whitened, without what jitter, a camera's offset and the light explain; one an observable.
std::vector<Eigen::MatrixXd> whitened_residuals(const Problem& problem, const State& state);

/// Takes out of a condition's rows what jitter, a camera's offset and the light could make of them.
/// @returns how much of each, in that order: m, m, ln of the light
Eigen::Vector<double, random_directions> project_out_nuisances(const Problem& problem, const State& state,
                                                               std::size_t condition, std::vector<double>& rows);

/// Largest principal component of an observable's residuals over the image: root mean square over conditions,
/// SI, with the component's sign, which may change from one condition to the next. One a superpixel.
std::vector<double> leading_pattern(const Problem& problem, const State& state, std::size_t observable);

/// Number of principal components of each observable that are larger than chance (parallel analysis: signs of all
/// elements are drawn anew; beside a residue, for the distances: those of its waves in each run).
std::array<std::size_t, observables> parallel_analysis(const Problem& problem, const State& state, std::uint64_t seed);

}  // namespace tofgraph::diagnosis
