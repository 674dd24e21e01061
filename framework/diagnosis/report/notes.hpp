// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Notes on the data of a report: sentences, in the order in which they stand there.
#pragma once

#include "diagnosis/data/ingest.hpp"
#include "diagnosis/model/contrast.hpp"
#include "diagnosis/search/pixel_maps.hpp"
#include "diagnosis/search/search.hpp"

#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Notes on what was left out, and on what the measurements cannot determine. @param problem of these measurements
std::vector<std::string> notes_on(const Measurements& measurements, const Problem& problem);

/// Notes on what the names and values that were found may stand for, and on assumptions that were not measured. Nothing
/// where nothing was found. @param problem of the measurements
std::vector<std::string> notes_on_found(const Problem& problem, const SearchResult& search);

/// Notes on the nuisances of conditions that are large enough to matter, except boards that stand elsewhere. @param
/// problem with what the search allowed
std::vector<std::string> notes_on_nuisances(const Problem& problem, const SearchResult& search);

/// "Condition white-3 is off by 20.0 mm: its board stands farther than the 1.200 m that are written, check that. It
/// counts less.", for each that is; nothing where something is left that may be the cause.
std::vector<std::string> notes_on_misplaced(const Design& design, const SearchResult& search);

/// Note on the contrast that a profile should have.
std::string note_on_contrast(const MeasuredContrast& contrast);

/// Notes on what was not written, and why: effects with which the model would be worse than the given one, and those
/// that a time limit did not reach. @param time_limit s
std::vector<std::string> notes_on_verification(const SearchResult& search, double time_limit);

/// Notes on the spread of pixels in the maps that were found, and on how well each is known.
std::vector<std::string> notes_on_maps(const std::vector<PixelMap>& maps);

}  // namespace tofgraph::diagnosis
