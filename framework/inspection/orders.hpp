// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Test of the order of raw images by the flatness of planes. The samples of a pixel fit an order as well as its
/// rotations and reversals; these shift or reverse the lengths, which bends planes seen through a wide-angle lens.
#pragma once

#include "inspection/inspection.hpp"

namespace tofgraph::inspection {

/// Adds the finding that the raw images are in another order than stated, or lists the orders that the scene cannot
/// distinguish, each with its median length. Decodes the recording again if only another order than that of the
/// observation keeps planes flat.
/// @returns false if the stated order is wrong and not exactly one other order fits: lengths cannot be tested further
bool add_order(Inspection& result, const io::CaptureReader& capture);

}  // namespace tofgraph::inspection
