// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Pixels that are not like the others: the criteria of bad_pixel_reasons().
#pragma once

#include "calibration/noise.hpp"

namespace tofgraph::calibration {

/// Marks pixels whose light or modulation differs from that of their neighbours: dead and other response (median over
/// conditions with a flat board alone, since elsewhere the scene differs), hot (in the darkest such condition, or with
/// the lens capped), without modulation (median over all conditions that are lit).
void mark_response(const NoiseData& data, NoiseFit& fit);
/// Marks pixels with other noise than the fit's, and fills `ratio` in.
void mark_noise(const NoiseData& data, NoiseFit& fit);
/// Marks pixels with a tap that never changes, where the fitted noise makes that improbable.
void mark_frozen(const NoiseData& data, NoiseFit& fit);

}  // namespace tofgraph::calibration
