// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Spread of the pixels over a board as an observable: standard deviations in tables, and laws that explain them. Means
/// over a board do not depend on them, so they are fitted after the effects that change means.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// A measured standard deviation over the pixels of a board, with the quantities on which the laws depend. SI.
struct SpreadRow {
  std::string target;
  double distance = 0, integration_time = 0;  ///< m, s
  double amplitude = 0;                       ///< counts, as expected by the model
  double gain = 1;                            ///< change of the measured distance per metre of half light path
  double frames = io::unknown;                ///< number of frames averaged in each pixel; NaN: unknown
  double sd = 0;                              ///< m
  double reach = io::unknown;                 ///< m: pixels farther from the mean were left out; NaN: none
};

/// Causes of differences between pixels. Their variances add; each is multiplied by the square of the gain.
enum class SpreadLaw {
  pattern,        ///< offset of each pixel, m: fixed_pattern, spread
  growing,        ///< offset proportional to the distance, m/m
  inside,         ///< stray light or current inside the camera, counts/s, over the amplitude: crosstalk, spread
  dark,           ///< samples that do not cancel, counts, over the amplitude
  temporal_noise  ///< factor on the noise of the profile, averaged over the frames: temporal_noise
};
inline constexpr std::size_t spread_laws = 5;

/// Selected law and its value in the unit of the law.
struct SpreadTerm {
  SpreadLaw law{};
  double value = 0;
};

/// A group of rows whose standard deviations have a common deviation from the fit.
struct SpreadResidual {
  std::string setting;  ///< distance, target or integration_time
  std::string level;
  double ratio = 1;  ///< measured over fitted, geometric mean
  std::size_t rows = 0;
};

/// Laws that explain the rows, selected one after the other while the Bayesian information criterion falls.
struct PixelSpread {
  std::size_t rows = 0;
  std::vector<SpreadTerm> terms;
  std::map<std::string, double> light;  ///< factor on each target's amplitude; 1 for the first, to which laws refer
  double rms = 0, held_out_rms = io::unknown;        ///< ln(measured / fitted); held_out_rms: each distance held out
  double within = 0, held_out_within = io::unknown;  ///< fraction of rows within 25 % of the fit
  std::optional<SpreadResidual> residual;            ///< largest significant one
};

/// Noise of the taps as stated by the profile; NaN: not stated.
struct SpreadNoise {
  double read_noise = io::unknown, shot_noise = io::unknown, contrast = io::unknown;
  double metres_per_radian = 1;
};

/// Fits the laws to the rows. @param rows at least spread_laws + 2, else nullopt is returned
std::optional<PixelSpread> fit_spread(std::span<const SpreadRow> rows, const SpreadNoise& noise);

/// Fits the laws to the rows of a campaign. Nullopt if too few conditions of a table state a standard deviation.
std::optional<PixelSpread> pixel_spread(const io::Campaign& campaign, bool physical, const Problem& problem,
                                        const State& state);

/// Sentences for the report's notes.
std::vector<std::string> notes_on_spread(const PixelSpread& spread);
/// Name and unit in report.json.
std::string_view spread_law_name(SpreadLaw law);
std::string_view spread_law_unit(SpreadLaw law);

}  // namespace tofgraph::diagnosis
