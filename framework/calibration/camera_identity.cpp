// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/camera_identity.hpp"

#include "io/serial.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tofgraph::calibration {

config::Position place_of(const io::Condition& condition) {
  config::Position at = condition.at;
  at.column = std::max<std::size_t>(at.column, 1);
  return at;
}

std::string capture_problem(const io::Condition& condition, const std::exception& problem) {
  const std::string file = condition.capture.string(), text = problem.what();
  return fmt::format("the capture {} {}", file, text.starts_with(file + ": ") ? text.substr(file.size() + 2) : text);
}

std::string check_one_camera(const io::Campaign& campaign, const std::vector<CameraSeen>& seen,
                             std::vector<std::string>& notes, config::Diagnostics& diagnostics) {
  std::vector<std::string> serials;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const io::Condition& c = campaign.conditions[i];
    if (!seen[i].camera.empty() && seen[i].camera != campaign.camera->view().name)
      notes.push_back(fmt::format("{}: the capture is of the camera '{}', the campaign's is '{}'", c.id, seen[i].camera,
                                  campaign.camera->view().name));
    serials.push_back(seen[i].serial);
  }
  return io::common_serial(campaign, serials, diagnostics);
}

}  // namespace tofgraph::calibration
