// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Nuisances of boards, which are not effects: boards that are not where the campaign states, and boards that are
/// not flat.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <algorithm>
#include <map>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Misplaced boards: distance errors much larger than those of the other boards ----

struct BoardOffsets {
  std::vector<double> error;  ///< m, board farther than stated; 0 if no distance is known
  std::vector<double> noise;  ///< m, standard deviation of each error by the noise of its condition alone
  double sd = 0;              ///< m, robust, of most boards

  /// Standard deviation expected of an error, m. Most boards include their noise in `sd`; a dark one can have more.
  double expected_sd(std::size_t condition) const { return std::max({sd, noise[condition], 1e-6}); }
};

/// Distance error of each board, given a model and its shared nuisances. The influence of the light, which amplitudes
/// determine, is subtracted first: stray light changes distances less on a brighter board.
BoardOffsets board_offsets_of(const Problem& problem, const State& state);

/// Factors on the usual jitter of each board, by Student's t with 4 degrees of freedom, so that a misplaced board has
/// little influence. 1 for nearly all boards.
std::vector<double> jitter_scale_of(const BoardOffsets& offsets);

/// A board whose distance error is too large for its jitter.
struct Misplaced {
  std::size_t condition = 0;
  double error = 0;  ///< m
};
std::vector<Misplaced> misplaced(const BoardOffsets& offsets);

// ---- Boards that are not flat: a smooth height field per target, fixed to its board ----

/// Height fields of the boards, and their gain.
struct BoardTrial {
  std::shared_ptr<const Boards> boards;  ///< null: not accepted
  double gain = 0;                       ///< fall of the deviance
  bool sure = false;  ///< accepted on its own evidence; false: only if nothing then remains unexplained
};

/// Point of a board in its own coordinates, which tilt and roll with it.
struct PlaceOnBoard {
  double x = 0, y = 0;  ///< m, from its intersection with the optical axis; NaN: not seen
};

/// Height fields of cosines over the part of each board that any condition sees; smaller for shorter waves.
class BoardFlatness {
 public:
  /// @param problem with more than one superpixel
  explicit BoardFlatness(const Problem& problem);

  /// Height fields with the standard deviation of least deviance. Null if they explain little of the excess, if one
  /// common field for several targets explains nearly as much, or if they are larger than is usual for boards. Not sure
  /// for a single target, if they explain less than half, or if the remaining excess exceeds the gain of separate
  /// fields over a common one: the residual may then be the camera's.
  BoardTrial trial(const Problem& problem, const State& state) const;

 private:
  /// Points at which the superpixels of a condition see its board.
  struct View {
    std::vector<PlaceOnBoard> places;  ///< empty without a board
    double widest = 0;                 ///< m, largest coordinate
  };
  /// Superpixels x cosines; computed when needed, since those of all conditions are large.
  Eigen::MatrixXd heights(const Design& design, std::size_t condition) const;
  std::shared_ptr<const Boards> shaped(const Design& design, const std::map<std::string, Eigen::VectorXd>& scores,
                                       double sd) const;

  std::vector<View> views_;                             ///< one per condition
  std::map<std::string, double> half_width_;            ///< m, of the visible part of each target
  std::map<std::string, Eigen::MatrixXd> information_;  ///< of each target's cosines, position and light projected out
};

}  // namespace tofgraph::diagnosis
