// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Size of the gap, and evidence for a model; change of a model by one term; structure of residuals.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace tofgraph::diagnosis {

/// Root mean square of measurement minus simulation over superpixels, SI, for distances that of the depth; NaN if the
/// observable is unknown. @param shift subtracted from the measurement, see contrast_shift()
double gap(const Problem& problem, const State& state, std::size_t observable, double shift = 0);

/// Shift of an observable by a contrast that was fitted: a nuisance, which is neither gap nor scatter. 0 for
/// observables other than the intensity.
double contrast_shift(const Problem& problem, const State& state, std::size_t observable);

/// Noise of the measurements in one observable; variances in squared units of gap().
struct MeasuredNoise {
  bool known = false;   ///< true: there are frames or repeated conditions
  double frames = 0;    ///< mean over all superpixels, between frames; 0 without frames
  double repeated = 0;  ///< between conditions with equal settings, beyond that of their frames; 0: none is repeated

  /// Measured part of the gap; NaN if it is unknown, as for tables without repetitions.
  double floor() const { return known ? std::sqrt(frames + repeated) : NAN; }
  /// Scatter between conditions beyond that of repeated ones. @param scatter see scatter_of()
  double scatter_left(double scatter) const { return std::sqrt(std::max(scatter - repeated, 0.0)); }
  /// Gap of a complete model: noise of the frames, and scatter between conditions, which a few repeated conditions may
  /// over- or underestimate. @param scatter see scatter_of()
  double with_scatter(double scatter) const { return std::sqrt(frames + scatter); }
};
/// @param frames true: the variances of the data come from frames
MeasuredNoise measured_noise(const Problem& problem, bool frames, std::size_t observable);

/// Mean squares of the scatter between conditions, without the noise of their frames, in squared units of gap(): fitted
/// position, offset and light of each condition, drift, sessions, board flatness and smooth field. Not the sum of the
/// fitted variances, because two nuisances may compensate each other if the model is incomplete.
std::array<double, observables> scatter_of(const Problem& problem, const State& state);

// ---- Measurements and expectations of two models, by condition and over the sensor, with errors ----

/// A model with everything that its predictions depend on.
struct Model {
  const Problem& problem;
  const State& state;
};

/// Evidence in one observable. SI, distances as depths along the axis; NaN for unknown values.
struct Evidence {
  /// Mean over a condition's superpixels, relative to the ideal camera and a board with the reflectivity of the
  /// extended model.
  struct Mean {
    double measured = 0, simulated = 0, extended = 0;
    double sd = 0;  ///< of the mean: noise, board position, camera offset and light of the condition
  };
  std::vector<Mean> means;  ///< one per condition
  Rows before, after;       ///< measured minus model, conditions x superpixels
  Rows sd;                  ///< of one superpixel in one condition, from the same sources
  /// Mean over the conditions and its standard deviation, one per superpixel.
  std::vector<double> map_before, map_after, map_sd;
};

/// @param simulated the given model @param extended with the effects found; its variances are used
Evidence evidence(const Model& simulated, const Model& extended, std::size_t observable);

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
