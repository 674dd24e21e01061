// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Lens with fitted parameters: OpenCV's model with its rational terms and a skew, or OpenCV's fisheye model
/// (Kannala and Brandt, PAMI 2006), for numbers and for automatic differentiation.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace tofgraph::calibration {

/// Indices of the parameters. Focal lengths and principal point in px, the others without unit. `fisheye` is never
/// fitted: 1 selects the fisheye model, of which k1 to k4 are the four coefficients.
namespace lens {
enum Parameter : std::size_t { fx, fy, cx, cy, k1, k2, p1, p2, k3, skew, k4, k5, k6, fisheye, count };
inline constexpr std::array<const char*, count> names = {"fx", "fy", "cx",   "cy", "k1", "k2", "p1",
                                                         "p2", "k3", "skew", "k4", "k5", "k6", "fisheye"};
inline constexpr std::array<Parameter, 4> fisheye_powers = {k1, k2, k3, k4};
}  // namespace lens
using LensParameters = std::array<double, lens::count>;

/// Image radius of a fisheye relative to that of a pinhole. @param s square of the latter
template <class T, class P> T fisheye_radial(const P* p, const T& s) {
  using std::atan, std::sqrt;
  if (s < 1e-12) return 1.0 + s * (p[lens::k1] - 1.0 / 3);  // atan(r) / r = 1 - r^2 / 3 + ...
  const T r = sqrt(s), theta = atan(r), t = theta * theta;
  return theta * (1.0 + t * (p[lens::k1] + t * (p[lens::k2] + t * (p[lens::k3] + t * p[lens::k4])))) / r;
}

/// Image of a point of the plane z = 1 by the lens, in px: OpenCV's distortion (1 + k1 s + k2 s^2 + k3 s^3) / (1
/// + k4 s + k5 s^2 + k6 s^3) with its tangential part, s = x^2 + y^2, then u = fx (x + skew y) + cx, v = fy y +
/// cy. A fisheye images the angle theta = atan(sqrt(s)) at the radius theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 +
/// k4 theta^8).
template <class T, class P> void project_plane(const P* p, const T& x, const T& y, T* pixel) {
  const T s = x * x + y * y;
  const T radial = p[lens::fisheye] > 0.5 ? fisheye_radial<T>(p, s)
                                          : T((1.0 + s * (p[lens::k1] + s * (p[lens::k2] + s * p[lens::k3]))) /
                                              (1.0 + s * (p[lens::k4] + s * (p[lens::k5] + s * p[lens::k6]))));
  const T xd = x * radial + 2.0 * p[lens::p1] * x * y + p[lens::p2] * (s + 2.0 * x * x);
  const T yd = y * radial + p[lens::p1] * (s + 2.0 * y * y) + 2.0 * p[lens::p2] * x * y;
  pixel[0] = p[lens::fx] * (xd + p[lens::skew] * yd) + p[lens::cx];
  pixel[1] = p[lens::fy] * yd + p[lens::cy];
}

/// Image of a point in the camera's optical frame, in px.
template <class T> void project(const T* p, const T* point, T* pixel) {
  project_plane<T>(p, point[0] / point[2], point[1] / point[2], pixel);
}

/// d pixel / d (x, y) of project_plane, row-major.
std::array<double, 4> plane_jacobian(const LensParameters& p, double x, double y);

/// d pixel / d parameters of project_plane: for u, then for v.
std::array<LensParameters, 2> lens_jacobian(const LensParameters& p, double x, double y);

/// Inverse of project_plane by Newton's method. @returns false if it does not converge
bool unproject(const LensParameters& p, double u, double v, double* xy);

}  // namespace tofgraph::calibration
