// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The lens: OpenCV's model of distortion, its inverse, and the table of pixel rays that follows from it.
#pragma once

#include <tofgraph/plugin.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>

namespace tofgraph::physics {

/// A point of the image plane at z = 1 in the optical frame (tangents of the ray's angles).
struct ImagePoint {
  double x = 0, y = 0;
};

/// OpenCV's lens model with k1 to k6, p1, p2 and s1 to s4, on points of the image plane at z = 1.
class Lens {
 public:
  Lens() = default;
  /// @param coefficients k1 k2 p1 p2 k3, the order of `tofgraph_camera::distortion`
  explicit Lens(const double (&coefficients)[5]) : Lens(coefficients, none) {}
  /// The lens of a camera.
  explicit Lens(const tofgraph_camera& camera) : Lens(camera.distortion, camera.further_distortion) {}

  /// Image of a point by the lens that a pinhole would image at `p`.
  ImagePoint distort(ImagePoint p) const {
    const double s = p.x * p.x + p.y * p.y;
    const double radial = numerator(s) / denominator(s);
    return {p.x * radial + 2 * p1_ * p.x * p.y + p2_ * (s + 2 * p.x * p.x) + s * (s1_ + s * s2_),
            p.y * radial + p1_ * (s + 2 * p.y * p.y) + 2 * p2_ * p.x * p.y + s * (s3_ + s * s4_)};
  }

  /// Returns whether a point is in the domain in which the model can be inverted.
  bool invertible_at(ImagePoint p) const { return p.x * p.x + p.y * p.y < limit_ && jacobian(p).determinant() > 0; }

  /// The inverse of distort(): Newton steps, shortened where they would leave the domain in which the model can be
  /// inverted (the radius below the first turning point of the radial part, positive Jacobian).
  /// @returns nothing when the point lies outside the image of that domain, or no solution within 1e-12 was found.
  std::optional<ImagePoint> undistort(ImagePoint distorted) const {
    ImagePoint p{};
    double left = residual(p, distorted);
    constexpr int max_steps = 60;  // a solution on the border of the domain converges linearly only
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
  static constexpr double none[7] = {};

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
    return std::sqrt(x * x + y * y);  // several times as fast as std::hypot, and nothing here is near an overflow
  }

  /// Goes the whole step, or the largest of its halves that stays in the domain and comes nearer.
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

  /// The least s = r^2 at which d(r radial(r))/dr = 1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3 is 0; else infinity.
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

  /// The same for the rational model; also where its denominator turns 0. Looked for in steps of 1 % up to 89 deg off
  /// the axis.
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
  double limit_ = std::numeric_limits<double>::infinity();  ///< square of the radius
};

/// The undistorted image point of a pixel; nothing outside the lens model.
/// @param u, v 0-based pixel coordinates, a pixel's centre at integers
inline std::optional<ImagePoint> image_point(const tofgraph_camera& camera, const Lens& lens, double u, double v) {
  const double y = (v - camera.principal_point[1]) / camera.focal_px[1];
  return lens.undistort({(u - camera.principal_point[0]) / camera.focal_px[0] - camera.skew * y, y});
}

/// The pixel coordinates of a distorted image point, 0-based; the inverse of the first step of image_point().
inline ImagePoint pixel_at(const tofgraph_camera& camera, ImagePoint distorted) {
  return {camera.focal_px[0] * (distorted.x + camera.skew * distorted.y) + camera.principal_point[0],
          camera.focal_px[1] * distorted.y + camera.principal_point[1]};
}

/// The ray of each pixel: needs focal_px, principal_point, skew and distortion of the camera, no lengths in metres.
/// @param rays out: height x width x 3, unit vectors in the optical frame (x right, y down, z forward); NaN where
///        the lens model cannot be inverted, everywhere when focal_px or principal_point are not known
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
