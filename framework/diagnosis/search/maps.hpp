// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Effects with a value per pixel (offsets, sensitivities) for which the model names no file: their maps are estimated
/// from the residual of a fit, one value per superpixel, jointly with all else. Each value counts as a parameter.
#pragma once

#include "diagnosis/search/trials.hpp"

#include <memory>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Step of a map, in its unit: effects are linear in their maps, or nearly.
inline constexpr double map_probe = 1e-3;

/// An effect with estimated maps, in a model.
struct MapTrial : Trial {
  double lack_of_fit = 0;  ///< chi-square of the fit over its expectation
};

/// Best candidate with maps, fitted; nullopt if there is none or none is worth its parameters.
/// @param refused names to skip, with reasons; failing ones are added @param seed of the sign flips
std::optional<MapTrial> best_maps(const Problem& problem, const ModelFit& base, const Candidates& candidates,
                                  std::map<std::string, std::string>& refused, std::uint64_t seed);

/// Model with an effect whose first map is estimated, regardless of BIC. @throws simulation::EffectError
ModelFit fit_with_map_of(const Problem& problem, State state, const Candidate& candidate);

/// Score of a term's maps in a model without it. @param seed of the sign flips
Score score_of_maps(const Problem& problem, const ModelFit& without, const Term& term, std::uint64_t seed);

/// State with maps estimated again.
State with_updated_maps(const Problem& problem, State state);

/// True if a state has estimated maps.
bool has_maps(const State& state);
/// True if the maps are refitted with changes of other effects: those of one effect are; those of several would take
/// too long and are held.
bool maps_follow(const State& state);

/// Change by each map of a state for one step of all its values. Each represents one column per superpixel.
/// @throws simulation::EffectError
std::vector<Column> map_columns(const Problem& problem, const State& state);

/// Like fit(), with maps refitted with the other effects.
ModelFit fit_with_maps(const Problem& problem, State start);
/// Like fit_roughly(), with maps refitted if maps_follow(); never worse than the start.
/// @param start whose maps belong to another state
ModelFit fit_roughly_with_maps(const Problem& problem, State start);

/// State in which the constant includes the means, if the model has a constant: estimated maps of lengths then have
/// mean 0 over the pixels. The expectation is unchanged. @throws simulation::EffectError
State with_means_in_constant(const Problem& problem, State state);

// ---- The same maps at the resolution of the pixels: the difference of each pixel from its superpixel is estimated
// from the frames, by least squares over the conditions, and shrunk by its uncertainty ----

struct Measurements;

struct PixelMap {
  std::string effect, dataset, unit;
  std::vector<double> values;  ///< height x width, SI
  double spread = 0;           ///< standard deviation of pixels about their superpixel, without noise; SI
  double noise = 0;            ///< median standard deviation of the estimates before shrinking, SI; NaN: none
};

/// @param measurements from captures, which are read again
/// @param state all parameters, with the maps of superpixels
/// @throws std::runtime_error if a capture can no longer be read
std::vector<PixelMap> pixel_maps(const Measurements& measurements, const Problem& problem, const State& state);

// ---- Effects of the setup that a map of the pixels could absorb ----

/// "These conditions cannot distinguish board_tilt from the map of fixed_pattern: ..", for each effect of the setup
/// that the author of a map in the model lists as confused with it, and that the data do not determine to within its
/// typical value when fitted with the map. @param candidates effects that the model may lack
std::vector<std::string> notes_on_pattern_ties(const Problem& problem, const ModelFit& fit,
                                               const Candidates& candidates);

}  // namespace tofgraph::diagnosis
