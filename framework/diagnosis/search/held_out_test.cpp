// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/held_out_test.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <fmt/format.h>

namespace tofgraph::diagnosis {

std::string gap_worsened(double without, double with, const char* what) {
  if (!is_gap_worse(without, with)) return "";
  return fmt::format(
      "the distance gap grows on conditions that were put aside (from {:.2f} mm without {} to {:.2f} mm)",
      1e3 * without, what, 1e3 * with);
}

std::string held_out_failure(const EffectFinding& found) {
  if (found.chosen < settings.min_chosen_fraction)
    return fmt::format("it is chosen in {:.0f} % of the folds", 100 * found.chosen);
  if (!found.improvement.is_significant())
    return fmt::format("the gap does not shrink on conditions that were put aside (chi-square {:.0f}, with it {:.0f})",
                       found.improvement.without, found.improvement.with);
  return gap_worsened(found.improvement.depth_without, found.improvement.depth_with, "it");
}

}  // namespace tofgraph::diagnosis
