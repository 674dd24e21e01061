// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file From captures to observations: superpixels, masks, noise.
#pragma once

#include "diagnosis/data/design.hpp"
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

// ---- Which pixels see a board that does not fill the view ----

/// Pixels whose ray, and that of every pixel up to two away, meets the board within its size: those at its edge see
/// what stands behind it, too. @param hits where the pixels' rays meet the board's plane, row-major
/// @param width pixels in a row @param condition with a board that has a size
std::vector<bool> on_board(const io::Condition& condition, std::span<const simulation::Hit> hits, std::size_t width);

// ---- From captures to observations ----

/// The standard deviation between the frames of a condition by what the profile's noise says.
struct NoiseRatio {
  double middle, least, most;  ///< of the conditions
};

/// Measurements of a campaign as they were read.
struct Measurements {
  std::shared_ptr<const Design> design;    ///< of the conditions that are used
  std::vector<Observations> observations;  ///< one a condition of the design
  std::vector<std::string> left_out;       ///< conditions that are not used, and why
  std::size_t frames = 0;
  double bad_pixels = 0;               ///< share of pixels that do not fit their neighbours
  double saturated = 0;                ///< share
  bool replicates = false;             ///< noise from the frames; otherwise from the camera's profile
  bool taps = false, phases = false;   ///< some condition has them
  bool decoded = false;                ///< some condition has distances alone
  bool table = false;                  ///< one mean a condition in place of captures
  std::optional<NoiseRatio> noise;     ///< where frames and the profile tell it
  std::string serial;                  ///< of the device that recorded the captures; empty: not recorded
  std::vector<double> recorded_times;  ///< integration times of the captures, s, one a condition; NaN: not recorded
};

struct IngestOptions {
  bool physical = false;
  bool skip_missing = false;
  std::function<void(double share)> progress;
};

/// Reads all captures, one condition at a time.
/// @throws std::runtime_error naming a capture that is missing or cannot be read, unless these are to be skipped
/// @throws std::invalid_argument when too little is left to search in
/// @throws config::ConfigurationError for captures of several devices
Measurements measure(const io::Campaign& campaign, const IngestOptions& options);

/// The means of a table: distance from the depth or else from the half path, and the amplitude where it is there. Their
/// noise is the pixels' spread over the root of how many there are; what boards differ by comes on top in the search.
/// @throws std::invalid_argument when too little is left to search in
Measurements measure_table(const io::Campaign& campaign, bool physical);

// ---- The files that a diagnosis has read, with what they contained ----

struct InputFile {
  std::string file;    ///< as it was given; captures relative to the campaign's folder
  std::string sha256;  ///< hexadecimal
};

/// The model, the campaign, its table or its captures; each once, without those that are missing.
/// @throws std::runtime_error when one cannot be read
std::vector<InputFile> hashed_inputs(const std::filesystem::path& model, const std::filesystem::path& data,
                                     const std::vector<io::Condition>& conditions);

}  // namespace tofgraph::diagnosis
