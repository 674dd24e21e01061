// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Starting point of the bundle adjustment: Zhang's closed form and the poses by OpenCV.
#include "calibration/bundle_problem.hpp"

#include <opencv2/calib3d.hpp>

#include <cmath>
#include <stdexcept>

namespace tofgraph::calibration {
namespace {

struct Points {
  std::vector<cv::Point3f> board;  ///< m
  std::vector<cv::Point2f> image;  ///< px
};

Points points_of(const Observations& observations, const View& view) {
  Points points;
  for (const Corner& corner : view.corners) {
    const BoardPoint& at = observations.points[corner.point];
    points.board.emplace_back(static_cast<float>(at.x), static_cast<float>(at.y), 0.0F);
    points.image.emplace_back(static_cast<float>(corner.u), static_cast<float>(corner.v));
  }
  return points;
}

/// Mean squared reprojection error over all views with their best poses.
double error_of(const Observations& observations, const LensParameters& lens) {
  double squares = 0, count = 0;
  for (const View& view : observations.views) {
    Pose pose;
    if (!initial_pose(observations, view, lens, pose)) return std::numeric_limits<double>::infinity();
    for (const Corner& corner : view.corners) {
      const BoardPoint& at = observations.points[corner.point];
      double camera[3], pixel[2];
      for (std::size_t i = 0; i < 3; ++i)
        camera[i] = pose.rotation[3 * i] * at.x + pose.rotation[3 * i + 1] * at.y + pose.translation[i];
      if (!(camera[2] > 0)) return std::numeric_limits<double>::infinity();
      project<double>(lens.data(), camera, pixel);
      squares += std::pow(corner.u - pixel[0], 2) + std::pow(corner.v - pixel[1], 2);
      count += 1;
    }
  }
  return squares / count;
}

/// Returns true if these points can be the image of a plane.
bool has_homography(const Points& points) {
  try {
    std::vector<cv::Point2f> flat;
    for (const cv::Point3f& p : points.board) flat.emplace_back(p.x, p.y);
    return !cv::findHomography(flat, points.image).empty();
  } catch (const cv::Exception&) {
    return false;
  }
}

/// Camera matrix by Zhang's closed form. @throws std::runtime_error naming the view that prevents it
cv::Mat zhangs(const Observations& observations, const std::vector<std::vector<cv::Point3f>>& board,
               const std::vector<std::vector<cv::Point2f>>& image) {
  try {
    return cv::initCameraMatrix2D(
        board, image, cv::Size(static_cast<int>(observations.width), static_cast<int>(observations.height)), 1);
  } catch (const cv::Exception&) {
    for (const View& view : observations.views)
      if (!has_homography(points_of(observations, view)))
        throw std::runtime_error("the corners of '" + view.id + "' are not those of a plane board");
    throw std::runtime_error("no lens can be guessed from the corners");
  }
}

}  // namespace

bool initial_pose(const Observations& observations, const View& view, const LensParameters& p, Pose& pose) {
  Points points = points_of(observations, view);
  for (std::size_t i = 0; i < points.image.size(); ++i) {  // image by a pinhole of focal length 1
    double xy[2];
    if (!unproject(p, view.corners[i].u, view.corners[i].v, xy)) return false;
    points.image[i] = cv::Point2f(static_cast<float>(xy[0]), static_cast<float>(xy[1]));
  }
  cv::Mat turn, shift, rotation;
  try {
    if (!cv::solvePnP(points.board, points.image, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), turn, shift)) return false;
    cv::Rodrigues(turn, rotation);
  } catch (const cv::Exception&) {
    return false;
  }
  for (int i = 0; i < 9; ++i) pose.rotation[static_cast<std::size_t>(i)] = rotation.at<double>(i / 3, i % 3);
  for (int i = 0; i < 3; ++i) pose.translation[static_cast<std::size_t>(i)] = shift.at<double>(i);
  return std::isfinite(shift.at<double>(2)) && shift.at<double>(2) > 0;
}

LensParameters initial_lens(const Observations& observations) {
  std::vector<LensParameters> candidates;
  if (observations.expected) candidates.push_back(*observations.expected);
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> image;
  for (const View& view : observations.views) {
    const Points points = points_of(observations, view);
    board.push_back(points.board);
    image.push_back(points.image);
  }
  const auto width = static_cast<double>(observations.width), height = static_cast<double>(observations.height);
  const auto pinhole = [&](double focal) {
    LensParameters lens{};
    lens[lens::fx] = lens[lens::fy] = focal;
    lens[lens::cx] = (width - 1) / 2;
    lens[lens::cy] = (height - 1) / 2;
    lens[lens::fisheye] = observations.fisheye ? 1 : 0;
    return lens;
  };
  if (observations.fisheye) {  // 80 to 10 deg from the axis to the left edge
    for (const double factor : {0.36, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8}) candidates.push_back(pinhole(factor * width));
  } else {
    const double focal = zhangs(observations, board, image).at<double>(0, 0);
    if (std::isfinite(focal) && focal > 0.2 * width && focal < 50 * width) candidates.push_back(pinhole(focal));
  }
  if (candidates.empty())
    for (const double factor : {0.7, 1.2, 2.0, 4.0}) candidates.push_back(pinhole(factor * width));
  const LensParameters* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const LensParameters& candidate : candidates) {
    const double error = error_of(observations, candidate);
    if (error < least) {
      least = error;
      best = &candidate;
    }
  }
  if (best == nullptr)
    throw std::runtime_error("no lens fits the corners that were found: is the pattern the right one?");
  return *best;
}

}  // namespace tofgraph::calibration
