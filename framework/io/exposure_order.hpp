// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Consistency of a frame with its stated exposures. Swapped images leave a residual of the phase fit or incoherent
/// neighbours; the wrong sign of phase makes brighter surfaces appear farther; swapped taps shift all distances by half
/// the range, which would require reflectivities above 1.
#pragma once

#include <tofgraph/physics/exposures.hpp>

#include <optional>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Sample of pixels of a frame, in pairs of neighbours: pixel 2 i + 1 is adjacent to pixel 2 i.
struct OrderSamples {
  std::vector<std::vector<double>> pixels;  ///< P samples each, counts
  std::vector<std::size_t> cells;           ///< 0-based image cell of each pixel
  double modulation_frequency = 0;          ///< Hz, for exposures that state none
  double light = 0;                         ///< gain x integration time, counts m^2; 0: unknown
};

/// Alternative order of the exposures, with the observations that it explains.
struct OtherOrder {
  std::string why;
  physics::Exposures exposures;  ///< the order that fits; empty: none was found
};

/// Searches for an order that fits a frame much better than the stated exposures. Nullopt if those fit, or if the data
/// are insufficient: fewer than 64 pairs, or a scene without depth. The result has no exposures if the samples do not
/// fit and no better order was found.
std::optional<OtherOrder> other_order(const OrderSamples& samples, const physics::Exposures& exposures);

/// The order shifted by half a turn and by each of its steps, in both directions; the order itself is first. The
/// samples of a single pixel fit all of them equally well.
std::vector<physics::Exposures> turned_orders(const physics::Exposures& exposures);

/// True if the light of a frame contradicts an order: brighter surfaces are farther away, or brighter than white. Light
/// that decreases too fast with the distance does not contradict it: lamps are weaker towards the corners.
bool is_contradicted_by_light(const OrderSamples& samples, const physics::Exposures& exposures);

/// Exposures in profile syntax: "[{phase: 0 deg}, {phase: 90 deg}]".
std::string exposures_yaml(const physics::Exposures& exposures);

}  // namespace tofgraph::io
