// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What a selection allows its conditions to have of their own.
#include "diagnosis/places.hpp"
#include "diagnosis/selection.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {

/// Where conditions have something of their own, a board that stands elsewhere or a residue that is smooth over the
/// image: what can be seen beside that. Asked when no effect helps any more, as each of these could be taken for one.
/// @returns whether there is such a thing that was not known before
bool Selection::look_at_conditions() {
  constexpr double as_before = 0.2;  // of a logarithm
  std::vector<double> looseness = looseness_of(places_of(problem_, best_.fit.state));
  double most = 0;
  for (std::size_t i = 0; i < looseness.size(); ++i)
    most = std::max(most, std::abs(std::log(looseness[i] / (problem_.looseness.empty() ? 1 : problem_.looseness[i]))));
  ResidueTrial residue;
  if (problem_.residue || (pieces().empty() && left() >= explained)) residue = residue_of(problem_, best_.fit);
  if (most < as_before && !residue.residue) return false;
  return allow(std::move(looseness), residue.residue ? std::move(residue.residue) : problem_.residue);
}

/// @returns whether that could be: an effect may give no number where the fit goes then, and all stays as it was
bool Selection::allow(std::vector<double> looseness, std::shared_ptr<const Residue> residue) {
  say("allowing for what conditions have of their own");
  note({"allowed",
        {},
        {{"smooth_residue_m", residue ? residue->sd() : 0},
         {"loosest_board", looseness.empty() ? 1 : std::ranges::max(looseness)}},
        "effects are looked for again beside it"});
  std::swap(problem_.looseness, looseness);
  std::swap(problem_.residue, residue);
  if (try_refine(best_.fit.state).empty()) {
    original_.fit = fit_with_maps(problem_, original_.fit.state, weight_);
    return true;
  }
  problem_.looseness = std::move(looseness);
  problem_.residue = std::move(residue);
  return false;
}

}  // namespace tofgraph::diagnosis
