// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The views of a campaign for a lens: images averaged over frames, the pattern found in them, distances of it.
#pragma once

#include "calibration/corners.hpp"
#include "calibration/lens_judgement.hpp"
#include "calibration/one_camera.hpp"
#include "io/campaign.hpp"

#include <functional>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// The mean images of one condition.
struct ViewImages {
  Image image;                                                       ///< amplitude, or intensity where there is none
  std::vector<double> distance;                                      ///< m, half path; empty: not recorded
  double distance_noise = std::numeric_limits<double>::quiet_NaN();  ///< m, of a pixel of the mean; NaN: one frame only
  std::size_t frames = 0;
  std::size_t isolated = 0;  ///< pixels of the image that were left out, since they are unlike their neighbours
};

/// A condition in which the pattern was not used, and why.
struct SkippedView {
  std::string id, reason;
};

struct LensViews {
  io::Pattern pattern;
  Observations observations;        ///< views with corners; without distances yet
  std::vector<ViewImages> images;   ///< images of these views
  std::vector<double> pixel_noise;  ///< noise of these views, counts
  std::vector<SkippedView> skipped;
  std::vector<std::string> notes;
  std::string serial;
};

/// Lens of a camera's profile, px; without thin prism.
LensParameters lens_of(const tofgraph_camera& camera);

/// Reads all conditions and finds the pattern, on all threads. Views that are the same are merged.
/// @throws config::ConfigurationError captures that cannot be read, two serials or cameras, too few views with the
/// pattern
LensViews read_lens_views(const io::Campaign& campaign, const std::function<void(double share)>& progress);

/// Reads one condition. @throws std::runtime_error what is wrong with the capture
ViewImages images_of(const io::Condition& condition, const io::Camera& camera, CameraSeen& seen);

/// The distances of the bright, even parts of the board, means over blocks of pixels. @param pose as solved
std::vector<BoardDistance> board_distances(const ViewImages& images, const LensViews& views, const LensParameters& lens,
                                           const Pose& pose);

}  // namespace tofgraph::calibration
