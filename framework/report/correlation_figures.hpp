// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Modulation, correlation and interference of the sources: figures 5.2, 5.3, 5.5, 5.6 and 5.10 of the reference.
#pragma once

#include "report/page.hpp"

#include <tofgraph/plugin.h>

namespace tofgraph::report {

/// Adds the figures for a camera to a page. Signals have amplitude 1 and last for ten periods of the modulation, one is
/// shifted by two; amplitudes are those of a perpendicular board at 500 mm.
/// @throws std::invalid_argument as physics::geometry_of
void add_correlation_figures(Page& page, const tofgraph_camera& camera);

}  // namespace tofgraph::report
