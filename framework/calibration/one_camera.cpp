// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/one_camera.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tofgraph::calibration {

config::Position place_of(const io::Condition& condition) {
  config::Position at = condition.at;
  at.column = std::max<std::size_t>(at.column, 1);
  return at;
}

std::string check_one_camera(const io::Campaign& campaign, const std::vector<CameraSeen>& seen,
                             std::vector<std::string>& notes, config::Diagnostics& diagnostics) {
  std::string serial;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const io::Condition& c = campaign.conditions[i];
    if (!seen[i].camera.empty() && seen[i].camera != campaign.camera->view().name)
      notes.push_back(fmt::format("{}: the capture is of the camera '{}', the campaign's is '{}'", c.id, seen[i].camera,
                                  campaign.camera->view().name));
    if (seen[i].serial.empty() || seen[i].serial == serial) continue;
    if (serial.empty())
      serial = seen[i].serial;
    else
      diagnostics.error(
          place_of(c),
          fmt::format("the capture is of the camera with the serial {}, those before of {}", seen[i].serial, serial),
          "a calibration is of one camera: make a campaign for each");
  }
  return serial;
}

}  // namespace tofgraph::calibration
