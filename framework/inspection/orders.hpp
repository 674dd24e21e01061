// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The order of raw images, judged by planes. The samples of a pixel fit an order as well as its turns by a step, by
/// half a turn and in the other direction; these shift or reverse the lengths, which bends planes seen by a wide lens.
#pragma once

#include "inspection/inspection.hpp"

namespace tofgraph::inspection {

/// Adds the finding that the raw images are in another order than stated, or the question which orders the scene leaves
/// open, each with the length that it would mean. Decodes the recording anew where another order than that of the
/// observation is the only one that keeps planes flat.
/// @returns whether the lengths can be judged further: false where the stated order is wrong and several others fit
bool add_order(Inspection& result, const io::CaptureReader& capture);

}  // namespace tofgraph::inspection
