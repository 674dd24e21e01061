// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Which integration time suits which target and distance: chapter 6.2 of the reference.
#pragma once

#include "calibration/campaign_inputs.hpp"
#include "calibration/held_out.hpp"

#include <map>

namespace tofgraph::calibration {

inline constexpr double usable_saturation = 0.01;  ///< share of saturated pixels up to which a time is usable
inline constexpr double nearly_best = 1.05;        ///< times whose RMSE is within this factor are as good

/// All integration times of one target at one distance.
struct Place {
  std::size_t target = 0;
  double distance = 0;                           ///< m
  std::vector<const Board*> times;               ///< rising integration time
  const Board* best = nullptr;                   ///< usable one with the least RMSE; null: every one is saturated
  double shortest = unknown, longest = unknown;  ///< s, usable times with an RMSE near the least
  double saturates = unknown;                    ///< s, from where on the profile's full well is exceeded
  double signal = unknown;  ///< s, from where on one frame is as accurate as wanted, by the profile's noise
};

/// True where a board can be used. Data that do not show saturation are limited by the profile's full well.
bool usable(const Board& board, const Place& place);

/// Integration time recommended for many places.
struct Suggestion {
  double time = unknown;   ///< s
  double worst = unknown;  ///< m, the largest error among its places
  std::vector<const Place*> places;
};

struct IntegrationTimes {
  std::vector<Place> places;               ///< by target, then distance
  bool compares = false;                   ///< some place was measured at several times
  std::vector<const Place*> wanted;        ///< those within the wanted range
  Suggestion single;                       ///< the one time for all wanted places; no places: there is none
  std::vector<Suggestion> several;         ///< the fewest times that together reach the accuracy, where one does not
  std::vector<const Place*> out_of_reach;  ///< no time is accurate enough there
  Interval excess;                         ///< times interpolated from other distances: their RMSE over the least
  double excess_of_one_time = unknown;     ///< mean of the same, of one time for all distances
  std::size_t held_out = 0;                ///< places in it
};

/// The error of one frame's pixel beside the offset: RMSE (6.7) of the averaged frames, and the noise that the average
/// took away.
double error_of(const Board& board);

IntegrationTimes choose_times(const Campaign& campaign, const Request& request);

report::Page integration_time_report(const Campaign& campaign, const IntegrationTimes& times, const Request& request,
                                     const std::string& verdict);

}  // namespace tofgraph::calibration
