// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Errors of a campaign apart from the camera: boards that are not flat, sessions, correlated residue, a
/// misplaced board. A search should name nothing because of it.
#pragma once

#include <cstdint>
#include <vector>

namespace tofgraph::io {
struct Condition;
}

namespace tofgraph::hidden {

struct View;

/// A smooth random function of two coordinates: a sum of waves of equal size.
class Smooth {
 public:
  struct Wave {
    double x, y, phase;  ///< rad per unit of the coordinate, rad
  };
  Smooth() = default;
  /// @param size root mean square over all coordinates
  Smooth(double size, std::vector<Wave> waves);

  explicit operator bool() const { return !waves_.empty(); }
  double operator()(double x, double y) const;

 private:
  double each_ = 0;
  std::vector<Wave> waves_;
};

/// Sizes; 0: it is not there.
struct Clutter {
  double warp = 0;           ///< m, root mean square of each board against a plane; it moves with the board
  std::size_t sessions = 0;  ///< parts in which the campaign was recorded; each has its own offset and light
  double residue = 0;        ///< m, root mean square of an error that is smooth over the image and the order measured
  double misplaced = 0;      ///< m, by how much one condition's board stands farther than its file says
};

/// Standard deviations between sessions.
inline constexpr double session_offset = 3e-3 /* m */, session_light = 0.02;

/// Clutter drawn for a campaign.
struct DrawnClutter {
  struct Session {
    double offset, light;  ///< m, factor
  };
  std::vector<Session> sessions;
  std::size_t misplaced = 0;  ///< index of the condition; it means nothing where none is misplaced
};

/// Session of a condition by its place in the order measured.
std::size_t session_of(std::size_t order, std::size_t conditions, std::size_t sessions);
/// Within a session the camera stays on: what is measured while it warms up comes first. @param conditions in the order
/// in which they are measured
void warm_up_first(std::vector<io::Condition>& conditions, std::size_t sessions);

/// Adds the clutter to views that stand in the order measured.
/// @param boards_seed of what belongs to the boards: the same boards are warped in the same way
DrawnClutter add_clutter(const Clutter& clutter, std::uint64_t seed, std::uint64_t boards_seed,
                         const std::vector<io::Condition>& conditions, std::vector<View>& views);

}  // namespace tofgraph::hidden
