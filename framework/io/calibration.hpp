// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Calibration files: what all kinds have in common, and quantities with their uncertainty. The layout is told in
/// framework/io/README.md.
///
///     io::CalibrationReader file(path, "intrinsics", camera.name);
///     const io::Calibrated focal = file.need("focal_length", "px", 2, "{value: [318.2 px, 318.4 px]}");
///     file.finish();
#pragma once

#include "config/document.hpp"

#include <optional>

namespace tofgraph::io {

/// A calibrated quantity, SI.
struct Calibrated {
  std::vector<double> value;
  std::vector<double> sd;  ///< standard deviation of each value; NaN: not stated
};

/// Reads one calibration file. Mistakes are collected and thrown by finish(), each with file, line and column.
class CalibrationReader {
 public:
  /// Reads the file and checks its head: version, kind, camera, serial, inputs, settings.
  /// @param kind, camera what is expected: the kind of calibration, the name of the camera's profile
  /// @throws ConfigurationError when the file cannot be read or is not YAML
  CalibrationReader(const std::filesystem::path& file, const std::string& kind, const std::string& camera);
  CalibrationReader(const CalibrationReader&) = delete;
  CalibrationReader& operator=(const CalibrationReader&) = delete;

  /// A quantity that has to be there, of `count` numbers of one unit; a single number is written without a list.
  /// @returns zeros where it is wrong: finish() throws then
  Calibrated need(const std::string& key, std::string_view unit, std::size_t count, std::string_view example);
  /// @throws ConfigurationError with every mistake, keys of `values` that nobody asked for included
  void finish();

  const std::string& serial() const { return serial_; }  ///< of the camera; empty: not stated

 private:
  void check_word(config::Reader& head, std::string_view key, const std::string& expected);
  void check_inputs(const config::Value& inputs);

  config::Value document_;
  config::Diagnostics diagnostics_;
  std::string serial_;
  std::optional<config::Reader> values_;
};

}  // namespace tofgraph::io
