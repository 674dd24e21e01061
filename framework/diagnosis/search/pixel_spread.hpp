// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The spread of the pixels over a board as an observable: standard deviations of tables, and which laws explain them.
/// A mean over a board says nothing of them, so that they are fitted after the effects that change means.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// A measured standard deviation over the pixels of a board, with what laws need to explain it. SI.
struct SpreadRow {
  std::string target;
  double distance = 0, integration_time = 0;  ///< m, s
  double amplitude = 0;                       ///< counts, as the model expects it
  double gain = 1;                            ///< change of the measured distance for one metre of the light's
  double frames = io::unknown;                ///< that each pixel is the mean of; NaN: not known
  double sd = 0;                              ///< m
  double reach = io::unknown;                 ///< m: pixels farther from the middle were left out; NaN: none
};

/// Causes of differences between pixels. RandomEffectSd add; each is multiplied by the square of the gain.
enum class SpreadLaw {
  pattern,        ///< an offset of each pixel, m: fixed_pattern, spread
  growing,        ///< the same in proportion to the distance, m/m
  inside,         ///< light or current from inside, counts/s, over the amplitude: crosstalk, spread
  dark,           ///< samples that do not cancel, counts, over the amplitude
  temporal_noise  ///< factor on the noise of the profile, averaged over the frames: temporal_noise
};
inline constexpr std::size_t spread_laws = 5;

/// Chosen law, its value in the unit of the law.
struct SpreadTerm {
  SpreadLaw law{};
  double value = 0;
};

/// A group of rows whose standard deviations differ from the fit together.
struct SpreadResidual {
  std::string setting;  ///< distance, target or integration_time
  std::string level;
  double ratio = 1;  ///< measured over fitted, geometric mean
  std::size_t rows = 0;
};

/// Laws that explain the rows, chosen one after the other while the Bayesian information criterion falls.
struct PixelSpread {
  std::size_t rows = 0;
  std::vector<SpreadTerm> terms;
  std::map<std::string, double> light;  ///< factor on each target's amplitude; 1 of the first, to which laws refer
  double rms = 0, held_out_rms = io::unknown;  ///< of ln(measured / fitted); the latter with each distance held out
  double within = 0, held_out_within = io::unknown;  ///< share of rows within 25 % of the fit
  std::optional<SpreadResidual> residual;            ///< the largest that is significant
};

/// Noise of the taps as the profile states it, NaN where it does not.
struct SpreadNoise {
  double read_noise = io::unknown, shot_noise = io::unknown, contrast = io::unknown;
  double metres_per_radian = 1;
};

/// Fits the laws to the rows. @param rows at least spread_laws + 2, else nothing is returned
std::optional<PixelSpread> fit_spread(std::span<const SpreadRow> rows, const SpreadNoise& noise);

/// Rows of the conditions that state a standard deviation over pixels, with amplitudes and gains as a fitted model has
/// them. @param state of the problem
std::vector<SpreadRow> spread_rows(const io::Campaign& campaign, bool physical, const Problem& problem,
                                   const State& state);

/// Fits the laws to the rows of a campaign. Nothing if too few conditions of a table state a standard deviation.
std::optional<PixelSpread> pixel_spread(const io::Campaign& campaign, bool physical, const Problem& problem,
                                        const State& state);

/// Sentences for the report's notes.
std::vector<std::string> notes_on_spread(const PixelSpread& spread);
/// Name and unit in report.json.
std::string_view spread_law_name(SpreadLaw law);
std::string_view spread_law_unit(SpreadLaw law);

}  // namespace tofgraph::diagnosis
