// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Effects with a number for every pixel (offsets, sensitivities) of which the model names no file: their maps are
/// estimated from what a fit leaves, one value a superpixel, jointly with all else. They cost as many parameters.
#pragma once

#include "diagnosis/search/trials.hpp"

namespace tofgraph::diagnosis {

/// Step of a map, whatever its unit: effects are linear in their maps, or nearly.
inline constexpr double map_probe = 1e-3;

/// An effect whose maps were estimated, in a model.
struct MapTrial {
  Trial trial;
  double left = 0;  ///< chi-square over its expectation that the fit leaves
};

/// The best of those candidates that have maps, fitted; nothing where there is none or none is worth its parameters.
/// @param refused names that are not tried, and why; what fails is added
std::optional<MapTrial> best_maps(const Problem& problem, const ModelFit& base,
                                  const std::vector<std::unique_ptr<Candidate>>& candidates,
                                  std::map<std::string, std::string>& refused, std::size_t flips, std::uint64_t seed);

/// A model with an effect whose first map is estimated, whatever it is worth. @throws simulation::EffectError
ModelFit fit_with_map_of(const Problem& problem, State state, const Candidate& candidate);

/// The score of a term's maps in a model without it.
Score score_of_maps(const Problem& problem, const ModelFit& without, const Term& term, std::size_t flips,
                    std::uint64_t seed);

/// A state whose maps are estimated anew.
State with_maps_of(const Problem& problem, State state);

/// True if a state has maps that were estimated.
bool has_maps(const State& state);
/// True if its maps follow what is tried beside them: those of one effect do; those of several would take too long, and
/// are held.
bool maps_follow(const State& state);

/// Change by each map of a state for one step of all its values. Each stands for one column a superpixel.
/// @throws simulation::EffectError
std::vector<Column> map_columns(const Problem& problem, const State& state);

/// As fit(), with maps that follow the other effects.
ModelFit fit_with_maps(const Problem& problem, State start);
/// As fit_roughly(), likewise where maps_follow(); never worse than the start.
/// @param start where maps are those of another state
ModelFit fit_roughly_with_maps(const Problem& problem, State start);

}  // namespace tofgraph::diagnosis
