// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Reference for tests of denoisers: their equations (reference, section 8), implemented
/// literally in double precision, and the pallet of boxes on which the reference evaluates them,
/// ray-cast.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace test {

/// NaN: invalid, as is everything outside.
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

/// The filtered image, and the standard deviation of each pixel for independent noise `sigma`; NaN if invalid.
struct Denoised {
  std::vector<double> values, sigma;
};

/// weight(r, c, dy, dx): weight of the valid pixel at (dy, dx) for the valid pixel (r, c).
using Weight = std::function<double(std::ptrdiff_t, std::ptrdiff_t, std::ptrdiff_t, std::ptrdiff_t)>;

/// h(r, c): the filter strength at a pixel, m.
using Strength = std::function<double(std::ptrdiff_t, std::ptrdiff_t)>;

/// Dependence of weights on the compared lengths.
struct Comparing {
  Strength h;
  int patch = 1;        // side
  double a = INFINITY;  // of the patch's Gaussian in pixels; infinite: uniform weights
  bool robust = false;  // weights of 1 do not change
  bool guided = false;
};

/// Sums of a weighted mean, excluding the centre.
struct MeanSums {
  double weights = 0, moment = 0, squares = 0, variance = 0, noise = 0, free_moment = 0, free_squares = 0;

  void add(double w, double d, double s) {
    weights += w, moment += w * d, squares += w * d * d, variance += w * w * s * s, noise += w * s * s;
    if (w < 0.999999) free_moment += w * d, free_squares += w * d * d;
  }
};

/// Shares of a patch's pixels: of the centre, in its own sum and in its influence on the weights, and the sum of the
/// squares of the others.
struct Shares {
  double middle, pull, squares;

  Shares(const Image& u, std::ptrdiff_t r, std::ptrdiff_t c, const Comparing& by, double sigma) {
    double all = 0, valid = 0, sum = 0;
    for (std::ptrdiff_t y = -by.patch / 2; y <= by.patch / 2; ++y) {
      for (std::ptrdiff_t x = -by.patch / 2; x <= by.patch / 2; ++x) {
        const double g = std::exp(-static_cast<double>(y * y + x * x) / (2 * by.a * by.a));
        all += g, sum += g * g, valid += u.valid(r + y, c + x) ? g : 0;
      }
    }
    const double closeness = by.robust ? std::pow(sigma / by.h(r, c), 2) / 4 : 0, less = 1 / (1 + closeness);
    const double seen = 1 + (valid - 1) * less;
    middle = 1 / seen;
    pull = middle + closeness / 5 * (1 - middle);
    squares = (sum - 1) * std::pow(less / seen, 2);
  }
};

/// Variance of a mean as stated by plugins/filters/spread_vector.hpp. @param s sigma of the centre
inline double mean_variance(const MeanSums& m, const Shares& g, double c, bool robust, double s) {
  const double all = m.weights + 1, mean = m.moment / all, own = s * s;
  const double spread = std::max(m.squares / all - mean * mean, 0.0);
  const double free = robust ? std::clamp((m.free_squares - mean * m.free_moment) / all, 0.0, spread) : spread;
  const double fixed = (m.variance + own) / (all * all), level = (m.noise + own) / all;
  const double changing = spread > 0 ? free / spread : 1;
  const double noise = (level - fixed) / (1 + c * g.middle * changing * level);
  const double surface = c * std::min(std::max(spread - noise, 0.0), free);
  const double a = c * g.pull * free, u = surface + g.middle * (c * free - surface);
  const double typical = m.noise > 0 ? m.variance / all / m.noise : 0;
  const double both = 2 * surface * (1 - g.middle) * typical * std::max(1 - surface, 0.0);
  const double squares = surface * surface * g.squares;
  return m.variance / (all * all) * (1 + 2 * u * u) / ((1 + u) * (1 + u)) +
         own * (std::pow(1 / all + a, 2) + squares + both) - std::min(own, fixed) * (a * a + squares);
}

inline Denoised averaged(const Image& u, const Image& sigma, int side, const Weight& weight, const Comparing& by) {
  Denoised result;
  const std::ptrdiff_t radius = side / 2;
  for (std::ptrdiff_t r = 0; r < u.rows; ++r) {
    for (std::ptrdiff_t c = 0; c < u.columns; ++c) {
      MeanSums sums;
      for (std::ptrdiff_t dy = -radius; dy <= radius; ++dy) {
        for (std::ptrdiff_t dx = -radius; dx <= radius; ++dx) {
          if ((dy == 0 && dx == 0) || !u.valid(r, c) || !u.valid(r + dy, c + dx)) continue;
          sums.add(weight(r, c, dy, dx), u.at(r + dy, c + dx) - u.at(r, c), sigma.at(r + dy, c + dx));
        }
      }
      const double sensitivity = (by.guided ? 1 : 2) / std::pow(by.h(r, c), 2), own = sigma.at(r, c);
      const double variance = mean_variance(sums, Shares(u, r, c, by, own), sensitivity, by.robust, own);
      result.values.push_back(u.valid(r, c) ? u.at(r, c) + sums.moment / (sums.weights + 1) : std::nan(""));
      result.sigma.push_back(u.valid(r, c) ? std::sqrt(variance) : std::nan(""));
    }
  }
  return result;
}

/// Equations (7.1), (7.3) and (7.7).
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

/// @param a of the patch's Gaussian in pixels; infinite: uniform weights
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

/// The robust and guided variant as defined in the stage's documentation, for a single sigma s and amplitudes whose
/// relative standard deviation is `relative`: Gaussian with a = 1 px, edges at 4 h.
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

/// Noise-free camera image of the pallet of boxes: depth in metres, and reflected light of the surfaces in counts,
/// which falls off with the square of the path and with the angle of incidence.
struct Scene {
  Image depth, amplitude;
};

/// Boxes of 150 x 150 x 250 mm, 3 x 3 of them on a pallet; tops 500 mm from a pinhole camera with the CamCube's focal
/// length that looks straight down. @param gap between the boxes, m. Without a gap no wall is visible; with a gap,
/// inner walls are visible, up to 12 mm deeper per pixel.
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
        // The ray hits the box where it is within all three slabs: at depths from enter to leave.
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

/// Pixels within `radius` of a depth step of more than 30 mm between neighbours.
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
