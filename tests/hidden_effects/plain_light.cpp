// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The phasor level: light of every source on the board, as seen by every pixel; then its changes on the path to the
// pixel; then the phase changes.
#include "tests/hidden_effects/plain_geometry.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::hidden {
namespace {

using std::complex;

/// Reflection by a board: rho times 1 in `light: reference`, times cos(theta_i) in `light: physical`; the effects
/// surface_reflectance (Oren-Nayar model) and specular.
class Surface {
 public:
  explicit Surface(const Physics& physics)
      : reference_(physics.light == Light::reference),
        rough_(physics.effects.has("surface_reflectance")),
        shiny_(physics.effects.has("specular")),
        lambert_(physics.effects.value("surface_reflectance", "lambert")),
        strength_(physics.effects.value("specular", "strength")),
        exponent_(physics.effects.value("specular", "exponent")) {
    const double s2 = std::pow(physics.effects.value("surface_reflectance", "roughness"), 2);
    a_ = 1 - 0.5 * s2 / (s2 + 0.33);
    b_ = 0.45 * s2 / (s2 + 0.09);
  }

  /// @param facing normal towards the camera  @param in, out unit vectors to the source and to the lens
  double sent_on(double reflectivity, Vector facing, Vector in, Vector out) const {
    const double cos_in = std::max(0.0, dot(facing, in));
    double matt = 1;
    if (rough_) matt = oren_nayar(facing, in, out);
    if (rough_ && reference_) matt = (1 - lambert_) + lambert_ * cos_in * matt;
    double all = reflectivity * matt;
    if (shiny_) all += strength_ * std::pow(std::max(0.0, dot(facing, unit(in + out))), exponent_);
    return reference_ ? all : cos_in * all;
  }

 private:
  double oren_nayar(Vector facing, Vector in, Vector out) const {
    const double cos_in = std::clamp(dot(facing, in), 0.0, 1.0), cos_out = std::clamp(dot(facing, out), 0.0, 1.0);
    const double theta_in = std::acos(cos_in), theta_out = std::acos(cos_out);
    // Azimuth between the two directions in the plane perpendicular to the normal.
    const Vector flat_in = in - cos_in * facing, flat_out = out - cos_out * facing;
    const double lengths = length(flat_in) * length(flat_out);
    const double cos_azimuth = lengths > 0 ? dot(flat_in, flat_out) / lengths : 0;
    return a_ + b_ * std::max(0.0, cos_azimuth) * std::sin(std::max(theta_in, theta_out)) *
                    std::tan(std::min(theta_in, theta_out));
  }

  bool reference_, rough_, shiny_;
  double lambert_, strength_, exponent_, a_, b_;
};

/// Array of LEDs.
struct Source {
  Vector position;
  Vector axis;        ///< axis of its beam
  Vector start;       ///< start of its light's path: its position, or its mirror image in the rail
  double weight = 1;  ///< weight of its light
  double phase = 0;   ///< rad
};

/// The arrays that are on. @param by_rail as mirrored by the rail: a fraction of the direct light, on a longer path
std::vector<Source> sources_on(const Physics& physics, const View& view, bool by_rail) {
  const Effects& e = physics.effects;
  const std::array<Vector, 2> positions = source_positions(physics);
  std::vector<Source> sources;
  for (const std::size_t i : {0U, 1U}) {
    if (!view.on[i]) continue;
    const double side = i == 0 ? -1 : 1, toe = side * e.value("beam_profile", "toe");
    Source source{positions[i], {std::sin(toe), 0, std::cos(toe)}, positions[i]};
    source.weight = 1 + side * e.value("source_amplitude", "ratio") / 2;
    source.phase = side * e.value("source_phase", "difference") / 2;
    if (by_rail) {
      source.start = mirrored_by_rail(physics, view, source.position);
      source.weight *= e.value("rail_reflection", "strength");
    }
    sources.push_back(source);
  }
  return sources;
}

/// Phasor and sum of the light that reaches a pixel.
struct PixelLight {
  complex<double> phasor;
  double total = 0;
};

/// The light of the active sources reflected by the board.
class BoardLight {
 public:
  BoardLight(const Physics& physics, const View& view, double displacement, bool by_rail)
      : physics_(physics),
        view_(view),
        surface_(physics),
        board_(board_of(physics, view, displacement)),
        sources_(sources_on(physics, view, by_rail)),
        beam_exponent_(physics.effects.value("beam_profile", "exponent")),
        wave_number_(2 * M_PI * physics.camera.modulation_frequency *
                     (1 + physics.effects.value("modulation_frequency", "error")) / speed_of_light) {}

  PixelLight operator()(const Ray& ray) const {
    const Vector lens{0, 0, physics_.camera.focal_length};
    const double from_lens = way_to_board(ray, lens);
    if (!(from_lens > 0)) return {};
    const Vector point = lens + from_lens * ray.direction;
    const Vector facing = dot(board_.normal, lens - point) < 0 ? -1 * board_.normal : board_.normal;
    const double rest = from_lens + ray.to_sensor;  // D_ref + D_sen
    double whole_way = rest;                        // D_t
    for (const Source& source : sources_)
      whole_way += length(point - source.position) / static_cast<double>(sources_.size());
    PixelLight light;
    for (const Source& source : sources_) {
      const Vector in = unit(source.position - point);
      const double way = length(point - source.position);  // D_i
      // Each of the profile's two arrays contributes half of the gain.
      double a = physics_.camera.gain * view_.integration_time / 2 * source.weight *
                 surface_.sent_on(view_.reflectivity, facing, in, -1 * ray.direction);
      if (physics_.light == Light::reference)
        a /= whole_way * whole_way;
      else
        a *= std::pow(ray.cos_theta, 4) / (4 * way * way);
      if (beam_exponent_ != 0) a *= std::pow(std::max(0.0, -dot(in, source.axis)), beam_exponent_);
      light.phasor += std::polar(a, wave_number_ * (length(point - source.start) + rest) + source.phase);
      light.total += a;
    }
    return light;
  }

 private:
  /// Distance from the lens to the board, which deviates from its plane by the warp: found iteratively, as the slope is
  /// small. The reflection uses the normal of the plane.
  double way_to_board(const Ray& ray, Vector lens) const {
    const double flat = dot(board_.point - lens, board_.normal), along = dot(ray.direction, board_.normal);
    double way = flat / along;
    for (int i = 0; view_.warp && i < 6; ++i) {
      const Vector off = lens + way * ray.direction - board_.point;
      way = (flat + view_.warp(dot(off, board_.x), dot(off, board_.y))) / along;
    }
    return way;
  }

  const Physics& physics_;
  const View& view_;
  Surface surface_;
  Plane board_;
  std::vector<Source> sources_;
  double beam_exponent_, wave_number_;  // rad/m of the round trip
};

/// Gaussian weights at integer pixels, with sum 1 over all of them.
std::vector<double> gaussian(double width, int reach) {
  std::vector<double> weights(static_cast<std::size_t>(2 * reach + 1));
  double sum = 0;
  for (int d = -reach; d <= reach; ++d)
    sum += weights[static_cast<std::size_t>(d + reach)] = std::exp(-0.5 * d * d / (width * width));
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Direct sum along rows, then along columns. @param renormalise weights inside the image sum to 1; otherwise the
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

/// Progress of the warm-up since power-on, 0..1. @param time_constant parameter name of the process
double warm(const View& view, const Effects& effects, const char* time_constant = "time_constant") {
  return 1 - std::exp(-view.time_since_power_on / effects.value("warm_up", time_constant));
}

/// Both processes of the drift; the heating depends on the exposure time.
double warm_up(const View& view, const Effects& e) {
  const double heating =
      std::pow(view.integration_time / e.value("warm_up", "reference_time"), e.value("warm_up", "exponent"));
  return heating * (e.value("warm_up", "drift") * warm(view, e) +
                    e.value("warm_up", "slow_drift") * warm(view, e, "slow_time_constant"));
}

/// Phase changes at the end of the level, as a distance.
class Turns {
 public:
  Turns(const Physics& physics, const View& view) : physics_(physics), view_(view) {
    const Effects& e = physics.effects;
    const double reference_time = e.value("integration_time_offset", "reference_time");
    const double times = view.integration_time / reference_time;
    const double exponent = e.value("integration_time_offset", "exponent");
    const double longer = exponent == 0 ? std::log(times) : (std::pow(times, exponent) - 1) / exponent;
    everywhere_ = view.drift_distance + warm_up(view, e) + e.value("integration_time_offset", "slope") * longer +
                  e.value("integration_time_offset", "linear") * (view.integration_time - reference_time) +
                  e.value("zero_offset", "offset");
    logarithmic_ = e.value("amplitude_walk", "logarithmic");
    inverse_ = e.value("amplitude_walk", "inverse");
    reference_amplitude_ = e.value("amplitude_walk", "reference_amplitude");
    map_scale_ = e.value("fixed_pattern", "scale");
  }

  /// @param light all of it, counts
  double metres(int column, int row, complex<double> light) const {
    const double per_radian = physics_.camera.metres_per_radian();
    const std::size_t i = static_cast<std::size_t>(row * physics_.camera.width + column);
    const double phase = std::arg(light), distance = per_radian * (phase < 0 ? phase + 2 * M_PI : phase);
    double sum = everywhere_ + map_scale_ * map(i, distance) + view_.residue(column, row);
    if (std::abs(light) > 0) {
      const double relative = std::abs(light) / reference_amplitude_;
      sum += per_radian * (logarithmic_ * std::log(relative) + inverse_ / relative);
    }
    for (const Pattern& pattern : physics_.patterns) sum += distance_error(pattern, view_, column, row);
    return sum;
  }

 private:
  double map(std::size_t i, double distance) const {
    const PixelMaps& maps = physics_.maps;
    return (maps.fixed_pattern.empty() ? 0 : maps.fixed_pattern[i]) +
           (maps.fixed_pattern_slope.empty() ? 0 : maps.fixed_pattern_slope[i] * (distance - 2));
  }

  const Physics& physics_;
  const View& view_;
  double everywhere_, logarithmic_, inverse_, reference_amplitude_, map_scale_;
};

/// Light from the scene through the lens.
SensorLight scene_light(const Physics& physics, const View& view, double displacement) {
  const Camera& camera = physics.camera;
  const Effects& e = physics.effects;
  SensorLight light{PhasorImage(camera.pixels()), Image(camera.pixels(), 0.0)};
  if (view.capped) return light;
  const BoardLight straight(physics, view, displacement, false), by_rail(physics, view, displacement, true);
  const bool rail = e.has("rail_reflection") && !view.covered;
  const double bounce = e.value("multipath", "strength"), exponent = e.value("vignetting", "exponent");
  const complex<double> detour =
      std::polar(bounce, 2 * M_PI * camera.modulation_frequency * e.value("multipath", "extra_path") / speed_of_light);
  const double power = view.drift_amplitude * (1 - e.value("warm_up", "droop") * warm(view, e));
  const std::vector<Ray> rays = rays_of(physics);
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const std::size_t i = static_cast<std::size_t>(row * camera.width + column);
      PixelLight seen = straight(rays[i]);
      if (rail) {
        const PixelLight mirrored = by_rail(rays[i]);
        seen.phasor += mirrored.phasor;
        seen.total += mirrored.total;
      }
      double factor = power * std::pow(rays[i].cos_theta, exponent);
      for (const Pattern& pattern : physics.patterns) factor *= light_factor(pattern, view, column, row);
      if (!view.paint.empty()) factor *= view.paint[i];
      light.phasor[i] = factor * (1.0 + detour) * seen.phasor;
      light.total[i] = factor * (1 + bounce) * seen.total;
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
  const Turns turns(physics, view);
  const complex<double> inside =
      view.integration_time *
      complex<double>(physics.effects.value("crosstalk", "real"), physics.effects.value("crosstalk", "imaginary"));
  const double window =
      view.capped ? 0 : view.integration_time * physics.effects.value("static_reflection", "strength");
  const complex<double> reflected =
      std::polar(window, physics.effects.value("static_reflection", "distance") / camera.metres_per_radian());
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const std::size_t i = static_cast<std::size_t>(row * camera.width + column);
      light.phasor[i] += inside + reflected;
      light.total[i] += std::abs(inside) + window;
      const double metres = turns.metres(column, row, light.phasor[i]);
      light.phasor[i] *= std::polar(1.0, metres / camera.metres_per_radian());
    }
  return light;
}

}  // namespace tofgraph::hidden
