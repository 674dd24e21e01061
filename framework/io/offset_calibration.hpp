// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Calibration files of the kind `offset`: what `calibrate offset` writes and the stage `offset_correction`
/// reads.
#pragma once

#include "io/calibration.hpp"
#include "io/camera.hpp"

#include <tofgraph/physics/offset_table.hpp>

#include <array>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Choice of the reflected path of the re-modelled board in (6.4).
enum class OffsetVariant {
  geometric,  ///< D_ref(D_avg)
  printed     ///< D_ref(T) + (D_avg - T), which the reference's tables were computed with
};

struct OffsetCalibration {
  std::string camera, serial;       ///< serial: empty where it is not stated
  double modulation_frequency = 0;  ///< Hz
  double gain = 0;                  ///< counts m^2/s: what reflectivities are relative to
  OffsetVariant variant = OffsetVariant::geometric;
  std::vector<std::string> targets;  ///< labels
  std::vector<physics::OffsetSample> samples;
  std::vector<double> depth_sd;     ///< m, of each sample's depth
  std::array<double, 2> falloff{};  ///< b1, b2: see response_of()
};

/// Light of a pixel relative to one on the axis: exp(b1 q + b2 q^2), q = tan^2 of the ray's angle to the axis.
double response_of(const std::array<double, 2>& falloff, const float* ray);

/// @param camera what the calibration has to be of; its frequency is compared
/// @throws config::ConfigurationError with every mistake
OffsetCalibration read_offset_calibration(const std::filesystem::path& file, const tofgraph_camera& camera);

/// The settings and values of the above; others can be added.
void write_offset_calibration(const OffsetCalibration& calibration, CalibrationWriter& writer);

}  // namespace tofgraph::io
