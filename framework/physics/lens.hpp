// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Lens: OpenCV's distortion model, its inverse, and the table of pixel rays computed from it.
#pragma once

#include <tofgraph/plugin.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>

namespace tofgraph::physics {

/// Point of the image plane at z = 1 in the optical frame (tangents of the ray's angles).
struct ImagePoint {
  double x = 0, y = 0;
};

/// OpenCV's lens model with k1 to k6, p1, p2 and s1 to s4, or its fisheye model (Kannala and Brandt, A generic camera
/// model and calibration method for conventional, wide-angle, and fish-eye lenses, PAMI 2006): an angle theta from the
/// axis is imaged at the radius theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8). Points are on the image
/// plane at z = 1, which limits the angle to 89.9 deg from the axis.
class Lens {
 public:
  Lens() = default;
  /// @param coefficients k1 k2 p1 p2 k3, the order of `tofgraph_camera::distortion`
  explicit Lens(const double (&coefficients)[5]) : Lens(coefficients, none) {}
  /// Constructs the lens of a camera.
  explicit Lens(const tofgraph_camera& camera)
      : Lens(camera.lens_model == TOFGRAPH_LENS_OPENCV ? camera.distortion : no_distortion,
             camera.lens_model == TOFGRAPH_LENS_OPENCV ? camera.further_distortion : none) {
    if (camera.lens_model != TOFGRAPH_LENS_FISHEYE) return;
    fisheye_ = true;
    std::copy_n(camera.distortion, 4, powers_);
    limit_ = max_angle();
  }

  /// Distorted image of the point that a pinhole would image at `p`.
  ImagePoint distort(ImagePoint p) const {
    if (fisheye_) {
      const double r = std::sqrt(p.x * p.x + p.y * p.y), scale = r > 1e-9 ? radius_at(std::atan(r)) / r : 1;
      return {scale * p.x, scale * p.y};
    }
    const double s = p.x * p.x + p.y * p.y;
    const double radial = numerator(s) / denominator(s);
    return {p.x * radial + 2 * p1_ * p.x * p.y + p2_ * (s + 2 * p.x * p.x) + s * (s1_ + s * s2_),
            p.y * radial + p1_ * (s + 2 * p.y * p.y) + 2 * p2_ * p.x * p.y + s * (s3_ + s * s4_)};
  }

  /// Returns true for a point in the domain in which the model can be inverted.
  bool invertible_at(ImagePoint p) const {
    if (fisheye_) return std::atan(std::sqrt(p.x * p.x + p.y * p.y)) < limit_;
    return p.x * p.x + p.y * p.y < limit_ && jacobian(p).determinant() > 0;
  }

  /// Inverse of distort(): Newton steps, shortened where they would leave the domain in which the model can be
  /// inverted (the radius below the first turning point of the radial part, positive Jacobian).
  /// @returns nullopt if the point lies outside the image of that domain, or no solution within 1e-12 was found.
  std::optional<ImagePoint> undistort(ImagePoint distorted) const {
    if (fisheye_) return undistort_fisheye(distorted);
    ImagePoint p{};
    double left = residual(p, distorted);
    constexpr int max_steps = 60;  // a solution on the border of the domain converges only linearly
    for (int i = 0; i < max_steps && left > tolerance; ++i) {
      const Jacobian j = jacobian(p);
      const ImagePoint q = distort(p);
      const ImagePoint miss{distorted.x - q.x, distorted.y - q.y};
      const ImagePoint step{(j.yy * miss.x - j.xy * miss.y) / j.determinant(),
                            (j.xx * miss.y - j.yx * miss.x) / j.determinant()};
      if (!advance(p, step, distorted, left)) return std::nullopt;
    }
    return left <= tolerance ? std::optional(p) : std::nullopt;
  }

 private:
  static constexpr double none[7] = {}, no_distortion[5] = {};

  Lens(const double (&distortion)[5], const double (&further)[7])
      : k1_(distortion[0]),
        k2_(distortion[1]),
        k3_(distortion[4]),
        k4_(further[0]),
        k5_(further[1]),
        k6_(further[2]),
        p1_(distortion[2]),
        p2_(distortion[3]),
        s1_(further[3]),
        s2_(further[4]),
        s3_(further[5]),
        s4_(further[6]),
        limit_(rational() ? first_turning_point_of_quotient() : first_turning_point()) {}

  /// Image radius of an angle from the axis, rad, and its derivative.
  double radius_at(double theta) const {
    const double s = theta * theta;
    return theta * (1 + s * (powers_[0] + s * (powers_[1] + s * (powers_[2] + s * powers_[3]))));
  }
  double radius_slope(double theta) const {
    const double s = theta * theta;
    return 1 + s * (3 * powers_[0] + s * (5 * powers_[1] + s * (7 * powers_[2] + s * 9 * powers_[3])));
  }
  /// Angle up to which the radius increases, searched in steps of 0.1 deg up to 89.9 deg.
  double max_angle() const {
    constexpr double degree = 0.017453292519943295;
    for (int step = 1; step < 900; ++step) {
      const double theta = 0.1 * step * degree;
      if (!(radius_slope(theta) > 0))
        return bisect([this](double t) { return radius_slope(t); }, theta - 0.1 * degree, theta);
    }
    return 89.9 * degree;
  }

  /// Newton steps for the angle, with bisection if they leave the bracketing interval.
  std::optional<ImagePoint> undistort_fisheye(ImagePoint distorted) const {
    const double radius = std::sqrt(distorted.x * distorted.x + distorted.y * distorted.y);
    if (!(radius < radius_at(limit_))) return std::nullopt;
    double low = 0, high = limit_, theta = std::min(radius, limit_);
    for (int i = 0; i < 100; ++i) {
      const double miss = radius_at(theta) - radius;
      if (std::abs(miss) <= tolerance) break;
      (miss < 0 ? low : high) = theta;
      const double next = theta - miss / radius_slope(theta);
      theta = next > low && next < high ? next : 0.5 * (low + high);
    }
    const double scale = radius > 1e-9 ? std::tan(theta) / radius : 1;
    return ImagePoint{scale * distorted.x, scale * distorted.y};
  }

  /// d distort / d(x, y).
  struct Jacobian {
    double xx, xy, yx, yy;
    double determinant() const { return xx * yy - xy * yx; }
  };

  bool rational() const { return k4_ != 0 || k5_ != 0 || k6_ != 0; }
  double numerator(double s) const { return 1 + s * (k1_ + s * (k2_ + s * k3_)); }
  double denominator(double s) const { return 1 + s * (k4_ + s * (k5_ + s * k6_)); }
  /// d (numerator / denominator) / ds
  double slope(double s) const {
    const double above = k1_ + s * (2 * k2_ + s * 3 * k3_), below = k4_ + s * (2 * k5_ + s * 3 * k6_);
    const double d = denominator(s);
    return (above * d - numerator(s) * below) / (d * d);
  }

  static constexpr double tolerance = 1e-12;

  Jacobian jacobian(ImagePoint p) const {
    const double s = p.x * p.x + p.y * p.y;
    const double radial = numerator(s) / denominator(s);
    const double twice = 2 * slope(s);  // d radial / dx = twice * x
    const double prism_x = 2 * s1_ + 4 * s * s2_, prism_y = 2 * s3_ + 4 * s * s4_;
    const double mixed = twice * p.x * p.y + 2 * p1_ * p.x + 2 * p2_ * p.y;
    return {radial + twice * p.x * p.x + 2 * p1_ * p.y + 6 * p2_ * p.x + prism_x * p.x, mixed + prism_x * p.y,
            mixed + prism_y * p.x, radial + twice * p.y * p.y + 6 * p1_ * p.y + 2 * p2_ * p.x + prism_y * p.y};
  }

  double residual(ImagePoint p, ImagePoint distorted) const {
    const ImagePoint q = distort(p);
    const double x = q.x - distorted.x, y = q.y - distorted.y;
    return std::sqrt(x * x + y * y);  // several times as fast as std::hypot; overflow cannot occur here
  }

  /// Takes the full step, or the longest repeatedly halved one that stays in the domain and reduces the error.
  bool advance(ImagePoint& p, ImagePoint step, ImagePoint distorted, double& left) const {
    for (double part = 1; part > 1e-6; part /= 2) {
      const ImagePoint next{p.x + part * step.x, p.y + part * step.y};
      const double next_left = residual(next, distorted);
      if (invertible_at(next) && next_left < left) {
        p = next;
        left = next_left;
        return true;
      }
    }
    return false;
  }

  /// Smallest s = r^2 at which d(r radial(r))/dr = 1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3 is 0; infinity if there is none.
  double first_turning_point() const {
    constexpr double farthest = 1e6;  // s: a thousand focal lengths off the axis, 89.94 deg
    const auto rise = [&](double s) { return 1 + s * (3 * k1_ + s * (5 * k2_ + s * 7 * k3_)); };
    // Between the zeros of the slope's own derivative, 3 k1 + 10 k2 s + 21 k3 s^2, the slope is monotonic.
    double ends[3] = {farthest, farthest, farthest};
    const double a = 21 * k3_, b = 10 * k2_, c = 3 * k1_;
    const double discriminant = b * b - 4 * a * c;
    if (discriminant >= 0) {
      const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
      if (a != 0) ends[0] = q / a;
      if (q != 0) ends[1] = c / q;
    }
    std::sort(std::begin(ends), std::end(ends));
    double low = 0;
    for (const double end : ends) {
      if (!(end > low && end <= farthest)) continue;
      if (rise(end) <= 0) return bisect(rise, low, end);
      low = end;
    }
    return std::numeric_limits<double>::infinity();
  }

  /// The same limit for the rational model, also where its denominator reaches 0. Searched in steps of 1 % up to 89 deg
  /// from the axis.
  double first_turning_point_of_quotient() const {
    constexpr double begin = 1e-6, end = 3300, ratio = 1.01;
    const auto rise = [&](double s) {
      const double d = denominator(s);
      return d > 0 ? numerator(s) / d + 2 * s * slope(s) : -1;
    };
    double low = 0;
    for (double s = begin; s < end; low = s, s *= ratio) {
      if (!(rise(s) > 0)) return bisect(rise, low, s);
    }
    return end;
  }

  template <class Function> static double bisect(const Function& positive_then_negative, double low, double high) {
    for (int i = 0; i < 200 && low < high; ++i) {
      const double middle = 0.5 * (low + high);
      if (middle <= low || middle >= high) break;
      (positive_then_negative(middle) > 0 ? low : high) = middle;
    }
    return low;
  }

  double k1_ = 0, k2_ = 0, k3_ = 0, k4_ = 0, k5_ = 0, k6_ = 0, p1_ = 0, p2_ = 0;
  double s1_ = 0, s2_ = 0, s3_ = 0, s4_ = 0;
  double limit_ = std::numeric_limits<double>::infinity();  ///< square of the radius; for a fisheye the angle, rad
  bool fisheye_ = false;
  double powers_[4] = {};  ///< k1 to k4 of the fisheye
};

/// Image-plane point at a pixel position from a camera's table of rays, bilinear between the pixels; nullopt beyond
/// half a pixel outside the image, and if one of the four rays is unknown or not directed forwards.
inline std::optional<ImagePoint> point_in_table(const tofgraph_camera& camera, double u, double v) {
  const double last_u = camera.width - 1.0, last_v = camera.height - 1.0;
  if (camera.rays == nullptr || camera.width < 2 || camera.height < 2 || !(u >= -0.5) || !(u <= last_u + 0.5) ||
      !(v >= -0.5) || !(v <= last_v + 0.5))
    return std::nullopt;
  const double left = std::clamp(std::floor(u), 0.0, last_u - 1), top = std::clamp(std::floor(v), 0.0, last_v - 1);
  const double a = u - left, b = v - top;
  ImagePoint sum;
  for (const int k : {0, 1, 2, 3}) {
    const double weight = (k % 2 == 0 ? 1 - a : a) * (k < 2 ? 1 - b : b);
    if (weight == 0) continue;
    const auto row = static_cast<std::size_t>(top) + static_cast<std::size_t>(k / 2),
               column = static_cast<std::size_t>(left) + static_cast<std::size_t>(k % 2);
    const float* ray = camera.rays + 3 * (row * camera.width + column);
    if (!(ray[2] > 0)) return std::nullopt;
    sum.x += weight * static_cast<double>(ray[0]) / static_cast<double>(ray[2]);
    sum.y += weight * static_cast<double>(ray[1]) / static_cast<double>(ray[2]);
  }
  return sum;
}

/// Undistorted image-plane point of a pixel position; nullopt outside the domain of the lens model.
/// @param u, v 0-based pixel coordinates; pixel centres are at integers
inline std::optional<ImagePoint> image_point(const tofgraph_camera& camera, const Lens& lens, double u, double v) {
  if (camera.lens_model == TOFGRAPH_LENS_RAYS) return point_in_table(camera, u, v);
  const double y = (v - camera.principal_point[1]) / camera.focal_px[1];
  return lens.undistort({(u - camera.principal_point[0]) / camera.focal_px[0] - camera.skew * y, y});
}

/// Pixel coordinates of a distorted image-plane point, 0-based; the inverse of the first step of image_point().
inline ImagePoint pixel_at(const tofgraph_camera& camera, ImagePoint distorted) {
  return {camera.focal_px[0] * (distorted.x + camera.skew * distorted.y) + camera.principal_point[0],
          camera.focal_px[1] * distorted.y + camera.principal_point[1]};
}

/// Pixel position of a point of the plane at z = 1, the inverse of image_point(): by the lens model, or in a table of
/// rays by Newton steps from the best-fitting pinhole. Nullopt if the point is not imaged.
inline std::optional<ImagePoint> pixel_of(const tofgraph_camera& camera, const Lens& lens, ImagePoint p) {
  if (camera.lens_model != TOFGRAPH_LENS_RAYS)
    return lens.invertible_at(p) ? std::optional(pixel_at(camera, lens.distort(p))) : std::nullopt;
  const auto inside = [&camera](ImagePoint q) {
    return ImagePoint{std::clamp(q.x, 0.0, camera.width - 1.0), std::clamp(q.y, 0.0, camera.height - 1.0)};
  };
  ImagePoint at = pixel_at(camera, p);
  for (int i = 0; i < 30; ++i) {
    const ImagePoint from = inside(at);
    const double du = from.x < camera.width - 1.0 ? 0.5 : -0.5, dv = from.y < camera.height - 1.0 ? 0.5 : -0.5;
    const auto here = point_in_table(camera, from.x, from.y), right = point_in_table(camera, from.x + du, from.y),
               below = point_in_table(camera, from.x, from.y + dv);
    if (!here || !right || !below) return std::nullopt;
    const double xu = (right->x - here->x) / du, yu = (right->y - here->y) / du, xv = (below->x - here->x) / dv,
                 yv = (below->y - here->y) / dv, determinant = xu * yv - xv * yu;
    if (!(determinant > 0)) return std::nullopt;
    const double x = p.x - here->x, y = p.y - here->y;
    const ImagePoint step{(yv * x - xv * y) / determinant, (xu * y - yu * x) / determinant};
    at = {from.x + step.x, from.y + step.y};
    if (std::abs(step.x) + std::abs(step.y) < 1e-9) return at;
  }
  const bool outside = at.x < 0 || at.y < 0 || at.x > camera.width - 1.0 || at.y > camera.height - 1.0;
  return outside ? std::optional(at) : std::nullopt;
}

/// Ray of each pixel: needs focal_px, principal_point, skew and distortion of the camera, no lengths in metres.
/// @param rays out: height x width x 3, unit vectors in the optical frame (x right, y down, z forward); NaN where
///        the lens model cannot be inverted, and everywhere if focal_px or principal_point is unknown
inline void pixel_rays(const tofgraph_camera& camera, float* rays) {
  const Lens lens(camera);
  for (std::uint32_t v = 0; v < camera.height; ++v) {
    for (std::uint32_t u = 0; u < camera.width; ++u, rays += 3) {
      const std::optional<ImagePoint> p = image_point(camera, lens, u, v);
      if (!p) {
        std::fill(rays, rays + 3, std::numeric_limits<float>::quiet_NaN());
        continue;
      }
      const double norm = std::sqrt(p->x * p->x + p->y * p->y + 1);
      rays[0] = static_cast<float>(p->x / norm);
      rays[1] = static_cast<float>(p->y / norm);
      rays[2] = static_cast<float>(1 / norm);
    }
  }
}

}  // namespace tofgraph::physics
