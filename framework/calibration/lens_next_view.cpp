// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Next view that reduces the projection uncertainty most.
#include "calibration/lens_linearisation.hpp"
#include "calibration/lens_validation.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace tofgraph::calibration {
namespace {

constexpr double margin = 3;         ///< px, from the board to the image border
constexpr double min_spacing = 6;    ///< px between corners; the detector needs 4
constexpr double min_facing = 0.64;  ///< cosine between a ray and the normal of the board: 50 deg

bool is_inside(const Observations& o, const Eigen::Vector2d& pixel) {
  return pixel.minCoeff() > margin && pixel.x() < static_cast<double>(o.width) - 1 - margin &&
         pixel.y() < static_cast<double>(o.height) - 1 - margin;
}

/// Returns true if points are far enough apart to be distinguished from their neighbours.
bool are_apart(const std::vector<Eigen::Vector2d>& pixels) {
  for (std::size_t i = 0; i < pixels.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if ((pixels[i] - pixels[k]).norm() < min_spacing) return false;
  return true;
}

/// Returns true if the board is in the image with the squares around its points, which detectors need.
bool is_whole(const Observations& observations, const LensSolution& solution, const Pose& pose) {
  double square = 1e9, x = 0, y = 0;
  for (const BoardPoint& p : observations.points) {
    const BoardPoint& first = observations.points.front();
    if (&p != &first) square = std::min(square, std::hypot(p.x - first.x, p.y - first.y));
    x = std::max(x, std::abs(p.x));
    y = std::max(y, std::abs(p.y));
  }
  for (const double along : {-1.0, 0.0, 1.0}) {
    for (const double across : {-1.0, 0.0, 1.0}) {
      PointDerivatives d;
      const BoardPoint outer{along * (x + square), across * (y + square)};
      if (!derivatives_of(solution, pose, outer, {}, d) || !is_inside(observations, d.pixel)) return false;
    }
  }
  return true;
}

/// Returns true if a point of the board is seen from the front, neither at a grazing angle nor from behind.
bool faces_camera(const Pose& pose, const BoardPoint& point) {
  const auto& r = pose.rotation;
  const auto& t = pose.translation;
  const Eigen::Vector3d normal(r[2], r[5], r[8]);
  const Eigen::Vector3d at(r[0] * point.x + r[1] * point.y + t[0], r[3] * point.x + r[4] * point.y + t[1],
                           r[6] * point.x + r[7] * point.y + t[2]);
  return normal.dot(at) > min_facing * at.norm();
}

/// Information of a view at this pose on lens and warp, with unknown pose. Empty if the pattern would not be found.
Eigen::MatrixXd information_of(const Observations& observations, const LensSolution& solution, const Pose& pose,
                               double corner_sd) {
  const auto shared = static_cast<Eigen::Index>(solution.layout.lens.size() + solution.layout.warp);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(shared, shared), across = Eigen::MatrixXd::Zero(shared, 6);
  Eigen::Matrix<double, 6, 6> own = Eigen::Matrix<double, 6, 6>::Zero();
  if (!is_whole(observations, solution, pose)) return {};
  std::vector<Eigen::Vector2d> pixels;
  for (const BoardPoint& point : observations.points) {
    PointDerivatives d;
    if (!faces_camera(pose, point) || !derivatives_of(solution, pose, point, warp_basis(observations, point), d))
      return {};
    pixels.push_back(d.pixel);
    gram += d.shared.transpose() * d.shared;
    across += d.shared.transpose() * d.pose;
    own += d.pose.transpose() * d.pose;
  }
  if (!are_apart(pixels)) return {};
  return (gram - across * own.ldlt().solve(across.transpose())) / (corner_sd * corner_sd);
}

/// Feasible poses: near and far, at the centre and towards the corners, tilted about either axis.
struct Candidate {
  std::array<double, 2> tilt, pixel;
  Pose pose;
};

std::vector<Candidate> candidates(const Observations& o, const LensSolution& solution) {
  double extent = 0;
  for (const BoardPoint& p : o.points) extent = std::max({extent, 2 * std::abs(p.x), 2 * std::abs(p.y)});
  std::vector<Candidate> list;
  const auto width = static_cast<double>(o.width), height = static_cast<double>(o.height);
  for (const double share : {0.35, 0.5, 0.65, 0.8}) {
    const double distance = extent * solution.lens[lens::fx] / (share * width);
    for (const double tilt_x : {-40.0, -25.0, 0.0, 25.0, 40.0}) {
      for (const double tilt_y : {-40.0, -25.0, 0.0, 25.0, 40.0}) {
        for (const double h : {0.25, 0.5, 0.75}) {
          for (const double v : {0.25, 0.5, 0.75}) {
            Candidate c{{tilt_x * M_PI / 180, tilt_y * M_PI / 180}, {h * (width - 1), v * (height - 1)}, {}};
            double xy[2];
            if (!unproject(solution.lens, c.pixel[0], c.pixel[1], xy)) continue;
            Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(c.pose.rotation.data()) =
                (Eigen::AngleAxisd(c.tilt[1], Eigen::Vector3d::UnitY()) *
                 Eigen::AngleAxisd(c.tilt[0], Eigen::Vector3d::UnitX()))
                    .toRotationMatrix();
            c.pose.translation = {xy[0] * distance, xy[1] * distance, distance};
            list.push_back(c);
          }
        }
      }
    }
  }
  return list;
}

}  // namespace

NextView suggest_view(const Observations& observations, const LensSolution& solution) {
  NextView best;
  const auto shared = static_cast<Eigen::Index>(solution.layout.lens.size() + solution.layout.warp);
  const double range = typical_range(solution);
  const ProjectionUncertainty uncertainty(solution);
  std::vector<Eigen::MatrixXd> along;  // covariance of image positions with lens and warp
  double before = 0;
  for (const double v : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    for (const double u : {0.1, 0.3, 0.5, 0.7, 0.9}) {
      const auto j = uncertainty.jacobian(u * static_cast<double>(observations.width),
                                          v * static_cast<double>(observations.height), range);
      if (!j) continue;
      before += (*j * solution.covariance * j->transpose()).trace() / 2;
      along.emplace_back(*j * solution.covariance.leftCols(shared));
    }
  }
  if (along.empty()) return best;
  const Eigen::MatrixXd own = solution.covariance.topLeftCorner(shared, shared);
  double after = before;
  for (const Candidate& c : candidates(observations, solution)) {
    const Eigen::MatrixXd information = information_of(observations, solution, c.pose, solution.rms);
    if (information.size() == 0) continue;
    // Woodbury: subtracts (own + 1 / information)^-1, projected by the covariance with the shared parameters.
    const Eigen::MatrixXd gain =
        (Eigen::MatrixXd::Identity(shared, shared) + information * own).fullPivLu().solve(information);
    double reduced = before;
    for (const Eigen::MatrixXd& a : along) reduced -= (a * gain * a.transpose()).trace() / 2;
    if (reduced >= after) continue;
    after = reduced;
    best = {.found = true, .tilt = c.tilt, .centre = c.pose.translation, .pixel = c.pixel};
  }
  best.before = std::sqrt(before / static_cast<double>(along.size()));
  best.after = std::sqrt(std::max(after, 0.0) / static_cast<double>(along.size()));
  return best;
}

}  // namespace tofgraph::calibration
