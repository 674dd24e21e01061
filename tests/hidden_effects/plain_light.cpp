// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The phasor level: light of every source on the board, as every pixel sees it; then what happens to it on its way to
// the pixel; then the turns of its phase.
#include "tests/hidden_effects/plain_geometry.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::hidden {
namespace {

using std::complex;

/// Angles at one point of the board, between the light of a source and the way to the lens.
struct Meeting {
  double cos_in = 1;      ///< incidence
  double oren_nayar = 1;  ///< f_on: 1 for a Lambert surface
  double half = 1;        ///< n . h
};

Meeting meeting(const Physics& physics, Vector point, Vector normal, Vector source) {
  const Vector lens{0, 0, physics.camera.focal_length};
  const Vector facing = dot(normal, lens - point) < 0 ? -1 * normal : normal;
  const Vector in = unit(source - point), out = unit(lens - point);
  Meeting m;
  m.cos_in = std::max(0.0, dot(facing, in));
  m.half = std::max(0.0, dot(facing, unit(in + out)));
  const double cos_out = std::clamp(dot(facing, out), 0.0, 1.0);
  const double theta_in = std::acos(std::min(1.0, m.cos_in)), theta_out = std::acos(cos_out);
  const double s2 = std::pow(physics.effects.value("surface_reflectance", "roughness"), 2);
  const double a = 1 - 0.5 * s2 / (s2 + 0.33), b = 0.45 * s2 / (s2 + 0.09);
  // Azimuth between the two directions as seen along the normal.
  const Vector flat_in = in - dot(facing, in) * facing, flat_out = out - dot(facing, out) * facing;
  const double lengths = length(flat_in) * length(flat_out);
  const double cos_azimuth = lengths > 0 ? dot(flat_in, flat_out) / lengths : 0;
  m.oren_nayar = a + b * std::max(0.0, cos_azimuth) * std::sin(std::max(theta_in, theta_out)) *
                         std::tan(std::min(theta_in, theta_out));
  return m;
}

/// Share of the light that a source sends in this direction, by beam_profile.
double beam(const Effects& effects, bool right, Vector direction) {
  if (!effects.has("beam_profile")) return 1;
  const double toe = (right ? 1 : -1) * effects.value("beam_profile", "toe");
  const double along = dot(direction, {std::sin(toe), 0, std::cos(toe)});
  return std::pow(std::max(0.0, along), effects.value("beam_profile", "exponent"));
}

/// One pixel's light from the arrays that are on, straight or by way of the rail.
class PixelLight {
 public:
  PixelLight(const Physics& physics, const View& view, Plane board) : physics_(physics), view_(view), board_(board) {
    const Effects& e = physics.effects;
    wave_number_ = 2 * M_PI * physics.camera.modulation_frequency * (1 + e.value("modulation_frequency", "error")) /
                   speed_of_light;
  }

  /// @param by_rail through the mirror image of each array
  void add(const Ray& ray, bool by_rail, double strength, complex<double>& phasor, double& total) const {
    const Vector lens{0, 0, physics_.camera.focal_length};
    const double from_lens = dot(board_.point - lens, board_.normal) / dot(ray.direction, board_.normal);
    if (!(from_lens > 0)) return;
    const Vector point = lens + from_lens * ray.direction;
    std::array<Vector, 2> sources = source_positions(physics_);
    std::array<double, 2> way{};  // D_i
    double mean = 0;
    for (std::size_t s = 0; s < 2; ++s) {
      Vector& source = sources[s];
      if (by_rail) source = mirrored_by_rail(physics_, view_, source);
      way[s] = length(point - source);
      if (view_.on[s]) mean += way[s] / (view_.on[0] && view_.on[1] ? 2 : 1);
    }
    const double rest = from_lens + ray.to_sensor;
    for (std::size_t s = 0; s < 2; ++s) {
      if (!view_.on[s]) continue;
      const double a = strength * amplitude(s == 1, ray, point, sources[s], way[s], mean + rest);
      phasor += std::polar(a, wave_number_ * (way[s] + rest) + source_phase(s == 1));
      total += a;
    }
  }

 private:
  double source_phase(bool right) const {
    return (right ? 0.5 : -0.5) * physics_.effects.value("source_phase", "difference");
  }

  double amplitude(bool right, const Ray& ray, Vector point, Vector source, double way, double whole_way) const {
    const Effects& e = physics_.effects;
    const Meeting m = meeting(physics_, point, board_.normal, source);
    const double rough = e.has("surface_reflectance") ? m.oren_nayar : 1;
    const double gloss = e.value("specular", "strength") * std::pow(m.half, e.value("specular", "exponent"));
    double a = physics_.camera.gain * view_.integration_time / 2;  // each of the profile's two arrays has one half
    if (physics_.light == Light::reference) {
      const double lambert = e.value("surface_reflectance", "lambert");
      const double matt = (1 - lambert) + lambert * m.cos_in * rough;
      a *= (view_.reflectivity * matt + gloss) / (whole_way * whole_way);
    } else {
      a *= m.cos_in * (view_.reflectivity * rough + gloss) / (4 * way * way) * std::pow(ray.cos_theta, 4);
    }
    a *= 1 + (right ? 0.5 : -0.5) * e.value("source_amplitude", "ratio");
    return a * beam(e, right, unit(point - source));
  }

  const Physics& physics_;
  const View& view_;
  Plane board_;
  double wave_number_;  // of the whole way, rad/m
};

/// A Gaussian's weights on whole pixels, sum 1 over all of them.
std::vector<double> gaussian(double width, int reach) {
  std::vector<double> weights(static_cast<std::size_t>(2 * reach + 1));
  double sum = 0;
  for (int d = -reach; d <= reach; ++d)
    sum += weights[static_cast<std::size_t>(d + reach)] = std::exp(-0.5 * d * d / (width * width));
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Direct sum along rows, then along columns. @param renormalise the weights inside the image sum to 1; else what is
/// outside is dark
template <class Value>
std::vector<Value> blurred(const Camera& camera, const std::vector<Value>& image, double width, bool renormalise) {
  const int w = camera.width, h = camera.height, reach = static_cast<int>(std::ceil(6 * width));
  const std::vector<double> weights = gaussian(width, reach);
  std::vector<Value> from = image, to(image.size());
  for (const bool horizontal : {true, false}) {
    const int size = horizontal ? w : h, stride = horizontal ? 1 : w;
    for (int row = 0; row < h; ++row)
      for (int column = 0; column < w; ++column) {
        const int place = horizontal ? column : row, here = row * w + column;
        Value sum{};
        double inside = 0;
        for (int d = std::max(-reach, -place); d <= std::min(reach, size - 1 - place); ++d) {
          const double weight = weights[static_cast<std::size_t>(d + reach)];
          sum += weight * from[static_cast<std::size_t>(here + d * stride)];
          inside += weight;
        }
        to[static_cast<std::size_t>(here)] = renormalise ? sum / inside : sum;
      }
    from = to;
  }
  return from;
}

template <class Value> void mix_pixels(const Physics& physics, std::vector<Value>& image) {
  const double blur = physics.effects.value("mixed_pixels", "blur");
  if (blur > 0) image = blurred(physics.camera, image, blur, true);
}

template <class Value> void scatter(const Physics& physics, std::vector<Value>& image) {
  const Effects& e = physics.effects;
  const double fraction = e.value("stray_light", "fraction"), share = e.value("stray_light", "uniform");
  if (fraction == 0) return;
  const std::vector<Value> wide = blurred(physics.camera, image, e.value("stray_light", "width"), false);
  Value mean{};
  for (const Value& value : image) mean += value;
  mean /= static_cast<double>(image.size());
  for (std::size_t i = 0; i < image.size(); ++i) image[i] += fraction * ((1 - share) * wide[i] + share * mean);
}

double warm(const View& view, const Effects& effects) {
  return 1 - std::exp(-view.time_since_power_on / effects.value("warm_up", "time_constant"));
}

/// What turns the phase at the end of the level, as a distance. @param amplitude of all the light, counts
double turn_in_metres(const Physics& physics, const View& view, int column, int row, double amplitude) {
  const Effects& e = physics.effects;
  double metres = view.drift_distance;
  if (e.has("integration_time_offset"))
    metres += e.value("integration_time_offset", "slope") *
              std::log(view.integration_time / e.value("integration_time_offset", "reference_time"));
  if (e.has("warm_up")) metres += e.value("warm_up", "drift") * warm(view, e);
  if (e.has("amplitude_walk") && amplitude > 0) {
    const double relative = amplitude / e.value("amplitude_walk", "reference_amplitude");
    metres += physics.camera.metres_per_radian() * (e.value("amplitude_walk", "logarithmic") * std::log(relative) +
                                                    e.value("amplitude_walk", "inverse") / relative);
  }
  if (e.has("fixed_pattern")) {
    const std::size_t i = static_cast<std::size_t>(row * physics.camera.width + column);
    double map = physics.maps.fixed_pattern.empty() ? 0 : physics.maps.fixed_pattern[i];
    if (!physics.maps.fixed_pattern_slope.empty()) map += physics.maps.fixed_pattern_slope[i] * (view.distance - 2);
    metres += e.value("fixed_pattern", "scale") * map;
  }
  for (const Pattern& pattern : physics.patterns) metres += distance_error(pattern, view, column, row);
  return metres;
}

/// Light that comes from the scene through the lens.
SensorLight scene_light(const Physics& physics, const View& view, double displacement) {
  const Camera& camera = physics.camera;
  const Effects& e = physics.effects;
  SensorLight light{PhasorImage(camera.pixels()), Image(camera.pixels(), 0.0)};
  if (view.capped) return light;
  const PixelLight pixel(physics, view, board_of(physics, view, displacement));
  const double rail = view.covered ? 0 : e.value("rail_reflection", "strength");
  const double bounce = e.value("multipath", "strength");
  const complex<double> detour =
      std::polar(bounce, 2 * M_PI * camera.modulation_frequency * e.value("multipath", "extra_path") / speed_of_light);
  const double droop = e.has("warm_up") ? 1 - e.value("warm_up", "droop") * warm(view, e) : 1;
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const std::size_t i = static_cast<std::size_t>(row * camera.width + column);
      const Ray ray = ray_of(physics, column, row);
      complex<double> phasor{};
      double total = 0;
      pixel.add(ray, false, 1, phasor, total);
      if (rail != 0) pixel.add(ray, true, rail, phasor, total);
      double factor = droop * view.drift_amplitude * std::pow(ray.cos_theta, e.value("vignetting", "exponent"));
      for (const Pattern& pattern : physics.patterns) factor *= light_factor(pattern, view, column, row);
      light.phasor[i] = factor * (phasor + phasor * detour);
      light.total[i] = factor * total * (1 + bounce);
    }
  mix_pixels(physics, light.phasor);
  mix_pixels(physics, light.total);
  scatter(physics, light.phasor);
  scatter(physics, light.total);
  return light;
}

}  // namespace

SensorLight light_on_sensor(const Physics& physics, const View& view, double displacement) {
  const Camera& camera = physics.camera;
  SensorLight light = scene_light(physics, view, displacement);
  const complex<double> inside =
      view.integration_time *
      complex<double>(physics.effects.value("crosstalk", "real"), physics.effects.value("crosstalk", "imaginary"));
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const std::size_t i = static_cast<std::size_t>(row * camera.width + column);
      light.phasor[i] += inside;
      light.total[i] += std::abs(inside);
      const double metres = turn_in_metres(physics, view, column, row, std::abs(light.phasor[i]));
      light.phasor[i] *= std::polar(1.0, metres / camera.metres_per_radian());
    }
  return light;
}

}  // namespace tofgraph::hidden
