// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/proof.hpp"

#include <fmt/format.h>

namespace tofgraph::diagnosis {

std::string ruined(double without, double with, const char* what) {
  if (!is_ruined(without, with)) return "";
  return fmt::format(
      "the distance gap grows on conditions that were put aside (from {:.2f} mm without {} to {:.2f} mm)",
      1e3 * without, what, 1e3 * with);
}

std::string unproved(const Found& found) {
  if (found.chosen < least_chosen) return fmt::format("it is chosen in {:.0f} % of the folds", 100 * found.chosen);
  if (!found.fall.is_proof())
    return fmt::format("the gap does not shrink on conditions that were put aside (chi-square {:.0f}, with it {:.0f})",
                       found.fall.without, found.fall.with);
  return ruined(found.fall.depth_without, found.fall.depth_with, "it");
}

}  // namespace tofgraph::diagnosis
