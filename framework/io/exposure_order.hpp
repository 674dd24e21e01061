// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Consistency of a frame with its stated exposures. Exchanged images leave samples that no phase explains, or
/// unrelated neighbours; the wrong sign of phase makes brighter surfaces look farther; exchanged taps shift everything
/// by half a range, where surfaces would have to be brighter than white.
#pragma once

#include <tofgraph/physics/exposures.hpp>

#include <optional>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Some pixels of a frame, each with its neighbour: pixel 2 i + 1 is beside pixel 2 i.
struct OrderSamples {
  std::vector<std::vector<double>> pixels;  ///< P samples each, counts
  std::vector<std::size_t> cells;           ///< which part of the image each pixel is in, from 0
  double modulation_frequency = 0;          ///< Hz, of exposures that have none
  double light = 0;                         ///< gain x integration time, counts m^2; 0: not known
};

/// Alternative order of the exposures, with the residuals it explains.
struct OtherOrder {
  std::string why;
  physics::Exposures exposures;  ///< that would fit; empty: none was found
};

/// Looks for an order that explains a frame much better than that of its exposures. Nothing where it fits, or where
/// there is too little to judge by: fewer than 64 places, or a scene without depth. Without exposures where the samples
/// do not fit and no order was found that does.
std::optional<OtherOrder> other_order(const OrderSamples& samples, const physics::Exposures& exposures);

/// The order turned as a whole by half a turn and by each of its steps, in its direction and in the other one; itself
/// first. The samples of a pixel fit all of them alike.
std::vector<physics::Exposures> turned_orders(const physics::Exposures& exposures);

/// Returns whether the light of a frame contradicts an order: brighter surfaces are farther away, or brighter than
/// white. Light that decreases too fast with the distance does not: lamps are weaker towards the image's corners.
bool is_contradicted_by_light(const OrderSamples& samples, const physics::Exposures& exposures);

/// As in a profile: "[{phase: 0 deg}, {phase: 90 deg}]".
std::string exposures_yaml(const physics::Exposures& exposures);

}  // namespace tofgraph::io
