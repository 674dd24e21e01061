// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/board_pose.hpp"

#include "calibration/bundle_problem.hpp"
#include "calibration/lens_views.hpp"

#include <cmath>
#include <stdexcept>

namespace tofgraph::calibration {
namespace {

/// p_world = R^T (p_camera - t).
Pose inverse_of(const Pose& pose) {
  Pose inverse;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      inverse.rotation[3 * i + k] = pose.rotation[3 * k + i];
      inverse.translation[i] -= pose.rotation[3 * k + i] * pose.translation[k];
    }
  }
  return inverse;
}

double reprojection_rms(const Observations& observations, const View& view, const LensParameters& lens,
                        const Pose& pose) {
  double squares = 0;
  for (const Corner& corner : view.corners) {
    const BoardPoint& at = observations.points[corner.point];
    double camera[3], pixel[2];
    for (std::size_t i = 0; i < 3; ++i)
      camera[i] = pose.rotation[3 * i] * at.x + pose.rotation[3 * i + 1] * at.y + pose.translation[i];
    project<double>(lens.data(), camera, pixel);
    squares += std::pow(corner.u - pixel[0], 2) + std::pow(corner.v - pixel[1], 2);
  }
  return std::sqrt(squares / static_cast<double>(view.corners.size()));
}

}  // namespace

BoardPose pose_of(const io::Campaign& campaign) {
  const io::Condition& condition = campaign.conditions.front();
  const tofgraph_camera& camera = campaign.camera->view();
  CameraSeen seen;
  const ViewImages images = images_of(condition, *campaign.camera, seen);
  const BoardSearch search = find_board(images.image, *campaign.pattern);
  if (!search.found()) throw std::runtime_error("the pattern is not seen: " + search.reason);
  Observations observations;
  observations.width = camera.width;
  observations.height = camera.height;
  observations.points = board_points(*campaign.pattern);
  View view;
  view.corners = search.corners;
  const LensParameters lens = lens_of(camera);
  BoardPose result;
  if (!initial_pose(observations, view, lens, result.board))
    throw std::runtime_error("no pose fits the pattern's points: is the pattern right?");
  result.world_camera = inverse_of(result.board);
  result.rms = reprojection_rms(observations, view, lens, result.board);
  result.points = search.corners.size();
  const auto& t = result.board.translation;
  result.distance = std::sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
  result.tilt = std::acos(std::min(std::abs(result.board.rotation[8]), 1.0));
  result.serial = seen.serial;
  return result;
}

}  // namespace tofgraph::calibration
