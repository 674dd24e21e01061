// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rows of measured standard deviations, and what is said of them.
#include "diagnosis/search/pixel_spread.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tofgraph/physics/constants.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

constexpr double gain_step = 2e-3;  ///< m, for the derivative of what the model measures

/// A problem without data: what a model expects of conditions is all that is asked of it.
struct Expected {
  std::vector<Observations> data;
  Design design;
  Problem problem;
  Expected(const io::CameraPtr& camera, bool physical, std::vector<io::Condition> conditions)
      : data(conditions.size(), {std::vector<double>(observables, 0),
                                 std::vector<double>(observables, std::numeric_limits<double>::infinity())}),
        design(camera, physical, std::move(conditions), single),
        problem(make_problem(design, data)) {}

  /// Rows of all conditions. @param fitted whose reflectivities are those of the targets of the same name
  Rows rows(const Problem& fitted, const State& state) const {
    std::vector<double> light(problem.targets.size(), 0);
    for (std::size_t t = 0; t < light.size(); ++t) {
      const auto found = std::ranges::find(fitted.targets, problem.targets[t]);
      if (found != fitted.targets.end())
        light[t] = state.log_reflectivity[static_cast<std::size_t>(found - fitted.targets.begin())];
    }
    return expected(problem, State{state.terms, std::move(light), state.random_sd});
  }
};

}  // namespace

std::vector<SpreadRow> spread_rows(const io::Campaign& campaign, bool physical, const Problem& problem,
                                   const State& state) {
  std::vector<io::Condition> used;
  for (const io::Condition& c : campaign.conditions) {
    if (c.measured.depth_sd > 0 && std::isfinite(c.integration_time) && c.has_board()) used.push_back(c);
  }
  if (used.empty()) return {};
  std::vector<io::Condition> farther = used;
  for (io::Condition& c : farther) c.board_distance += gain_step;
  const Expected here(campaign.camera, physical, used), there(campaign.camera, physical, farther);
  const auto rows = here.rows(problem, state), moved = there.rows(problem, state);
  std::vector<SpreadRow> result;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const io::Condition& c = used[i];
    result.push_back(
        {.target = c.target,
         .distance = c.board_distance,
         .integration_time = c.integration_time,
         .amplitude = std::abs(here.design.ideal(i).front().phasor) * std::exp(rows[i][amplitude]),
         .gain = 1 + (moved[i][distance] - rows[i][distance]) / (gain_step * here.design.shift(i)[distance]),
         .frames = c.measured.frames,
         .sd = c.measured.depth_sd,
         .reach = c.measured.reach});
  }
  return result;
}

std::optional<PixelSpread> pixel_spread(const io::Campaign& campaign, bool physical, const Problem& problem,
                                        const State& state) {
  if (!campaign.from_table) return std::nullopt;
  const tofgraph_camera& camera = campaign.camera->view();
  const SpreadNoise noise{camera.read_noise, camera.shot_noise, camera.contrast,
                          physics::metres_per_radian(camera.modulation_frequency)};
  return fit_spread(spread_rows(campaign, physical, problem, state), noise);
}

std::vector<std::string> notes_on_spread(const PixelSpread& spread) {
  std::vector<std::string> parts;
  for (const SpreadTerm& term : spread.terms) {
    switch (term.law) {
      case SpreadLaw::pattern:
        parts.push_back(fmt::format("a fixed pattern of {:.2g} mm", term.value * 1e3));
        break;
      case SpreadLaw::growing:
        parts.push_back(fmt::format("a pattern that grows by {:.2g} mm per m of distance", term.value * 1e3));
        break;
      case SpreadLaw::inside:
        parts.push_back(fmt::format("crosstalk that differs from pixel to pixel by {:.3g} counts/s", term.value));
        break;
      case SpreadLaw::dark:
        parts.push_back(fmt::format("samples that differ from pixel to pixel by {:.2g} counts", term.value));
        break;
      default:
        parts.push_back(fmt::format("noise of the frames {:.2g} times that of the profile", term.value));
    }
  }
  std::vector<std::string> notes = {fmt::format(
      "{} standard deviations over the pixels of boards are explained by {}: {:.0f} % of them within 25 %{}.",
      spread.rows, fmt::join(parts, ", "), 100 * spread.within,
      std::isfinite(spread.held_out_within)
          ? fmt::format(", {:.0f} % where laws were chosen and fitted without their distance",
                        100 * spread.held_out_within)
          : "")};
  if (spread.residual)
    notes.push_back(fmt::format(
        "Of the pixels' standard deviations, no law explains those of {} {}: {} rows are {:.2g} times the fitted ones.",
        spread.residual->setting, spread.residual->level, spread.residual->rows, spread.residual->ratio));
  return notes;
}

}  // namespace tofgraph::diagnosis
