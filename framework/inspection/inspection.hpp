// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Errors of a recording, found from the recording alone: wrong unit, range taken for depth, wrong lens, images that
/// are mirrored, turned or in another order. Each finding is a possible error with its evidence.
#pragma once

#include "inspection/candidates.hpp"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::inspection {

struct Finding {
  std::string kind;      ///< exposures, unit, channel, lens_sign, ..., bad_pixels, stripes, amplitude, saturated, ...
  std::string text;      ///< one sentence
  std::string evidence;  ///< text with numbers
  std::string mend;      ///< line of YAML, or advice
  double size = 0;       ///< m; NaN: not a length
  double explained = 0;  ///< share of the deviation from planes, 0 to 1; NaN: does not apply
};

/// Result for one recording.
struct Inspection {
  std::string name;
  Observation observation;
  std::vector<Finding> findings;       ///< most likely first
  std::vector<std::string> undecided;  ///< questions that this recording cannot answer
  std::vector<std::string> facts;
  Surfaces surfaces;
  std::vector<double> stated_rest, best_rest;  ///< deviation of each block from its plane, m; best: may be empty
  std::string best;                            ///< kind of the finding that belongs to best_rest
};

/// @param camera null: that of the capture's profile @throws std::runtime_error if the capture cannot be inspected
Inspection inspect(const io::CaptureReader& capture, const io::CameraPtr& camera, const std::string& name);

/// Adds findings about pixels: bad pixels, stripes, distance that depends on the amplitude, saturation.
void add_pixel_findings(Inspection& inspection);

/// Adds a finding if the amplitude is mirrored or turned relative to the lengths (amplitude_orientation.cpp).
void add_amplitude_orientation(Inspection& inspection);

/// Plain text of the findings.
std::string text_of(const Inspection& inspection);
nlohmann::json json_of(const Inspection& inspection);
/// Writes an HTML page with the findings and maps of the deviation from planes. @throws std::runtime_error
void write_page(const Inspection& inspection, const std::filesystem::path& file);

}  // namespace tofgraph::inspection
