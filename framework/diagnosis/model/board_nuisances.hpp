// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Nuisances of boards, no effects: boards that stand elsewhere than their campaign says, and boards that are not
/// flat.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <map>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Boards that stand elsewhere, by more than the others do ----

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

// ---- Boards that are not flat: a smooth shape for each target, fixed to its board ----

/// Shapes, and what they explain.
struct BoardTrial {
  std::shared_ptr<const Boards> boards;  ///< or nothing
  double gain = 0;                       ///< fall of the deviance
  bool sure = false;  ///< whether they are the boards' by themselves, else only where nothing is left
};

/// Cosines over the part of each board that any condition sees, weaker the shorter they are.
class BoardFlatness {
 public:
  /// @param problem with more than one superpixel
  explicit BoardFlatness(const Problem& problem);

  /// With the standard deviation that has the least deviance. Nothing where shapes explain little of what is more than
  /// noise, where one shape for all of several targets does nearly as well, or where they are larger than boards have.
  /// Not sure where there is one target, where they explain less than half, and where more stays than telling the
  /// targets apart explains: that may be the camera's.
  BoardTrial trial(const Problem& problem, const State& state) const;

 private:
  std::shared_ptr<const Boards> shaped(const Design& design, const std::map<std::string, Eigen::VectorXd>& scores,
                                       double sd) const;

  std::vector<Eigen::MatrixXd> heights_;                ///< superpixels x shapes, one a condition
  std::map<std::string, Eigen::MatrixXd> information_;  ///< of each target's shapes, their place and light taken out
};

}  // namespace tofgraph::diagnosis
