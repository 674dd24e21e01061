// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/board_pose.hpp"
#include "cli/pose.hpp"
#include "config/diagnostics.hpp"
#include "config/log.hpp"
#include "config/paths.hpp"
#include "io/calibration.hpp"
#include "io/captures/capture.hpp"
#include "io/output_file.hpp"
#include "io/pattern.hpp"
#include "io/profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <numbers>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

/// Camera given by the user, else of the capture's profile, else of its name. Null if there are errors.
io::CameraPtr camera_of(const PoseArguments& arguments, config::Diagnostics& diagnostics) {
  std::string name = arguments.camera;
  if (name.empty()) {
    const io::CaptureReader capture(arguments.capture);
    const io::CaptureHeader& header = capture.header();
    if (!header.profile.empty())
      return io::read_profile(config::parse_document("profile", header.profile), diagnostics);
    name = header.camera;
  }
  return io::find_camera(config::parse_document("--camera", config::yaml_word(name)), diagnostics);
}

/// Campaign of the capture alone.
io::Campaign campaign_of(const PoseArguments& arguments) {
  config::Diagnostics diagnostics;
  io::Campaign campaign;
  campaign.camera = camera_of(arguments, diagnostics);
  campaign.pattern = io::read_pattern(config::parse_document("--pattern", arguments.pattern), diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  campaign.conditions.emplace_back().capture = arguments.capture;
  return campaign;
}

std::string text_of(const calibration::BoardPose& pose, const io::Campaign& campaign, const PoseArguments& arguments) {
  io::CalibrationWriter writer(arguments.out, "pose", campaign.camera->view().name, pose.serial);
  writer.input(arguments.capture);
  const auto numbers = [](const auto& values) { return io::Calibrated{{values.begin(), values.end()}, {}}; };
  writer.numbers("rotation", numbers(pose.world_camera.rotation), "", 1);
  writer.numbers("translation", numbers(pose.world_camera.translation), "mm", 1e-3);
  writer.number("rms", pose.rms, std::nan(""), "px", 1);
  return writer.text();
}

int pose(const PoseArguments& arguments) {
  if (!arguments.out.empty()) {
    const fs::path inputs[] = {arguments.capture, arguments.camera};
    std::string problem = io::input_problem(arguments.out, inputs);
    if (problem.empty()) problem = io::output_problem(arguments.out, arguments.force, "--force");
    if (!problem.empty()) throw config::ConfigurationError("--out: error: " + problem);
  }
  const io::Campaign campaign = campaign_of(arguments);
  calibration::BoardPose found;
  try {
    found = calibration::pose_of(campaign);
  } catch (const std::runtime_error& problem) {
    const std::string text = problem.what(), file = arguments.capture + ": ";
    throw std::runtime_error(text.starts_with(file) ? text : file + text);
  }
  constexpr double degrees = 180 / std::numbers::pi;
  if (!arguments.quiet)
    config::print_message(
        fmt::format("{} points of the pattern, {:.3f} px rms; its centre is {:.1f} mm away, it is tilted by "
                    "{:.2f} deg against the optical axis",
                    found.points, found.rms, 1e3 * found.distance, degrees * found.tilt));
  fmt::print("rotation: [{:.9g}]\ntranslation: [{:.6g} mm, {:.6g} mm, {:.6g} mm]\n",
             fmt::join(found.world_camera.rotation, ", "), 1e3 * found.world_camera.translation[0],
             1e3 * found.world_camera.translation[1], 1e3 * found.world_camera.translation[2]);
  if (!arguments.out.empty()) {
    io::write_file(arguments.out, text_of(found, campaign, arguments));
    if (!arguments.quiet) config::print_message("wrote " + arguments.out);
  }
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::pose(*static_cast<const tofgraph::cli::PoseArguments*>(arguments));
}
