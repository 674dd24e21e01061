// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Whether the captures of a campaign are what its conditions say.
#include "cli/campaign.hpp"
#include "config/say.hpp"
#include "io/captures/capture.hpp"

#include <fmt/format.h>

#include <cmath>

namespace tofgraph::cli {
namespace {

/// Where the capture of a condition is written.
config::Position place_of(const config::Value& document, const io::Condition& condition) {
  const config::Entry* conditions = document.find("conditions");
  if (conditions == nullptr) return condition.at;
  for (const config::Value& item : conditions->value.items) {
    const config::Entry* capture = item.find("capture");
    if (capture != nullptr && item.at.line == condition.at.line && item.at.column == condition.at.column)
      return capture->value.at;
  }
  return condition.at;
}

void check_capture(const io::Condition& condition, const io::CameraPtr& camera, const config::Position& at,
                   config::Diagnostics& diagnostics) {
  const io::CaptureReader capture(condition.capture);
  const io::CaptureHeader& header = capture.header();
  if (camera && (header.width != camera->view().width || header.height != camera->view().height))
    diagnostics.error(at, fmt::format("'capture': the capture is {} x {} px, the camera '{}' has {} x {}", header.width,
                                      header.height, camera->view().name, camera->view().width, camera->view().height));
  if (condition.frames && (*condition.frames)[1] >= capture.frames())
    diagnostics.error(at, fmt::format("'capture': the capture has {}, counted from 0: frame {} is not there",
                                      config::counted(capture.frames(), "frame"), (*condition.frames)[1]));
  if (std::isnan(condition.integration_time) && capture.frames() > 0 &&
      std::isnan(capture.metadata(0).integration_time))
    diagnostics.warning(at, "diagnose cannot use the condition: neither it nor its capture says the integration time",
                        "example: integration_time: 1 ms");
}

void check_captures(const CampaignArguments& arguments) {
  for (const io::Condition& condition : arguments.campaign.conditions) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(condition.capture, error)) continue;  // told already, or there is none
    const config::Position at = place_of(arguments.document, condition);
    try {
      check_capture(condition, arguments.campaign.camera, at, arguments.diagnostics);
    } catch (const std::runtime_error& problem) {
      arguments.diagnostics.error(at, fmt::format("'capture': {}", problem.what()));
    }
  }
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  tofgraph::cli::check_captures(*static_cast<const tofgraph::cli::CampaignArguments*>(arguments));
  return 0;
}
