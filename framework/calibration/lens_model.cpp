// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/lens_model.hpp"

#include <algorithm>
#include <utility>

namespace tofgraph::calibration {
namespace {

/// As std::hypot, which spends time on numbers that no ray has.
double length_of(double x, double y) { return std::sqrt(x * x + y * y); }

}  // namespace

std::array<double, 4> plane_jacobian(const LensParameters& p, double x, double y) {
  const double s = x * x + y * y;
  const double top = 1 + s * (p[lens::k1] + s * (p[lens::k2] + s * p[lens::k3]));
  const double bottom = 1 + s * (p[lens::k4] + s * (p[lens::k5] + s * p[lens::k6]));
  const double top_slope = p[lens::k1] + s * (2 * p[lens::k2] + s * 3 * p[lens::k3]);
  const double bottom_slope = p[lens::k4] + s * (2 * p[lens::k5] + s * 3 * p[lens::k6]);
  const double radial = top / bottom, slope = 2 * (top_slope - radial * bottom_slope) / bottom;
  const double mixed = slope * x * y + 2 * p[lens::p1] * x + 2 * p[lens::p2] * y;
  const double xx = radial + slope * x * x + 2 * p[lens::p1] * y + 6 * p[lens::p2] * x;
  const double yy = radial + slope * y * y + 6 * p[lens::p1] * y + 2 * p[lens::p2] * x;
  return {p[lens::fx] * (xx + p[lens::skew] * mixed), p[lens::fx] * (mixed + p[lens::skew] * yy), p[lens::fy] * mixed,
          p[lens::fy] * yy};
}

std::array<LensParameters, 2> lens_jacobian(const LensParameters& p, double x, double y) {
  const double s = x * x + y * y;
  const double bottom = 1 + s * (p[lens::k4] + s * (p[lens::k5] + s * p[lens::k6]));
  const double radial = (1 + s * (p[lens::k1] + s * (p[lens::k2] + s * p[lens::k3]))) / bottom;
  const double along_x = s + 2 * x * x, along_y = s + 2 * y * y, mixed = 2 * x * y;
  const double xd = x * radial + p[lens::p1] * mixed + p[lens::p2] * along_x;
  const double yd = y * radial + p[lens::p1] * along_y + p[lens::p2] * mixed;
  const double u_radial = p[lens::fx] * (x + p[lens::skew] * y) / bottom, v_radial = p[lens::fy] * y / bottom;
  std::array<LensParameters, 2> result{};
  LensParameters &u = result[0], &v = result[1];
  u[lens::fx] = xd + p[lens::skew] * yd;
  v[lens::fy] = yd;
  u[lens::cx] = v[lens::cy] = 1;
  u[lens::skew] = p[lens::fx] * yd;
  u[lens::p1] = p[lens::fx] * (mixed + p[lens::skew] * along_y);
  u[lens::p2] = p[lens::fx] * (along_x + p[lens::skew] * mixed);
  v[lens::p1] = p[lens::fy] * along_y;
  v[lens::p2] = p[lens::fy] * mixed;
  double power = s;
  for (const auto& [above, below] : {std::pair{lens::k1, lens::k4}, {lens::k2, lens::k5}, {lens::k3, lens::k6}}) {
    u[above] = u_radial * power;
    u[below] = -radial * u_radial * power;
    v[above] = v_radial * power;
    v[below] = -radial * v_radial * power;
    power *= s;
  }
  return result;
}

bool unproject(const LensParameters& p, double u, double v, double* xy) {
  double yd = (v - p[lens::cy]) / p[lens::fy];
  double x = (u - p[lens::cx]) / p[lens::fx] - p[lens::skew] * yd, y = yd;
  const double limit = 1.5 * length_of(x, y) + 0.5;
  for (int step = 0; step < 50; ++step) {
    double pixel[2];
    project_plane<double>(p.data(), x, y, pixel);
    const std::array<double, 4> j = plane_jacobian(p, x, y);
    const double determinant = j[0] * j[3] - j[1] * j[2];
    if (!(determinant > 0)) return false;
    const double du = u - pixel[0], dv = v - pixel[1];
    double dx = (j[3] * du - j[1] * dv) / determinant, dy = (j[0] * dv - j[2] * du) / determinant;
    const double length = length_of(dx, dy);
    const double part = std::min(1.0, 0.2 / std::max(length, 1e-300));  // a long step may leave the model's domain
    x += part * dx;
    y += part * dy;
    if (!(length_of(x, y) < limit)) return false;
    if (length < 1e-13) {
      xy[0] = x;
      xy[1] = y;
      return true;
    }
  }
  return false;
}

}  // namespace tofgraph::calibration
