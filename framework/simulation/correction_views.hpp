// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Views used to determine which effects can be corrected. For correction*.cpp only.
#pragma once

#include "simulation/correction.hpp"

#include <complex>
#include <optional>

namespace tofgraph::simulation {

/// A frame's settings as the forward model takes them: what is not known is as usual: an integration time in
/// the middle of what the camera allows, an hour since power-on, 298 K.
Acquisition acquisition_for(const tofgraph_camera& camera, const FrameSettings& settings);

/// Surfaces at several distances and of several amplitudes, in the middle of the image and in its corners.
Views some_views(const CameraInverse& inverse);

/// A stretch of true distances, m, in which the measured one falls.
struct Fold {
  double from, to;
};
/// The first one, for the pixel in the middle, that is there at small and at large amplitudes.
std::optional<Fold> first_fold(const CameraInverse& inverse, const Acquisition& acquisition);

/// The light of an image's pixels, counts: amplitude e^(j phase).
using PhasorImage = std::vector<std::complex<double>>;

Pixels window(const Pixels& image, std::size_t rows, std::size_t columns);  ///< in its middle
PhasorImage random_phasors(std::size_t size);
double norm_of(const PhasorImage& image);
/// View of the camera where the pixels' light without effects would be this.
PhasorImage look(const CameraInverse& inverse, const Acquisition& acquisition, const Pixels& pixels,
                 const PhasorImage& light);

}  // namespace tofgraph::simulation
