// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Which pixels are not like the others.
#pragma once

#include "calibration/noise.hpp"

namespace tofgraph::calibration {

/// Marks pixels whose level differs from that of their neighbours in most conditions that show a flat board alone: in
/// other scenes what stands there differs.
void mark_response(const NoiseData& data, NoiseFit& fit);
/// Marks pixels with other noise than the fit's, and fills `ratio` in.
void mark_noise(const NoiseData& data, NoiseFit& fit);

}  // namespace tofgraph::calibration
