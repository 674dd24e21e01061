// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Effects with a value per pixel (offsets, sensitivities) for which the model names no file: their maps are estimated
/// from the residual of a fit, one value per superpixel, jointly with all else. Each value counts as a parameter.
#pragma once

#include "diagnosis/search/trials.hpp"

namespace tofgraph::diagnosis {

/// Step of a map, in its unit: effects are linear in their maps, or nearly.
inline constexpr double map_probe = 1e-3;

/// An effect with estimated maps, in a model.
struct MapTrial : Trial {
  double lack_of_fit = 0;  ///< chi-square of the fit over its expectation
};

/// Best candidate with maps, fitted; nullopt if there is none or none is worth its parameters.
/// @param refused names to skip, with reasons; failing ones are added @param seed of the sign flips
std::optional<MapTrial> best_maps(const Problem& problem, const ModelFit& base,
                                  const std::vector<std::unique_ptr<Candidate>>& candidates,
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

}  // namespace tofgraph::diagnosis
