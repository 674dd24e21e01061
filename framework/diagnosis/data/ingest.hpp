// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Converts captures to observations: superpixels, masks, noise.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/data/superpixels.hpp"
#include "io/campaign.hpp"
#include "io/condition.hpp"
#include "simulation/hit.hpp"

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Pixels that see a board smaller than the field of view ----

/// Pixels whose ray, and the rays of all pixels up to two away, hit the board within its size: pixels at the edge also
/// see the background. @param hits intersections of the pixels' rays with the board's plane, row-major
/// @param width pixels per row @param condition with a board of stated size
std::vector<bool> on_board(const io::Condition& condition, std::span<const simulation::Hit> hits, std::size_t width);

// ---- From captures to observations ----

/// Standard deviation between the frames of a condition over that of the profile's noise.
struct NoiseRatio {
  double middle, least, most;  ///< over the conditions; middle: median
};

/// Measurements of a campaign.
struct Measurements {
  std::shared_ptr<const Design> design;    ///< conditions that are used
  std::vector<Observations> observations;  ///< one per condition of the design
  std::vector<std::string> left_out;       ///< excluded conditions, with reasons
  std::size_t frames = 0;
  double bad_pixels = 0;               ///< fraction of pixels that differ from their neighbours
  double saturated = 0;                ///< fraction of pixels
  bool replicates = false;             ///< true: noise from the frames; false: from the camera's profile
  bool taps = false, phases = false;   ///< some condition has them
  bool decoded = false;                ///< some condition has decoded distances and amplitudes
  bool table = false;                  ///< one mean per condition instead of captures
  std::optional<NoiseRatio> noise;     ///< if frames and profile both state noise
  std::string serial;                  ///< of the device that recorded the captures; empty: not recorded
  std::vector<double> recorded_times;  ///< integration times of the captures, s, one per condition; NaN: not recorded
  std::vector<std::size_t> searched;   ///< conditions to be searched, see representative_conditions(); ascending
};

/// Measurements of some conditions; counts, shares and notes remain those of all. @param chosen ascending
Measurements part(const Measurements& whole, std::span<const std::size_t> chosen);

struct IngestOptions {
  bool physical = false;
  bool skip_missing = false;
  std::size_t max_conditions = settings.max_conditions;  ///< to be searched
  std::function<void(double share)> progress;
};

/// Reads all captures, one condition at a time. Phase offsets of single pixels are those of the conditions to be
/// searched.
/// @throws std::runtime_error naming a capture that is missing or unreadable, unless missing ones are skipped
/// @throws std::invalid_argument if too few conditions remain for a search
/// @throws config::ConfigurationError for captures of several devices
Measurements measure(const io::Campaign& campaign, const IngestOptions& options);

/// Means of a table: distance from the depth or, without it, from the half path, and amplitude if given. The noise is
/// the spread of the pixels over the square root of their number; the search adds the scatter between boards.
/// @throws std::invalid_argument if too few conditions remain for a search
Measurements measure_table(const io::Campaign& campaign, const IngestOptions& options);

// ---- Input files of a diagnosis, with hashes of their content ----

struct InputFile {
  std::string file;    ///< as given; captures relative to the campaign's folder
  std::string sha256;  ///< hexadecimal
};

/// Hashes of the model, the campaign, and its table or captures; each once, missing files omitted.
/// @throws std::runtime_error if a file cannot be read
std::vector<InputFile> hashed_inputs(const std::filesystem::path& model, const std::filesystem::path& data,
                                     const std::vector<io::Condition>& conditions);

}  // namespace tofgraph::diagnosis
