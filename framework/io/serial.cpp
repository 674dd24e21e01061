// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/serial.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tofgraph::io {

std::string serial_problem(const std::string& made_for, const std::string& used_on, const std::string& data) {
  if (made_for.empty() || used_on.empty() || made_for == used_on) return {};
  return fmt::format("is of the camera with the serial {}, {} are of {}", made_for, data, used_on);
}

std::string common_serial(const Campaign& campaign, const std::vector<std::string>& serials,
                          config::Diagnostics& diagnostics) {
  std::string serial;
  for (std::size_t i = 0; i < serials.size(); ++i) {
    if (serials[i].empty() || serials[i] == serial) continue;
    if (serial.empty()) {
      serial = serials[i];
      continue;
    }
    config::Position at = campaign.conditions[i].at;
    at.column = std::max<std::size_t>(at.column, 1);  // for a table row its beginning
    diagnostics.error(
        at, fmt::format("the capture is of the camera with the serial {}, those before of {}", serials[i], serial),
        "a calibration is of one camera: make a campaign for each");
  }
  return serial;
}

}  // namespace tofgraph::io
