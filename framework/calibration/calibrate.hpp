// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Kinds of calibration: from a campaign to a calibration file and its report.
#pragma once

#include "io/captures/capture_map.hpp"
#include "io/condition.hpp"
#include "io/offset_calibration.hpp"
#include "report/page.hpp"

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Request of the user; each kind uses the members it needs.
struct Request {
  std::filesystem::path campaign, output;
  io::OffsetVariant variant = io::OffsetVariant::geometric;
  std::optional<std::array<double, 2>> range;  ///< m, distances of interest
  std::optional<double> accuracy;              ///< m, required
  std::optional<io::Roi> roi;                  ///< window of the reported means
  std::optional<double> corrected_at;          ///< s since power-on at which the offset is corrected
  std::vector<std::string> free;               ///< k3, skew, rational: additional free parameters
  std::vector<std::string> without;            ///< distances, warp: not used or not fitted
  bool force = false;                          ///< write results that do not improve held-out conditions
  std::function<void(double share, const std::string& what)> progress;
};

/// Root mean square errors of held-out conditions, without the calibration and with it.
struct HeldOutErrors {
  std::string left_out;          ///< "each distance"
  double before = 0, after = 0;  ///< m, or without a unit; NaN: unknown
  std::string unit = "mm";
  double scale = 1e-3;   ///< of the unit, in SI
  std::string causes;    ///< likely causes of after >= before
  std::string used;      ///< counts of used and excluded data, see used_of(); empty: not counted
  double tolerance = 0;  ///< fraction of `before` by which `after` may exceed it
};

struct Result {
  std::string file;                    ///< text of the calibration file
  report::Page page;                   ///< the report
  std::string summary;                 ///< a few lines
  std::vector<std::string> notes;      ///< remarks for the user
  std::string model;                   ///< fitted effects, a model file for model_correction
  std::vector<io::PixelMapData> maps;  ///< per-pixel maps of the camera, for a separate file
  std::size_t map_rows = 0, map_columns = 0;
  std::optional<HeldOutErrors> held_out;  ///< decides whether the calibration is written; none: no test
};

/// Kind of calibration.
struct Kind {
  const char* name;
  const char* text;
  /// @throws config::ConfigurationError, std::runtime_error
  Result (*calibrate)(const Request& request);
  const char* options = "";                        ///< of the command, words; other options are rejected
  bool writes_model = false, writes_maps = false;  ///< in addition to the calibration and its report
};

/// All kinds. A new kind is a file with its function, declared and listed in calibrate.cpp.
std::span<const Kind> kinds();
/// @throws config::ConfigurationError with the most similar name and the list
const Kind& kind_of(const std::string& name);

/// Makes a calibration. It is rejected if it does not improve the held-out conditions, unless the request is forced, in
/// which case a note is added.
/// @throws config::ConfigurationError for an error in the campaign
/// @throws std::runtime_error for a calibration that does not improve held-out conditions, or did not converge
Result calibrate(const Kind& kind, const Request& request);

/// Path of the report of a calibration file: `camcube2.yaml` and `camcube2.html`.
std::filesystem::path report_of(const std::filesystem::path& calibration);
/// Path of the model with its effects: `camcube2.model.yaml`.
std::filesystem::path model_of(const std::filesystem::path& calibration);
/// Path of its pixel maps: `camcube2.maps.h5`.
std::filesystem::path maps_of(const std::filesystem::path& calibration);
/// All files that a calibration of this kind writes, the calibration last.
std::vector<std::filesystem::path> outputs_of(const Kind& kind, const std::filesystem::path& calibration);
/// Writes them, each atomically, the calibration last. @throws std::runtime_error
void write(const Result& result, const Kind& kind, const std::filesystem::path& calibration);

}  // namespace tofgraph::calibration
