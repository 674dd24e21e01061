// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Which pixels see a board that does not fill the view.
#pragma once

#include "io/condition.hpp"
#include "simulation/hit.hpp"

#include <span>
#include <vector>

namespace tofgraph::diagnosis {

/// Pixels whose ray, and that of every pixel up to two away, meets the board within its size: those at its edge see
/// what stands behind it, too. @param hits where the pixels' rays meet the board's plane, row-major
/// @param width pixels in a row @param condition with a board that has a size
std::vector<bool> on_board(const io::Condition& condition, std::span<const simulation::Hit> hits, std::size_t width);

}  // namespace tofgraph::diagnosis
