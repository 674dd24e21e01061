// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/lens_model.hpp"

#include <algorithm>
#include <utility>

namespace tofgraph::calibration {
namespace {

/// Like std::hypot, without its handling of extreme values.
double length_of(double x, double y) { return std::sqrt(x * x + y * y); }

bool is_fisheye(const LensParameters& p) { return p[lens::fisheye] > 0.5; }

/// Factor of a point's radius, and twice its derivative with respect to s = x^2 + y^2.
struct Radial {
  double factor, slope;
};

Radial perspective_radial(const LensParameters& p, double s) {
  const double top = 1 + s * (p[lens::k1] + s * (p[lens::k2] + s * p[lens::k3]));
  const double bottom = 1 + s * (p[lens::k4] + s * (p[lens::k5] + s * p[lens::k6]));
  const double top_slope = p[lens::k1] + s * (2 * p[lens::k2] + s * 3 * p[lens::k3]);
  const double bottom_slope = p[lens::k4] + s * (2 * p[lens::k5] + s * 3 * p[lens::k6]);
  const double radial = top / bottom;
  return {radial, 2 * (top_slope - radial * bottom_slope) / bottom};
}

/// Image radius of an angle from the axis, and its derivative.
std::pair<double, double> fisheye_radius(const LensParameters& p, double theta) {
  const double t = theta * theta;
  double radius = theta, slope = 1, power = t;
  for (std::size_t i = 0; i < lens::fisheye_powers.size(); ++i, power *= t) {
    const double k = p[lens::fisheye_powers[i]];
    radius += k * power * theta;
    slope += static_cast<double>(2 * i + 3) * k * power;
  }
  return {radius, slope};
}

Radial radial_of(const LensParameters& p, double s) {
  if (!is_fisheye(p)) return perspective_radial(p, s);
  const double factor = fisheye_radial<double>(p.data(), s);
  if (s < 1e-8) return {factor, 2 * (p[lens::k1] - 1.0 / 3)};
  return {factor, (fisheye_radius(p, std::atan(std::sqrt(s))).second / (1 + s) - factor) / s};
}

bool unproject_fisheye(const LensParameters& p, double x, double y, double* xy) {
  const double radius = length_of(x, y);
  double theta = std::min(radius, 1.5);
  for (int step = 0; step < 50; ++step) {
    const auto [at, slope] = fisheye_radius(p, theta);
    if (!(slope > 0)) return false;
    const double change = std::clamp((radius - at) / slope, -0.2, 0.2);
    theta += change;
    if (!(theta >= 0 && theta < M_PI / 2)) return false;
    if (std::abs(change) > 1e-13) continue;
    const double scale = radius > 1e-9 ? std::tan(theta) / radius : 1;
    xy[0] = scale * x;
    xy[1] = scale * y;
    return true;
  }
  return false;
}

}  // namespace

std::array<double, 4> plane_jacobian(const LensParameters& p, double x, double y) {
  const auto [radial, slope] = radial_of(p, x * x + y * y);
  const double mixed = slope * x * y + 2 * p[lens::p1] * x + 2 * p[lens::p2] * y;
  const double xx = radial + slope * x * x + 2 * p[lens::p1] * y + 6 * p[lens::p2] * x;
  const double yy = radial + slope * y * y + 6 * p[lens::p1] * y + 2 * p[lens::p2] * x;
  return {p[lens::fx] * (xx + p[lens::skew] * mixed), p[lens::fx] * (mixed + p[lens::skew] * yy), p[lens::fy] * mixed,
          p[lens::fy] * yy};
}

std::array<LensParameters, 2> lens_jacobian(const LensParameters& p, double x, double y) {
  const double s = x * x + y * y;
  const double radial = radial_of(p, s).factor;
  const double along_x = s + 2 * x * x, along_y = s + 2 * y * y, mixed = 2 * x * y;
  const double xd = x * radial + p[lens::p1] * mixed + p[lens::p2] * along_x;
  const double yd = y * radial + p[lens::p1] * along_y + p[lens::p2] * mixed;
  const double u_radial = p[lens::fx] * (x + p[lens::skew] * y), v_radial = p[lens::fy] * y;
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
  const auto set = [&](lens::Parameter parameter, double factor) {  // d radial / d parameter
    u[parameter] = u_radial * factor;
    v[parameter] = v_radial * factor;
  };
  if (is_fisheye(p)) {
    const double r = std::sqrt(s), theta = std::atan(r), t = theta * theta;
    double factor = r > 1e-9 ? theta / r : 1;
    for (const lens::Parameter k : lens::fisheye_powers) set(k, factor *= t);
    return result;
  }
  double factor = 1 / (1 + s * (p[lens::k4] + s * (p[lens::k5] + s * p[lens::k6])));
  for (const auto& [above, below] : {std::pair{lens::k1, lens::k4}, {lens::k2, lens::k5}, {lens::k3, lens::k6}}) {
    factor *= s;
    set(above, factor);
    set(below, -radial * factor);
  }
  return result;
}

bool unproject(const LensParameters& p, double u, double v, double* xy) {
  double yd = (v - p[lens::cy]) / p[lens::fy];
  double x = (u - p[lens::cx]) / p[lens::fx] - p[lens::skew] * yd, y = yd;
  if (is_fisheye(p)) return unproject_fisheye(p, x, y, xy);
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
    const double part = std::min(1.0, 0.2 / std::max(length, 1e-300));  // a long step may leave the domain
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
