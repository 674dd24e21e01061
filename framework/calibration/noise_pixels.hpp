// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Detection of bad pixels: the criteria of bad_pixel_reasons().
#pragma once

#include "calibration/noise.hpp"

namespace tofgraph::calibration {

/// Marks pixels whose light or modulation differs from that of their neighbours: dead and other response (median over
/// conditions with only a flat board, because other scenes differ between pixels), hot (in the darkest such condition,
/// or with the lens capped), without modulation (median over all lit conditions).
void mark_response(const NoiseData& data, NoiseFit& fit);
/// Marks pixels whose noise differs from the fit, and sets `ratio`.
void mark_noise(const NoiseData& data, NoiseFit& fit);
/// Marks pixels with a tap that never changes although the fitted noise makes this improbable.
void mark_frozen(const NoiseData& data, NoiseFit& fit);

}  // namespace tofgraph::calibration
