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

/// Request of the user; each kind uses what it needs.
struct Request {
  std::filesystem::path campaign, output;
  io::OffsetVariant variant = io::OffsetVariant::geometric;
  std::optional<std::array<double, 2>> range;  ///< m, the distances that matter
  std::optional<double> accuracy;              ///< m, that is wanted
  std::optional<io::Roi> roi;                  ///< window of the reported means
  std::optional<double> corrected_at;          ///< s since power-on, at which the offset is corrected
  std::vector<std::string> free;               ///< k3, skew, rational: what is fitted beyond the usual
  std::vector<std::string> without;            ///< distances, warp: what is not used or fitted
  bool force = false;                          ///< write results that do not improve held-out conditions
  std::function<void(double share, const std::string& what)> progress;
};

/// Root mean square errors of conditions that a calibration was not made from, without it and with it.
struct HeldOutErrors {
  std::string left_out;          ///< "each distance"
  double before = 0, after = 0;  ///< m, or without a unit; NaN: not known
  std::string unit = "mm";
  double scale = 1e-3;   ///< unit's, in SI
  std::string causes;    ///< likely ones of after >= before
  std::string used;      ///< counts of what was used and left out, see used_of(); empty: not counted
  double tolerance = 0;  ///< share of `before` by which `after` may exceed it
};

struct Result {
  std::string file;                    ///< the text of the calibration file
  report::Page page;                   ///< the report
  std::string summary;                 ///< result in a few lines
  std::vector<std::string> notes;      ///< remarks for the user
  std::string model;                   ///< fitted effects, a model file for model_correction
  std::vector<io::PixelMapData> maps;  ///< maps of the camera's pixels, for a file of their own
  std::size_t map_rows = 0, map_columns = 0;
  std::optional<HeldOutErrors> held_out;  ///< decides whether the calibration is written; none: not judged
};

/// Kind of calibration.
struct Kind {
  const char* name;
  const char* text;
  /// @throws config::ConfigurationError, std::runtime_error
  Result (*calibrate)(const Request& request);
  const char* options = "";                        ///< command's, words: the others are refused
  bool writes_model = false, writes_maps = false;  ///< beside the calibration and its report
};

/// All there are. A new kind is a file with its function, declared and listed in calibrate.cpp.
std::span<const Kind> kinds();
/// @throws config::ConfigurationError with the nearest and the list
const Kind& kind_of(const std::string& name);

/// Makes a calibration. One that does not improve the conditions that were held out is refused, unless the request is
/// forced: then a note says so.
/// @throws config::ConfigurationError a mistake in the campaign
/// @throws std::runtime_error a calibration that does not improve held-out conditions, or that did not converge
Result calibrate(const Kind& kind, const Request& request);

/// The report of a calibration file: `camcube2.yaml` and `camcube2.html`.
std::filesystem::path report_of(const std::filesystem::path& calibration);
/// The effects that it found: `camcube2.model.yaml`.
std::filesystem::path model_of(const std::filesystem::path& calibration);
/// Its maps of the pixels: `camcube2.maps.h5`.
std::filesystem::path maps_of(const std::filesystem::path& calibration);
/// All files that a calibration of this kind writes, the calibration last.
std::vector<std::filesystem::path> outputs_of(const Kind& kind, const std::filesystem::path& calibration);
/// Writes them, each whole or not at all, the calibration last. @throws std::runtime_error
void write(const Result& result, const Kind& kind, const std::filesystem::path& calibration);

}  // namespace tofgraph::calibration
