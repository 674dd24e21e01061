// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Best integration time by target and distance: chapter 6.2 of the reference.
#pragma once

#include "calibration/campaign_inputs.hpp"
#include "calibration/held_out.hpp"

#include <map>

namespace tofgraph::calibration {

inline constexpr double usable_saturation = 0.01;  ///< fraction of saturated pixels up to which a time is usable
inline constexpr double nearly_best = 1.05;        ///< times with an RMSE within this factor are equivalent

/// All integration times of one target at one distance.
struct Place {
  std::size_t target = 0;
  double distance = 0;                           ///< m
  std::vector<const Board*> times;               ///< in ascending order of integration time
  const Board* best = nullptr;                   ///< usable one with the minimum RMSE; null: all are saturated
  double shortest = unknown, longest = unknown;  ///< s, usable times with nearly minimum RMSE
  double saturates = unknown;                    ///< s, above it the profile's full well is exceeded
  double signal = unknown;  ///< s, above it the profile's noise allows the accuracy in one frame; NaN: unknown, never
};

/// True if a board is usable. Data that do not show saturation are limited by the profile's full well.
bool usable(const Board& board, const Place& place);

/// Integration time recommended for several places.
struct Suggestion {
  double time = unknown;   ///< s
  double worst = unknown;  ///< m, maximum error over its places
  std::vector<const Place*> places;
};

struct IntegrationTimes {
  std::vector<Place> places;               ///< by target, then distance
  bool compares = false;                   ///< true if a place was measured at several times
  std::vector<const Place*> wanted;        ///< places within the requested range
  Suggestion single;                       ///< single time for all requested places; no places: there is none
  std::vector<Suggestion> several;         ///< minimum set of times that reaches the accuracy if a single one does not
  std::vector<const Place*> out_of_reach;  ///< places where no time is sufficiently accurate
  Interval excess;                         ///< RMSE of times interpolated from other distances, relative to the minimum
  double excess_of_one_time = unknown;     ///< the same for a single time for all distances, mean
  std::size_t held_out = 0;                ///< number of places in it
};

/// Error of a pixel in one frame without the offset: RMSE (6.7) of the averaged frames, and the noise that was removed
/// by averaging.
double error_of(const Board& board);

IntegrationTimes choose_times(const Campaign& campaign, const Request& request);

report::Page integration_time_report(const Campaign& campaign, const IntegrationTimes& times, const Request& request,
                                     const std::string& verdict);

}  // namespace tofgraph::calibration
