// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file What a reader of a report must know of its data: sentences, in the order in which they stand there.
#pragma once

#include "diagnosis/contrast.hpp"
#include "diagnosis/ingest.hpp"
#include "diagnosis/pixel_maps.hpp"
#include "diagnosis/search.hpp"

#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// What was left out, and what the measurements cannot tell. @param problem of these measurements
std::vector<std::string> notes_on(const Measurements& measurements, const Problem& problem);

/// What the names and values that were found may stand for, and what they rest on that was not measured. Nothing where
/// nothing was found. @param problem of the measurements
std::vector<std::string> notes_on_found(const Problem& problem, const SearchResult& search);

/// What conditions have of their own, where it is enough to matter, but boards that stand elsewhere. @param problem
/// with what the search allowed
std::vector<std::string> notes_on_nuisances(const Problem& problem, const SearchResult& search);

/// "Condition white-3 is off by 20.0 mm: its board stands farther than the 1.200 m that are written, check that. It
/// counts less.", for each that is; nothing where something is left that may be the cause.
std::vector<std::string> notes_on_misplaced(const Design& design, const SearchResult& search);

/// What a profile's contrast should be.
std::string note_on_contrast(const MeasuredContrast& contrast);

/// What was not written, and why: effects with which the model would be worse than the given one, and those that a time
/// limit did not reach. @param time_limit s
std::vector<std::string> notes_on_verification(const SearchResult& search, double time_limit);

/// How far apart pixels are in the maps that were found, and how well each is known.
std::vector<std::string> notes_on_maps(const std::vector<PixelMap>& maps);

}  // namespace tofgraph::diagnosis
