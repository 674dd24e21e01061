// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// For tests of denoisers: their equations (reference, section 8) word by word in double precision, and the pallet of
/// boxes that the reference judges them by, cast ray by ray.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace test {

/// NaN: invalid, and so is everything outside.
struct Image {
  std::ptrdiff_t rows, columns;
  std::vector<float> values;

  Image(std::ptrdiff_t r, std::ptrdiff_t c) : rows(r), columns(c), values(static_cast<std::size_t>(r * c)) {}
  float& operator()(std::ptrdiff_t r, std::ptrdiff_t c) { return values[static_cast<std::size_t>(r * columns + c)]; }
  double at(std::ptrdiff_t r, std::ptrdiff_t c) const {
    const bool inside = r >= 0 && c >= 0 && r < rows && c < columns;
    return inside ? values[static_cast<std::size_t>(r * columns + c)] : std::nan("");
  }
  bool valid(std::ptrdiff_t r, std::ptrdiff_t c) const { return !std::isnan(at(r, c)); }
};

/// The filtered image, and the deviation of each pixel for independent noise `sigma`; NaN where invalid.
struct Denoised {
  std::vector<double> values, sigma;
};

/// weight(r, c, dy, dx): of the valid pixel at (dy, dx) from the valid pixel (r, c).
using Weight = std::function<double(std::ptrdiff_t, std::ptrdiff_t, std::ptrdiff_t, std::ptrdiff_t)>;

inline Denoised averaged(const Image& u, const Image& sigma, int side, const Weight& weight) {
  Denoised result;
  const std::ptrdiff_t radius = side / 2;
  for (std::ptrdiff_t r = 0; r < u.rows; ++r) {
    for (std::ptrdiff_t c = 0; c < u.columns; ++c) {
      double sum = 0, weights = 0, variance = 0;
      for (std::ptrdiff_t dy = -radius; dy <= radius; ++dy) {
        for (std::ptrdiff_t dx = -radius; dx <= radius; ++dx) {
          if (!u.valid(r, c) || !u.valid(r + dy, c + dx)) continue;
          const double w = weight(r, c, dy, dx), s = w * sigma.at(r + dy, c + dx);
          sum += w * u.at(r + dy, c + dx);
          weights += w;
          variance += s * s;
        }
      }
      result.values.push_back(u.valid(r, c) ? sum / weights : std::nan(""));
      result.sigma.push_back(u.valid(r, c) ? std::sqrt(variance) / weights : std::nan(""));
    }
  }
  return result;
}

/// (7.1), (7.3) and (7.7); h(r, c): the strength at a pixel, m.
using Strength = std::function<double(std::ptrdiff_t, std::ptrdiff_t)>;

inline Weight yaroslavsky_weight(const Image& u, const Strength& h) {
  return [&u, h](auto r, auto c, auto dy, auto dx) {
    const double d = (u.at(r, c) - u.at(r + dy, c + dx)) / h(r, c);
    return std::exp(-d * d);
  };
}

inline Weight bilateral_weight(const Image& u, const Strength& h, double rho) {
  return [near = yaroslavsky_weight(u, h), rho](auto r, auto c, auto dy, auto dx) {
    return near(r, c, dy, dx) * std::exp(-static_cast<double>(dy * dy + dx * dx) / (rho * rho));
  };
}

/// @param a of the patch's Gaussian in pixels, infinite: all count alike
inline Weight non_local_means_weight(const Image& u, const Strength& h, int patch, double a) {
  return [&u, h, a, p = static_cast<std::ptrdiff_t>(patch / 2)](auto r, auto c, auto dy, auto dx) {
    double sum = 0, all = 0;
    for (std::ptrdiff_t y = -p; y <= p; ++y) {
      for (std::ptrdiff_t x = -p; x <= p; ++x) {
        if (!u.valid(r + y, c + x) || !u.valid(r + dy + y, c + dx + x)) continue;
        const double g = std::exp(-static_cast<double>(y * y + x * x) / (2 * a * a));
        const double d = u.at(r + y, c + x) - u.at(r + dy + y, c + dx + x);
        sum += g * d * d;
        all += g;
      }
    }
    return std::exp(-sum / all / (h(r, c) * h(r, c)));
  };
}

/// The robust and guided variant as the stage's documentation defines it, for one sigma s and amplitudes whose
/// deviation is the part `relative` of them: Gaussian with a = 1 px, edges at 4 h.
inline Weight robust_weight(const Image& u, const Image& amplitude, double h, int patch, double s, double relative) {
  return
      [&u, &amplitude, h, s, relative, p = static_cast<std::ptrdiff_t>(patch / 2)](auto r, auto c, auto dy, auto dx) {
        double sum = 0, all = 0;
        for (std::ptrdiff_t y = -p; y <= p; ++y) {
          for (std::ptrdiff_t x = -p; x <= p; ++x) {
            const double one = u.at(r + y, c + x), other = u.at(r + dy + y, c + dx + x);
            if (std::isnan(one) || std::isnan(other)) continue;
            const double first = one - u.at(r, c), second = other - u.at(r + dy, c + dx);
            const double g =
                std::exp(-static_cast<double>(y * y + x * x) / 2 - (first * first + second * second) / (16 * h * h));
            const double a = amplitude.at(r + y, c + x), b = amplitude.at(r + dy + y, c + dx + x);
            const double length = (one - other) * (one - other) / (h * h);
            const double light = 2 * s * s / (h * h) * (a - b) * (a - b) / (relative * relative * (a * a + b * b));
            sum += g * (length + light) / 2;
            all += g;
          }
        }
        return std::exp(-std::max(sum / all - 2 * s * s / (h * h), 0.0));
      };
}

/// The pallet of boxes as the camera sees it without noise: depth in metres, and the surfaces' reflected light in
/// counts, as it falls off with the square of the path and with the angle of incidence.
struct Scene {
  Image depth, amplitude;
};

/// Boxes of 150 x 150 x 250 mm, 3 x 3 of them on a pallet; tops 500 mm away from a pinhole camera of the CamCube's
/// focal length that looks straight down.
/// @param gap between the boxes, m. Without one, no wall is seen; with one, inner walls, up to 12 mm deeper a pixel.
inline Scene box_scene(std::ptrdiff_t size = 204, double gap = 0) {
  constexpr double side = 0.150, top = 0.500, floor = 0.750, focal = 175.4;
  Scene scene{Image(size, size), Image(size, size)};
  for (std::ptrdiff_t r = 0; r < size; ++r) {
    for (std::ptrdiff_t c = 0; c < size; ++c) {
      const double middle = static_cast<double>(size - 1) / 2;
      const std::array<double, 2> slope = {(static_cast<double>(c) - middle) / focal,
                                           (static_cast<double>(r) - middle) / focal};
      const double length = std::sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
      double depth = floor, cosine = 1 / length;
      for (int box = 0; box < 9; ++box) {
        const std::array<double, 2> corner = {(box % 3 - 1) * (side + gap) - side / 2,
                                              (box / 3 - 1) * (side + gap) - side / 2};
        // It hits the box where it is within all three slabs at once: at depths from enter to leave.
        double enter = top, leave = floor, facing = 1 / length;
        for (std::size_t axis = 0; axis < 2; ++axis) {
          const double one = corner[axis] / slope[axis], other = (corner[axis] + side) / slope[axis];
          if (std::min(one, other) > enter) {
            enter = std::min(one, other);
            facing = std::abs(slope[axis]) / length;
          }
          leave = std::min(leave, std::max(one, other));
        }
        if (enter >= leave || enter >= depth) continue;
        depth = enter;
        cosine = facing;
      }
      scene.depth(r, c) = static_cast<float>(depth);
      scene.amplitude(r, c) = static_cast<float>(4000 * 0.25 * cosine / (depth * depth * length * length));
    }
  }
  return scene;
}

/// Pixels within `radius` of a step of depth of more than 30 mm between neighbours.
inline std::vector<bool> edges_of(const Image& depth, std::ptrdiff_t radius) {
  std::vector<bool> edge(depth.values.size());
  const auto mark = [&](std::ptrdiff_t row, std::ptrdiff_t column) {
    for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(row - radius, 0); r <= std::min(row + radius, depth.rows - 1); ++r)
      for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(column - radius, 0);
           c <= std::min(column + radius, depth.columns - 1); ++c)
        edge[static_cast<std::size_t>(r * depth.columns + c)] = true;
  };
  for (std::ptrdiff_t r = 0; r < depth.rows; ++r) {
    for (std::ptrdiff_t c = 0; c < depth.columns; ++c) {
      if (std::abs(depth.at(r, c) - depth.at(r, c + 1)) > 0.030) mark(r, c), mark(r, c + 1);
      if (std::abs(depth.at(r, c) - depth.at(r + 1, c)) > 0.030) mark(r, c), mark(r + 1, c);
    }
  }
  return edge;
}

inline void add_noise(Image& image, double deviation, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, deviation);
  for (float& v : image.values) v = static_cast<float>(v + noise(random));
}

/// Makes each pixel invalid with this probability.
inline void drop_pixels(Image& image, double probability, unsigned seed) {
  std::mt19937 random(seed);
  std::bernoulli_distribution drop(probability);
  for (float& v : image.values) v = drop(random) ? std::numeric_limits<float>::quiet_NaN() : v;
}

}  // namespace test
