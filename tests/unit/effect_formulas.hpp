// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Independent implementation of the camera as equations, with the changes made by an effect.
#pragma once

#include <functional>

#include "tests/unit/effect_exposures.hpp"

namespace tofgraph::test {

/// State changed by effects of geometry.
struct World {
  bool physical = true;
  std::array<Vector3, 2> sources{{{-0.05, 0, 0}, {0.05, 0, 0}}};
  std::array<double, 5> distortion{};  // k1 k2 p1 p2 k3
  double centre_x = 101.5, centre_y = 101.5;
  double scale = 1, offset = 0, tilt_x = 0, tilt_y = 0;
};

/// Point seen by a pixel.
struct Spot {
  double u = 0, v = 0;
  Vector3 ray, at, normal;  // normal: towards the camera
  double back = 0, reflectivity = 0;
};

inline Vector3 turned(const Vector3& n, double about_x, double about_y) {
  const double y = std::cos(about_x) * n.y - std::sin(about_x) * n.z,
               z = std::sin(about_x) * n.y + std::cos(about_x) * n.z;
  return {std::cos(about_y) * n.x + std::sin(about_y) * z, y, -std::sin(about_y) * n.x + std::cos(about_y) * z};
}

inline Spot spot(const World& world, double u, double v) {
  const double there_x = (u - world.centre_x) * 40e-6 / focal_length,
               there_y = (v - world.centre_y) * 40e-6 / focal_length;
  const auto& [k1, k2, p1, p2, k3] = world.distortion;
  double x = there_x, y = there_y;
  for (int i = 0; i < 200; ++i) {
    const double r2 = x * x + y * y, radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
    const double dx = 2 * p1 * x * y + p2 * (r2 + 2 * x * x), dy = p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
    x = (there_x - dx) / radial;
    y = (there_y - dy) / radial;
  }
  Spot result{u, v, (1 / std::hypot(x, y, 1)) * Vector3{x, y, 1}, {}, {}, 0, 0};
  const BoardPose& board = boards[is_far(result.ray) ? 1 : 0];
  const double z = world.scale * board.distance + world.offset;
  const Vector3 n = turned(turned({0, 0, 1}, board.tilt_x, board.tilt_y), world.tilt_x, world.tilt_y);
  const double return_path = n.z * (z - focal_length) / physics::dot(n, result.ray);
  result.at = return_path * result.ray + Vector3{0, 0, focal_length};
  result.normal = -1.0 * n;
  result.back = return_path + focal_length / result.ray.z;
  result.reflectivity = board.reflectivity;
  return result;
}

/// Light of a source at a point.
struct Beam {
  const World& world;
  const Spot& spot;
  Vector3 source;
  double frequency, path, strength;
  Complex phasor;

  double wave(double length) const { return 2 * pi * frequency / c_light * length; }
  double side() const { return source.x > 0 ? 1 : -1; }
  Vector3 to_source() const { return (1 / path) * (source - spot.at); }
  void scale(double factor) {
    strength *= factor;
    phasor *= factor;
  }
};

/// All light of a pixel.
struct Light {
  double u, v, frequency, amplitude, distance;
  double radians(double length) const { return 4 * pi * frequency / c_light * length; }
};

/// Exposure of a pixel.
struct Sample {
  std::size_t k;
  double amplitude, phase, step, frequency, distance, c, intensity;
};

struct Taps {
  double u, v, a, b;
};

/// An effect as a set of equations; members it does not change are empty.
struct Formula {
  std::function<void(World&)> world = {};
  std::function<void(Beam&)> beam = {};
  std::function<std::vector<double>(std::size_t i)> weights = {};  // of all pixels' light in pixel i
  Complex inside = {};                                             // counts
  std::function<double(const Light&)> turn = {};                   // rad
  double displacement = 0;                                         // m, from image to image
  std::function<void(Sample&)> sample = {};
  std::function<void(Taps&)> taps = {};
  double noise = 1;
};

struct Shone {
  std::array<Complex, pixels> phasor{};
  std::array<double, pixels> strength{}, distance{};
};

inline Shone illuminate(const World& world, const Formula& formula, double frequency) {
  Shone shone;
  for (std::size_t i = 0; i < pixels; ++i) {
    const Spot at = spot(world, (static_cast<double>(i % side) + 0.5) * spacing - 0.5,
                         (static_cast<double>(i / side) + 0.5) * spacing - 0.5);
    const double mean_path =
        (physics::norm(at.at - world.sources[0]) + physics::norm(at.at - world.sources[1])) / 2 + at.back;
    double weighted = 0;
    for (const Vector3& source : world.sources) {
      Beam beam{world, at, source, frequency, physics::norm(at.at - source), 0, {}};
      const double amount = 7e6 * at.reflectivity * integration_time / 2, view = at.ray.z;
      beam.strength = world.physical ? amount * physics::dot(beam.to_source(), at.normal) * std::pow(view, 4) /
                                           (4 * beam.path * beam.path)
                                     : amount / (mean_path * mean_path);
      beam.phasor = std::polar(beam.strength, beam.wave(beam.path + at.back));
      if (formula.beam) formula.beam(beam);
      shone.phasor[i] += beam.phasor;
      shone.strength[i] += beam.strength;
      weighted += beam.strength * (beam.path + at.back) / 2;
    }
    shone.distance[i] = weighted / shone.strength[i];
  }
  if (!formula.weights) return shone;
  Shone mixed{{}, {}, shone.distance};
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::vector<double> weights = formula.weights(i);
    for (std::size_t j = 0; j < pixels; ++j) {
      mixed.phasor[i] += weights[j] * shone.phasor[j];
      mixed.strength[i] += weights[j] * shone.strength[j];
    }
  }
  return mixed;
}

/// P x (A, B) x pixels.
inline std::vector<double> by_formula(const Formula& formula, const ExposedCamera& camera, bool physical) {
  std::vector<double> result;
  for (std::size_t k = 0; k < camera.exposures().size(); ++k) {
    World world;
    world.physical = physical;
    if (formula.world) formula.world(world);
    world.offset += static_cast<double>(k) * formula.displacement;
    const double frequency = camera.frequency(k), step = camera.exposures()[k].phase;
    const Shone shone = illuminate(world, formula, frequency);
    std::array<Taps, pixels> taps{};
    for (std::size_t i = 0; i < pixels; ++i) {
      const double u = (static_cast<double>(i % side) + 0.5) * spacing - 0.5,
                   v = (static_cast<double>(i / side) + 0.5) * spacing - 0.5;
      const Complex light = shone.phasor[i] + formula.inside;
      double psi = std::arg(light);
      if (formula.turn) psi += formula.turn({u, v, frequency, std::abs(light), shone.distance[i]});
      const double a = std::abs(light), contrast = 0.5;
      Sample sample{k, a, psi, step, frequency, shone.distance[i], a * std::cos(psi + step), 0};
      sample.intensity = (shone.strength[i] + std::abs(formula.inside)) / (2 * contrast);
      if (formula.sample) formula.sample(sample);
      taps[i] = {u, v, sample.intensity + sample.c / 2, sample.intensity - sample.c / 2};
      if (formula.taps) formula.taps(taps[i]);
    }
    for (const Taps& each : taps) result.push_back(each.a);
    for (const Taps& each : taps) result.push_back(each.b);
  }
  return result;
}

/// exp(-d^2 / (2 width^2)) of the pixels around pixel i; width in px.
inline std::vector<double> gaussian(std::size_t i, double width) {
  std::vector<double> weights(pixels);
  const double w = width / spacing;
  for (std::size_t j = 0; j < pixels; ++j) {
    const double dx = static_cast<double>(j % side) - static_cast<double>(i % side),
                 dy = static_cast<double>(j / side) - static_cast<double>(i / side);
    weights[j] = std::exp(-(dx * dx + dy * dy) / (2 * w * w));
  }
  return weights;
}

/// Oren-Nayar factor, in angles about the normal, as in the paper.
inline double oren_nayar(const Beam& beam, double roughness) {
  const double s2 = roughness * roughness, a = 1 - 0.5 * s2 / (s2 + 0.33), b = 0.45 * s2 / (s2 + 0.09);
  const Vector3 n = beam.spot.normal, light = beam.to_source(), view = -1.0 * beam.spot.ray;
  const Vector3 flat_light = light - physics::dot(n, light) * n, flat_view = view - physics::dot(n, view) * n;
  const double theta_light = std::atan2(physics::norm(flat_light), physics::dot(n, light)),
               theta_view = std::atan2(physics::norm(flat_view), physics::dot(n, view));
  const double along = physics::dot(flat_light, flat_view) / (physics::norm(flat_light) * physics::norm(flat_view));
  return a + b * std::max(0.0, along) * std::sin(std::max(theta_light, theta_view)) *
                 std::tan(std::min(theta_light, theta_view));
}

inline double warm(double tau) { return 1 - std::exp(-500 / tau); }

inline double from_map(const std::vector<double>& map, double u, double v) {
  return map[static_cast<std::size_t>(v) * 204 + static_cast<std::size_t>(u)];  // the pixels' centres are integers
}

}  // namespace tofgraph::test
