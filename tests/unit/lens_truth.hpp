// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Independent implementation of a camera, a board and views of it: the ground truth for lens calibrations.
/// Shares no formula with the tested code; only the observation structs come from calibration/bundle.hpp.
#pragma once

#include "calibration/bundle.hpp"

#include <Eigen/Dense>

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace test {

/// A lens of a 204 x 204 camera of 40 um pixels. Lengths of the board in m, of the image in px.
struct TrueLens {
  double fx = 316.75, fy = 317.4, cx = 101.3, cy = 102.4;
  double k1 = -0.44, k2 = 0.22, p1 = 0.002, p2 = -0.005, k3 = 0, k4 = 0;
  bool fisheye = false;  ///< equidistant: r = f theta (1 + k1 theta^2), everything else unchanged

  Eigen::Vector2d image(const Eigen::Vector3d& point) const {
    const double x = point.x() / point.z(), y = point.y() / point.z(), r = std::hypot(x, y);
    if (fisheye) {
      const double theta = std::atan(r), stretch = r > 1e-12 ? theta * (1 + k1 * theta * theta) / r : 1;
      return {fx * x * stretch + cx, fy * y * stretch + cy};
    }
    const double r2 = r * r;
    const double radial = 1 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2 + k4 * r2 * r2 * r2 * r2;
    const double u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
    const double v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
    return {fx * u + cx, fy * v + cy};
  }
};

struct TruePose {
  Eigen::Vector3d turn;   ///< rotation vector, rad
  Eigen::Vector3d place;  ///< m, of the board's centre

  Eigen::Vector3d camera(const Eigen::Vector3d& board) const {
    const double angle = turn.norm();
    return angle > 0 ? Eigen::Vector3d(Eigen::AngleAxisd(angle, turn / angle) * board + place)
                     : Eigen::Vector3d(board + place);
  }
};

struct TrueBoard {
  int columns = 8, rows = 6;
  double square = 0.03;
  double sag = 0;  ///< m: bent into a cylinder about the y axis, the edge columns this far behind the centre

  std::vector<tofgraph::calibration::BoardPoint> points() const {
    std::vector<tofgraph::calibration::BoardPoint> list;
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c)
        list.push_back({(c - (columns - 1) / 2.0) * square, (r - (rows - 1) / 2.0) * square});
    return list;
  }
  Eigen::Vector3d bent(double x, double y) const {
    if (sag == 0) return {x, y, 0};
    const double half = (columns - 1) / 2.0 * square, radius = half * half / (2 * sag);
    return {radius * std::sin(x / radius), y, radius * (1 - std::cos(x / radius))};
  }
};

/// Views as taken by a careful user: distances at which the board fills half to all of the image, tilts up to 40 deg,
/// in the centre and towards the corners. All corners are inside the image.
inline std::vector<TruePose> true_poses(const TrueLens& lens, const TrueBoard& board, std::size_t count,
                                        unsigned seed = 7) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<TruePose> poses;
  while (poses.size() < count) {
    TruePose pose;
    const double near = lens.fx / 316.75;  // a wider lens needs a shorter distance
    const double tilt = uniform(0.15, 0.75), about = uniform(0, 2 * M_PI), distance = uniform(0.5, 1.1) * near;
    pose.turn = {tilt * std::cos(about), tilt * std::sin(about), uniform(-0.2, 0.2)};
    pose.place = {uniform(-0.2, 0.2) * distance / near, uniform(-0.2, 0.2) * distance / near, distance};
    bool inside = true;
    for (const auto& p : board.points()) {
      const Eigen::Vector2d pixel = lens.image(pose.camera(board.bent(p.x, p.y)));
      inside &= pixel.minCoeff() > 3 && pixel.maxCoeff() < 200;
    }
    if (inside) poses.push_back(pose);
  }
  return poses;
}

struct TrueScene {
  TrueLens lens;
  TrueBoard board;
  std::vector<TruePose> poses;

  /// Observations with white noise of this standard deviation.
  tofgraph::calibration::Observations observed(double noise, unsigned seed) const {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, noise);
    tofgraph::calibration::Observations seen{.width = 204, .height = 204, .points = board.points()};
    for (std::size_t i = 0; i < poses.size(); ++i) {
      tofgraph::calibration::View view{.id = "view" + std::to_string(i)};
      for (std::size_t k = 0; k < seen.points.size(); ++k) {
        const auto& p = seen.points[k];
        const Eigen::Vector2d pixel = lens.image(poses[i].camera(board.bent(p.x, p.y)));
        view.corners.push_back(
            {k, pixel.x() + normal(random), pixel.y() + normal(random), {noise * noise, 0, noise * noise}});
      }
      seen.views.push_back(view);
    }
    return seen;
  }

  /// Cramer-Rao bound of (fx fy cx cy k1 k2 p1 p2) for this corner noise, with unknown poses and, if requested, unknown
  /// quadratic warp of the board: inverse of the Fisher information, derivatives by finite differences.
  Eigen::MatrixXd bound(double noise, bool with_warp) const {
    const std::size_t shared = with_warp ? 11 : 8, unknowns = shared + 6 * poses.size();
    const auto points = board.points();
    const double hx = std::abs(points.front().x), hy = std::abs(points.front().y);
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(Eigen::Index(unknowns), Eigen::Index(unknowns));
    for (std::size_t v = 0; v < poses.size(); ++v) {
      for (const auto& p : points) {
        const auto image = [&](const Eigen::VectorXd& d) {
          TrueLens l = lens;
          double* const values[] = {&l.fx, &l.fy, &l.cx, &l.cy, &l.k1, &l.k2, &l.p1, &l.p2};
          for (int i = 0; i < 8; ++i) *values[i] += d[i];
          Eigen::Vector3d at = board.bent(p.x, p.y);
          const double a = p.x / hx, b = p.y / hy;
          at.z() += d[8] * a * a + d[9] * b * b + d[10] * a * b;
          TruePose pose = poses[v];
          pose.turn += d.segment<3>(11);
          pose.place += d.segment<3>(14);
          return l.image(pose.camera(at));
        };
        Eigen::MatrixXd jacobian(2, 17);
        for (int i = 0; i < 17; ++i) {
          const double step = i < 4 ? 1e-3 : 1e-6;
          Eigen::VectorXd d = Eigen::VectorXd::Zero(17);
          d[i] = step;
          const Eigen::Vector2d above = image(d);
          d[i] = -step;
          jacobian.col(i) = (above - image(d)) / (2 * step);
        }
        std::vector<Eigen::Index> place;
        for (std::size_t i = 0; i < shared; ++i) place.push_back(Eigen::Index(i));
        for (std::size_t i = 0; i < 6; ++i) place.push_back(Eigen::Index(shared + 6 * v + i));
        for (std::size_t i = 0; i < place.size(); ++i)
          for (std::size_t k = 0; k < place.size(); ++k) {
            const auto ji = Eigen::Index(i < shared ? i : 11 + i - shared);
            const auto jk = Eigen::Index(k < shared ? k : 11 + k - shared);
            information(place[i], place[k]) += jacobian.col(ji).dot(jacobian.col(jk)) / (noise * noise);
          }
      }
    }
    return information.inverse().topLeftCorner(8, 8);
  }
};

}  // namespace test
