// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Views of a campaign for a lens: images averaged over frames, the detected pattern, and its distances.
#pragma once

#include "calibration/camera_identity.hpp"
#include "calibration/corners.hpp"
#include "calibration/lens_validation.hpp"
#include "io/campaign.hpp"

#include <functional>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Mean images of one condition.
struct ViewImages {
  Image image;                                                       ///< amplitude, or intensity if there is none
  std::vector<double> distance;                                      ///< m, half path; empty: not recorded
  double distance_noise = std::numeric_limits<double>::quiet_NaN();  ///< m, of a pixel of the mean; NaN: one frame only
  std::size_t frames = 0;
  std::size_t isolated = 0;  ///< number of excluded pixels that differ from their neighbours
};

/// Condition in which the pattern was not used, and the reason.
struct SkippedView {
  std::string id, reason;
};

struct LensViews {
  io::Pattern pattern;
  Observations observations;        ///< views with corners; without distances yet
  std::vector<ViewImages> images;   ///< of these views
  std::vector<double> pixel_noise;  ///< of these views, counts
  std::vector<SkippedView> skipped;
  std::vector<std::string> notes;
  std::string serial;
};

/// Lens of a camera's profile, px; without thin prism.
LensParameters lens_of(const tofgraph_camera& camera);

/// Reads all conditions and detects the pattern, on all threads. Repeated views are merged.
/// @throws config::ConfigurationError for unreadable captures, two serial numbers or cameras, too few views with the
/// pattern
LensViews read_lens_views(const io::Campaign& campaign, const std::function<void(double share)>& progress);

/// Reads one condition. @throws std::runtime_error naming the problem with the capture
ViewImages images_of(const io::Condition& condition, const io::Camera& camera, CameraSeen& seen);

/// Distances of the bright, uniform parts of the board, averaged over blocks of pixels. @param pose as solved
std::vector<BoardDistance> board_distances(const ViewImages& images, const LensViews& views, const LensParameters& lens,
                                           const Pose& pose);

}  // namespace tofgraph::calibration
