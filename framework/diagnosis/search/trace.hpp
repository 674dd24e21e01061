// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Steps of a search, so that a reader can follow why an effect was accepted or rejected.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace tofgraph::diagnosis {

struct Step {
  std::string what;  ///< ranked, fitted, maps, taken out, allowed, questioned, valued, exchanged, proved
  std::vector<std::string> effects;                     ///< that it was done with, "effect.parameter" for refinements
  std::vector<std::pair<std::string, double>> numbers;  ///< NaN: there is none
  std::string outcome;
};

}  // namespace tofgraph::diagnosis
