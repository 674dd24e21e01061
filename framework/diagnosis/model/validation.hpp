// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Size of the gap, and evidence for a model.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <array>

namespace tofgraph::diagnosis {

/// Root mean square of measurement minus simulation over superpixels, SI; NaN where nothing is known.
/// For the distance it is that of the depth.
double gap(const Problem& problem, const State& state, std::size_t observable);

/// Measured part of the gap: noise of the frames, and the difference between conditions with the same settings
/// beyond that, where some are repeated. NaN where neither is known, as of tables. In units of gap().
/// @param frames whether the variances of the data come from frames
double noise_floor(const Problem& problem, bool frames, std::size_t observable);

/// Mean squares of what conditions differ by beside the noise of their frames, in squared units of gap(): place, offset
/// and light of each, a wander and sessions as the fit says of them; shapes of boards and a smooth residue. Not the sum
/// of the fit's variances: two of these may take from each other what neither has, where the model lacks something.
std::array<double, observables> scatter_of(const Problem& problem, const State& state);

/// Scatter between conditions beyond that of repeated ones. In units of gap(). @param scatter of the observable
double scatter_left(const Problem& problem, double scatter, bool frames, std::size_t observable);

/// The gap of a model that lacks nothing: the noise of the frames, and all that conditions differ by. Few repeated
/// conditions may say more or less than that. In units of gap(). @param scatter of the observable
double noise_and_scatter(const Problem& problem, double scatter, bool frames, std::size_t observable);

// ---- Measurements beside the expectations of two models, condition by condition and over the sensor, with errors ----

/// A model with all that belongs to its predictions.
struct Model {
  const Problem& problem;
  const State& state;
};

/// Evidence in one observable. SI, distances as depths along the axis; NaN where nothing is known.
struct Evidence {
  /// Mean over a condition's superpixels, relative to the ideal camera that looks at a board of the reflectivity that
  /// the extended model found.
  struct Mean {
    double measured = 0, simulated = 0, extended = 0;
    double sd = 0;  ///< of the mean: noise, jitter of the board, offset and light of the condition
  };
  std::vector<Mean> means;  ///< one a condition
  Rows before, after;       ///< measured minus model, conditions x superpixels
  Rows sd;                  ///< likewise, of one superpixel in one condition, as above
  /// Mean over conditions, one a superpixel, and its standard deviation.
  std::vector<double> map_before, map_after, map_sd;
};

/// @param simulated the model as it was @param extended with what was found; its variances are those between conditions
Evidence evidence(const Model& simulated, const Model& extended, std::size_t observable);

}  // namespace tofgraph::diagnosis
