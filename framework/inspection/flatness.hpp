// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Flatness of the surfaces of a recording under an assumption about how it was made. The right assumption makes
/// planes flat: the lengths are ranges, the image is mirrored, the lens has another distortion.
#pragma once

#include "inspection/surfaces.hpp"

#include <tofgraph/physics/geometry.hpp>
#include <tofgraph/physics/lens.hpp>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::inspection {

/// Orientation of the images, in the terms of the stage `orient` that corrects it: mirrored, then turned clockwise.
struct Orientation {
  const char* mirror = "none";
  int turn = 0;                              ///< deg
  std::array<int, 4> matrix = {1, 0, 0, 1};  ///< of pixel coordinates about the middle of the image
};

/// An assumption about a recording; the default is what is stated.
struct Assumption {
  std::string channel;  ///< of the lengths: depth, range or distance
  double scale = 1;     ///< of the lengths
  double offset = 0;    ///< m, subtracted from the lengths
  Orientation orientation;
  std::array<double, 5> distortion = {};  ///< k1 k2 p1 p2 k3; the further coefficients stay those of the camera
  bool further = true;                    ///< false: without these
  double focal_scale = 1;                 ///< of the focal length
};

/// Deviation of the surfaces from planes.
struct Flatness {
  double rms = 0;                   ///< m, without the noise; weighted by the blocks' number
  double chi2 = 0;                  ///< with the noise and a tolerance of 0.04 % of the length
  std::size_t count = 0;            ///< blocks
  std::vector<double> rest;         ///< of each block, m
  std::vector<double> surface_rms;  ///< of each surface, relative to its length
};

class FlatnessTest {
 public:
  FlatnessTest(const Observation& observation, Surfaces surfaces);

  const Surfaces& surfaces() const { return surfaces_; }
  /// The assumption that the profile and the recording state.
  Assumption stated() const;
  /// Returns whether the camera's sources are known, which `distance` needs.
  bool knows_sources() const { return geometry_.has_value(); }
  bool is_square() const { return observation_.width == observation_.height; }
  /// Returns whether the camera's lens has coefficients beyond the five of `distortion`.
  bool has_further() const;
  /// Returns whether the camera's lens is OpenCV's perspective model, whose coefficients can be questioned.
  bool is_perspective() const;
  Flatness operator()(const Assumption& assumption) const;
  /// Keeps the surfaces for which `keep` is set.
  void keep(const std::vector<bool>& keep);

 private:
  std::optional<physics::Vector3> ray_of(const Block& block, const Assumption& assumption,
                                         const tofgraph_camera& camera, const physics::Lens& lens) const;
  double range_of(double length, physics::Vector3 ray, const Assumption& assumption) const;

  const Observation& observation_;
  Surfaces surfaces_;
  std::optional<physics::Geometry> geometry_;
};

/// All orientations that fit the size of the image, without that which changes nothing.
std::vector<Orientation> other_orientations(bool square);

}  // namespace tofgraph::inspection
