// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Measurements beside the expectations of two models, condition by condition and over the sensor, with errors.
#pragma once

#include "diagnosis/model/fit.hpp"

namespace tofgraph::diagnosis {

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
