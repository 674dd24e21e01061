// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Check that a calibration belongs to the device that recorded the frames.
#pragma once

#include <tofgraph/stage.hpp>

#include <nlohmann/json.hpp>

#include <string>

#include "io/serial.hpp"

namespace tofgraph {

/// Serial number of the frames' camera, as stated by their source; empty: unknown.
inline std::string serial_of(const Setup& setup) {
  const tofgraph_stream& stream = setup.stream();
  const auto known = nlohmann::json::parse(stream.source != nullptr ? stream.source : "{}", nullptr, false);
  return known.is_object() ? known.value("serial", "") : "";
}

/// Parameter `other_serial` of a stage that uses a calibration, and the check that it relaxes.
class SerialCheck {
 public:
  explicit SerialCheck(Stage* stage)
      : stage_(*stage),
        other_serial_(stage, "other_serial",
                      {.default_value = "false",
                       .text = "true: a calibration of a device with another serial number is used, with a warning"}) {}

  /// @param parameter names the calibration @param made_for its serial number; empty: not stated @param used_on the
  /// frames' serial number; empty: unknown
  /// @throws ConfigError of the parameter if the two differ
  void operator()(const char* parameter, const std::string& made_for, const std::string& used_on) const {
    const std::string problem = io::serial_problem(made_for, used_on, "the frames");
    if (problem.empty()) return;
    if (!*other_serial_) throw ConfigError(parameter, problem + ": calibrate that camera, or --other-serial uses it");
    stage_.warn("the " + std::string(parameter) + " " + problem + ": it is used nevertheless");
  }

 private:
  const Stage& stage_;
  Param<bool> other_serial_;
};

}  // namespace tofgraph
