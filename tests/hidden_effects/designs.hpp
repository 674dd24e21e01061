// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Designs of campaigns: those of the reference, reduced in size for speed, and the experiments that separate
/// effects.
#pragma once

#include "io/condition.hpp"

#include <functional>
#include <string>
#include <vector>

namespace tofgraph::hidden {

struct NamedConditions {
  std::string name, text;
  std::function<std::vector<io::Condition>()> make;
};

/// small, A, B, C, and lab2x1 to lab8x3: a grid of 13 distances, with the numbers of integration times and targets.
const std::vector<NamedConditions>& designs();
/// roll, velocity, reference, capped, rail, single_sources, tilts, warm_up, ambient.
const std::vector<NamedConditions>& experiments();

/// Gives all conditions unique ids that state distance and integration time.
void name_conditions(std::vector<io::Condition>& conditions);

/// Appends conditions with the reflectivities of existing targets; all ids are renewed.
/// @throws std::invalid_argument for an unknown target
void append(std::vector<io::Condition>& conditions, const std::vector<io::Condition>& more);

/// Conditions of a design with experiments appended; ids are unique, `reflectivity` is the target's true one.
/// @param every only every n-th condition of the design
/// @throws std::invalid_argument for an unknown name
std::vector<io::Condition> conditions_of(const std::string& design, const std::vector<std::string>& added,
                                         std::size_t every = 1);

}  // namespace tofgraph::hidden
