// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A calibration is of one device.
#pragma once

#include <tofgraph/stage.hpp>

#include <nlohmann/json.hpp>

#include <string>

namespace tofgraph {

/// The serial number that a source tells of its frames' camera; empty: none.
inline std::string serial_of(const Setup& setup) {
  const tofgraph_stream& stream = setup.stream();
  const auto known = nlohmann::json::parse(stream.source != nullptr ? stream.source : "{}", nullptr, false);
  return known.is_object() ? known.value("serial", "") : "";
}

/// @param own of the frames' camera @param calibrated the calibration's; empty: not known
/// @throws ConfigError of the parameter `calibration`
inline void check_serial_number(const std::string& own, const std::string& calibrated) {
  if (own.empty() || calibrated.empty() || own == calibrated) return;
  throw ConfigError("calibration", "is of the camera with the serial " + calibrated + ", the frames are of " + own +
                                       ": calibrate that camera");
}

}  // namespace tofgraph
