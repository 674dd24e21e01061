// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Noise of a tap as used by a stage: from a calibration, its parameters or the camera.
#pragma once

#include <tofgraph/physics/four_phase.hpp>
#include <tofgraph/stage.hpp>

#include <exception>
#include <string>

#include "io/noise_calibration.hpp"
#include "plugins/calibrated_serial.hpp"

namespace tofgraph {

/// Parameters `calibration`, `read_noise` and `shot_noise`.
class NoiseParameters {
 public:
  explicit NoiseParameters(Stage* stage)
      : calibration_(stage, "calibration",
                     {.choices = "noise", .text = "a calibration file of the kind noise; default: the camera's noise"}),
        read_noise_(stage, "read_noise",
                    {.unit = "counts", .min = 0, .text = "of a tap; default: the calibration's, or the camera's"}),
        shot_noise_(stage, "shot_noise",
                    {.unit = "counts",
                     .min = 0,
                     .text = "variance of a tap per count; default: the calibration's, or the camera's"}),
        check_serial_(stage) {}

  /// Noise from the parameters, else the calibration, else the camera; NaN if none of them has it.
  /// @throws ConfigError if the calibration cannot be used
  physics::TapNoise noise(const Setup& setup) const {
    physics::TapNoise noise = otherwise(setup);
    if (read_noise_.given()) noise.read_noise = *read_noise_;
    if (shot_noise_.given()) noise.shot_noise = *shot_noise_;
    return noise;
  }

 private:
  physics::TapNoise otherwise(const Setup& setup) const {
    const tofgraph_camera* camera = setup.stream().camera;
    if (calibration_->empty()) {
      if (camera == nullptr) return {};
      return {.read_noise = camera->read_noise, .shot_noise = camera->shot_noise};
    }
    io::NoiseCalibration file;
    try {
      file = io::read_noise_calibration(std::string(*calibration_), setup.camera().name);
    } catch (const std::exception& error) {
      throw ConfigError("calibration", std::string("the calibration cannot be used:\n") + error.what());
    }
    check_serial_("calibration", file.serial, serial_of(setup));
    return file.noise;
  }

  Param<InputFile> calibration_;
  Param<double> read_noise_, shot_noise_;
  SerialCheck check_serial_;
};

}  // namespace tofgraph
