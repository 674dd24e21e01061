// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Flatness of the surfaces of a recording under an assumption, e.g. the lengths are ranges, the image is mirrored,
/// the lens has another distortion. Under the right assumption planes are flat.
#pragma once

#include "inspection/surfaces.hpp"

#include <tofgraph/physics/geometry.hpp>
#include <tofgraph/physics/lens.hpp>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::inspection {

/// Orientation of the images, as in the stage `orient` that corrects it: mirrored, then turned clockwise.
struct Orientation {
  const char* mirror = "none";
  int turn = 0;                              ///< deg
  std::array<int, 4> matrix = {1, 0, 0, 1};  ///< acts on pixel coordinates relative to the image centre
};

/// Assumption about a recording; the defaults change nothing.
struct Assumption {
  std::string channel;  ///< type of the lengths: depth, range or distance
  double scale = 1;     ///< factor of the lengths
  double offset = 0;    ///< m, subtracted from the lengths
  Orientation orientation;
  std::array<double, 5> distortion = {};  ///< k1 k2 p1 p2 k3; further coefficients are those of the camera
  bool further = true;                    ///< false: no further coefficients
  double focal_scale = 1;                 ///< factor of the focal length
};

/// Deviation of the surfaces from planes.
struct Flatness {
  double rms = 0;                        ///< m, over all blocks; the noise variance is subtracted
  double chi2 = 0;                       ///< variance: noise, and tolerance of 0.04 % of the length
  std::size_t count = 0;                 ///< number of blocks
  std::vector<double> rest;              ///< deviation of each block, m
  std::vector<physics::Vector3> points;  ///< of each block, m; NaN: no ray
  std::vector<double> surface_rms;       ///< RMS of each surface, relative to its mean length
};

class FlatnessTest {
 public:
  FlatnessTest(const Observation& observation, Surfaces surfaces);

  const Surfaces& surfaces() const { return surfaces_; }
  /// Assumption stated by the profile and the recording.
  Assumption stated() const;
  /// Returns true if the light sources of the camera are known, which `distance` requires.
  bool knows_sources() const { return geometry_.has_value(); }
  bool is_square() const { return observation_.width == observation_.height; }
  /// Returns true if the lens of the camera has coefficients beyond the five of `distortion`.
  bool has_further() const;
  /// Returns true if the lens has OpenCV's perspective model, the only one whose coefficients are tested.
  bool is_perspective() const;
  Flatness operator()(const Assumption& assumption) const;
  /// Removes the surfaces for which `keep` is false.
  void keep(const std::vector<bool>& keep);

 private:
  std::optional<physics::Vector3> ray_of(const Block& block, const Assumption& assumption,
                                         const tofgraph_camera& camera, const physics::Lens& lens) const;
  double range_of(double length, physics::Vector3 ray, const Assumption& assumption) const;

  const Observation& observation_;
  Surfaces surfaces_;
  std::optional<physics::Geometry> geometry_;
};

/// Returns true if a correction moves the blocks by at least the deviation that it removes. Otherwise the gain is due
/// to an ill-conditioned plane.
bool moves_enough(const Flatness& stated, const Flatness& corrected);

/// All orientations compatible with the image size, except the identity.
std::vector<Orientation> other_orientations(bool square);

}  // namespace tofgraph::inspection
