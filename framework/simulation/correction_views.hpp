// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Views for determining which effects can be corrected. For correction*.cpp only.
#pragma once

#include "simulation/correction.hpp"

#include <complex>
#include <optional>

namespace tofgraph::simulation {

/// Frame settings for the forward model. Unknown values are replaced by typical ones: the geometric mean of the
/// camera's integration-time limits, one hour since power-on, 298 K.
Acquisition acquisition_for(const tofgraph_camera& camera, const FrameSettings& settings);

/// Surfaces at several distances and amplitudes, at the image centre and in its corners.
Views some_views(const CameraInverse& inverse);

/// Interval of true distances, m, in which the measured distance decreases.
struct Fold {
  double from, to;
};
/// First fold of the central pixel that exists at small and at large amplitudes.
std::optional<Fold> first_fold(const CameraInverse& inverse, const Acquisition& acquisition);

/// Light of an image's pixels, counts: amplitude e^(j phase).
using PhasorImage = std::vector<std::complex<double>>;

Pixels window(const Pixels& image, std::size_t rows, std::size_t columns);  ///< around its centre
PhasorImage random_phasors(std::size_t size);
double norm_of(const PhasorImage& image);
/// Measurement of the camera if the pixels' light without effects is `light`.
PhasorImage look(const CameraInverse& inverse, const Acquisition& acquisition, const Pixels& pixels,
                 const PhasorImage& light);

}  // namespace tofgraph::simulation
