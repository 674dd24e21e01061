// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Lowest possible noise of one frame of the independent camera, in closed form.
#pragma once

#include "tests/hidden_effects/defects.hpp"
#include "tests/hidden_effects/plain_camera.hpp"

#include <vector>

namespace tofgraph::hidden {

/// Standard deviations of the depth of a board, root mean square over the pixels without defects, m.
struct NoiseLimit {
  double shot;  ///< from the shot noise of the expected taps alone
  double all;   ///< from shot noise and read noise
};
NoiseLimit noise_limit(const Physics& physics, const View& view, const std::vector<Defect>& defects);

}  // namespace tofgraph::hidden
