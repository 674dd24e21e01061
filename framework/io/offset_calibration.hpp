// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Calibration files of the kind `offset`: written by `calibrate offset` and read by the stage
/// `offset_correction`.
#pragma once

#include "io/calibration.hpp"
#include "io/camera.hpp"

#include <tofgraph/physics/offset_table.hpp>

#include <array>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Reflected path of the re-modelled board in (6.4).
enum class OffsetVariant {
  geometric,  ///< D_ref(D_avg)
  printed     ///< D_ref(T) + (D_avg - T), used for the reference's tables
};

struct OffsetCalibration {
  std::string camera, serial;       ///< serial: empty if not stated
  double modulation_frequency = 0;  ///< Hz
  double gain = 0;                  ///< counts m^2/s, to which the reflectivities refer
  OffsetVariant variant = OffsetVariant::geometric;
  std::vector<std::string> targets;  ///< labels
  std::vector<physics::OffsetSample> samples;
  std::vector<double> depth_sd;     ///< m, of the depth of each sample
  std::array<double, 2> falloff{};  ///< b1, b2: see response_of()
};

/// Light of a pixel relative to a pixel on the axis: exp(b1 q + b2 q^2), q = tan^2 of the ray's angle to the axis.
double response_of(const std::array<double, 2>& falloff, const float* ray);

/// @param camera must match the calibration; its frequency is compared
/// @throws config::ConfigurationError with all errors
OffsetCalibration read_offset_calibration(const std::filesystem::path& file, const tofgraph_camera& camera);

/// Composes the file from these settings and values; others can be added.
void write_offset_calibration(const OffsetCalibration& calibration, CalibrationWriter& writer);

}  // namespace tofgraph::io
