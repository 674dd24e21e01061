// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Boards that stand elsewhere than their campaign says, by more than the others do.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <vector>

namespace tofgraph::diagnosis {

struct BoardOffsets {
  std::vector<double> error;  ///< m that each board is farther than it should be; 0 where no distance is known
  double sd = 0;              ///< of most of them, m
};

/// Beside a model, with what conditions share taken out. Where a board stands, distances tell; how bright it is,
/// whatever the reason, amplitudes: other light than the board's changes distances less on a brighter one.
BoardOffsets board_offsets_of(const Problem& problem, const State& state);

/// Factors on the usual jitter of each board: Student's t with 4 degrees of freedom, so that one that
/// stands elsewhere does not pull at the others. 1 for nearly all.
std::vector<double> jitter_scale_of(const BoardOffsets& offsets);

/// A board that stands where no other does.
struct Misplaced {
  std::size_t condition = 0;
  double error = 0;  ///< m
};
std::vector<Misplaced> misplaced(const BoardOffsets& offsets);

}  // namespace tofgraph::diagnosis
