// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Calibration files: the part common to all kinds, and quantities with their uncertainty. The layout is documented in
/// docs/formats/calibration.md.
///
///     io::CalibrationReader file(path, "intrinsics", camera.name);
///     const io::Calibrated focal = file.need("focal_length", "px", 2, "{value: [318.2 px, 318.4 px]}");
///     file.finish();
#pragma once

#include "config/document.hpp"

#include <optional>

namespace tofgraph::io {

/// Calibrated quantity, SI.
struct Calibrated {
  std::vector<double> value;
  std::vector<double> sd;  ///< standard deviation of each value; NaN: not stated
};

/// Reads one calibration file. Errors are collected and thrown by finish(), each with file, line and column.
class CalibrationReader {
 public:
  /// Reads the file and checks its header: version, kind, camera, serial, inputs, settings.
  /// @param kind, camera expected kind of calibration and name of the camera's profile
  /// @throws ConfigurationError if the file cannot be read or is not YAML
  CalibrationReader(const std::filesystem::path& file, const std::string& kind, const std::string& camera);
  CalibrationReader(const CalibrationReader&) = delete;
  CalibrationReader& operator=(const CalibrationReader&) = delete;

  /// Required quantity of `count` numbers of one unit; a single number is written without a list.
  /// @returns zeros if it is invalid: finish() throws in that case
  Calibrated need(const std::string& key, std::string_view unit, std::size_t count, std::string_view example);
  /// Table column: a list of numbers of one unit, `{unit: mm, value: [507.66, 998.02], sd: [0.1, 0.1]}`, or each
  /// number with its own unit. @param count expected length; 0: any, at least one
  Calibrated column(const std::string& key, std::string_view unit, std::size_t count, std::string_view example);
  /// Returns whether `values` has this key.
  bool has(std::string_view key) const;
  /// Word, or list of words, of `settings`; it is an error if the key is missing.
  std::string setting(const std::string& key, std::string_view example);
  std::vector<std::string> setting_words(const std::string& key, std::string_view example);
  /// Reports an error found by the caller. @param key of `values`, whose position is shown
  void error(std::string_view key, const std::string& message, const std::string& hint);
  /// @throws ConfigurationError with all errors, including keys of `values` that were never read
  void finish();

  const std::string& serial() const { return serial_; }  ///< camera's; empty: not stated

 private:
  std::vector<double> column_numbers(const config::Value& list, const std::string& key, std::string_view unit,
                                     const std::string& written_unit, std::string_view example);
  const config::Entry* need_setting(const std::string& key, std::string_view example);
  void check_word(config::Reader& head, std::string_view key, const std::string& expected);
  void check_inputs(const config::Value& inputs);

  config::Value document_;
  config::Diagnostics diagnostics_;
  std::string serial_;
  const config::Value* settings_ = nullptr;
  const config::Value* values_map_ = nullptr;
  std::optional<config::Reader> values_;
};

/// Composes the text of a calibration file for CalibrationReader.
class CalibrationWriter {
 public:
  /// @param file output path: inputs are written relative to its folder @param serial empty: not stated
  CalibrationWriter(const std::filesystem::path& file, const std::string& kind, const std::string& camera,
                    const std::string& serial);

  /// Adds an input file of the calibration with its hash. @throws std::runtime_error if it cannot be read
  void input(const std::filesystem::path& file) { input(file, {}); }
  /// @param sha256 empty: computed here
  void input(const std::filesystem::path& file, std::string sha256);
  /// @param yaml value as YAML text
  void setting(const std::string& key, const std::string& yaml);
  /// Writes a number, SI. @param unit SI @param shown unit to write, e.g. `mm` for `m`; @param scale size of `shown`
  void number(const std::string& key, double value, double sd, std::string_view shown, double scale);
  /// Writes numbers, SI, each with its unit; standard deviations that are NaN are omitted.
  void numbers(const std::string& key, const Calibrated& values, std::string_view shown, double scale);
  /// Writes a table column, SI; standard deviations that are NaN are omitted.
  void column(const std::string& key, const Calibrated& values, std::string_view shown, double scale);

  std::string text() const;

 private:
  std::filesystem::path folder_;
  std::string head_, inputs_, settings_, values_;
};

}  // namespace tofgraph::io
