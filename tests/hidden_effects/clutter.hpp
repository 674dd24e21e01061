// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Campaign errors unrelated to the camera: boards that are not flat, sessions, correlated residual, a misplaced
/// board. A search must not name an effect because of them.
#pragma once

#include <cstdint>
#include <vector>

namespace tofgraph::io {
struct Condition;
}

namespace tofgraph::hidden {

struct View;

/// A smooth random function of two coordinates: a sum of waves of equal amplitude.
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

/// Amplitudes; 0: absent.
struct Clutter {
  double warp = 0;           ///< m, root mean square of each board relative to a plane; it moves with the board
  std::size_t sessions = 0;  ///< parts in which the campaign was recorded; each has its own offset and light
  double residue = 0;        ///< m, root mean square of an error that is smooth over the image and the order measured
  double misplaced = 0;      ///< m, by which one condition's board is farther away than its file states
};

/// Standard deviations between sessions.
inline constexpr double session_offset = 3e-3 /* m */, session_light = 0.02;

/// Clutter drawn for a campaign.
struct DrawnClutter {
  struct Session {
    double offset, light;  ///< m, factor
  };
  std::vector<Session> sessions;
  std::size_t misplaced = 0;  ///< index of the condition; meaningless if none is misplaced
};

/// Session of a condition by its position in the order measured.
std::size_t session_of(std::size_t order, std::size_t conditions, std::size_t sessions);
/// Within a session the camera stays on: conditions measured during warm-up come first. @param conditions in order of
/// measurement
void warm_up_first(std::vector<io::Condition>& conditions, std::size_t sessions);

/// Adds the clutter to views given in the order measured.
/// @param boards_seed of the boards' properties: the same boards have the same warp
DrawnClutter add_clutter(const Clutter& clutter, std::uint64_t seed, std::uint64_t boards_seed,
                         const std::vector<io::Condition>& conditions, std::vector<View>& views);

}  // namespace tofgraph::hidden
