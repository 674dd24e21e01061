// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// All effects with any exposures: against a camera written out here once more, and what harmonics, steps and gains do
// to three samples in closed form.
#include <gtest/gtest.h>

#include <tofgraph/physics/exposures.hpp>

#include <algorithm>
#include <functional>
#include <random>
#include <set>
#include <sstream>

#include "io/captures/capture_map.hpp"
#include "simulation/frames.hpp"
#include "tests/program.hpp"
#include "tests/unit/effect_fixture.hpp"

using namespace tofgraph;
using namespace tofgraph::test;
using physics::Exposures;

namespace {

constexpr double degrees = pi / 180, own = 20e6, focal_length = 12.8e-3, integration_time = 2e-3;

/// The CamCube with other exposures.
class Camera {
 public:
  explicit Camera(Exposures exposures) : exposures_(std::move(exposures)), view_(camcube()) {
    view_.exposures = exposures_.data();
    view_.exposure_size = sizeof(tofgraph_exposure);
    view_.exposure_count = exposures_.size();
    // As a profile settles it.
    const double first = exposures_[0].frequency;
    const bool one = std::ranges::all_of(exposures_, [&](const auto& e) { return e.frequency == first; });
    if (one && first > 0) view_.modulation_frequency = first;
  }
  Camera(const Camera&) = delete;
  const tofgraph_camera& view() const { return view_; }
  const Exposures& exposures() const { return exposures_; }
  double frequency(std::size_t k) const { return exposures_[k].frequency > 0 ? exposures_[k].frequency : own; }

 private:
  Exposures exposures_;
  tofgraph_camera view_;
};

Exposures steps(const std::vector<double>& angles, const std::vector<double>& frequencies = {0}) {
  Exposures all;
  for (const double frequency : frequencies) {
    for (const double angle : angles) all.push_back({angle * degrees, frequency});
  }
  return all;
}
Exposures three() { return steps({0, 120, 240}); }
Exposures nine() { return steps({0, 120, 240}, {80e6, 16e6, 120e6}); }

const std::vector<Exposures>& many() {
  static const std::vector<Exposures> all = {
      three(), steps({10, 63, 150, 215, 301}), nine(), steps({0, 270, 180, 90}), steps({0, 90, 180, 270}),
      // One frequency after the other, step by step.
      Exposures{{0, 60e6}, {0, 20e6}, {2 * pi / 3, 60e6}, {2 * pi / 3, 20e6}, {4 * pi / 3, 60e6}, {4 * pi / 3, 20e6}}};
  return all;
}

/// Two boards, the far one on the right: an edge, two distances.
constexpr std::array<BoardPose, 2> boards = {{{1, 0.1, -0.2, 0.8}, {2.2, -0.15, 0.1, 0.3}}};
bool is_far(const Vector3& ray) { return ray.x + 0.3 * ray.y > 0.01; }

View view_of(const Camera& camera, bool physical = true) {
  View view;
  view.camera = &camera.view();
  view.acquisition = acquisition_of(camera.view(), integration_time);
  view.physical = physical;
  view.acquisition.condition.ambient = "lamp";
  view.acquisition.condition.time_since_power_on = 500;
  const Tracer near_board = board_tracer(focal_length, boards[0]), far_board = board_tracer(focal_length, boards[1]);
  view.tracer = [=](const BoardChange& change, std::span<const Vector3> rays, std::span<Hit> hits) {
    std::vector<Hit> other(rays.size());
    near_board(change, rays, hits);
    far_board(change, rays, other);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!is_far(rays[i])) continue;
      hits[i] = other[i];
      hits[i].object = 1;
    }
  };
  return view;
}

// The camera once more.

/// What effects of geometry change.
struct World {
  bool physical = true;
  std::array<Vector3, 2> sources{{{-0.05, 0, 0}, {0.05, 0, 0}}};
  std::array<double, 5> distortion{};  // k1 k2 p1 p2 k3
  double centre_x = 101.5, centre_y = 101.5;
  double scale = 1, offset = 0, tilt_x = 0, tilt_y = 0;
};

/// What a pixel sees.
struct Spot {
  double u = 0, v = 0;
  Vector3 ray, at, normal;  // normal: towards the camera
  double back = 0, reflectivity = 0;
};

Vector3 turned(const Vector3& n, double about_x, double about_y) {
  const double y = std::cos(about_x) * n.y - std::sin(about_x) * n.z,
               z = std::sin(about_x) * n.y + std::cos(about_x) * n.z;
  return {std::cos(about_y) * n.x + std::sin(about_y) * z, y, -std::sin(about_y) * n.x + std::cos(about_y) * z};
}

Spot spot(const World& world, double u, double v) {
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

/// One source's light at a spot.
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

/// One exposure of a pixel.
struct Sample {
  std::size_t k;
  double amplitude, phase, step, frequency, c, intensity;
};

struct Taps {
  double u, v, a, b;
};

/// An effect as equations say it; what it does not do is empty.
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

constexpr std::size_t side = 12, pixels = side * side;
constexpr double spacing = 204.0 / side;

struct Shone {
  std::array<Complex, pixels> phasor{};
  std::array<double, pixels> strength{}, distance{};
};

Shone illuminate(const World& world, const Formula& formula, double frequency) {
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
std::vector<double> by_formula(const Formula& formula, const Camera& camera, bool physical) {
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
      Sample sample{k, a, psi, step, frequency, a * std::cos(psi + step), 0};
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
std::vector<double> gaussian(std::size_t i, double width) {
  std::vector<double> weights(pixels);
  const double w = width / spacing;
  for (std::size_t j = 0; j < pixels; ++j) {
    const double dx = static_cast<double>(j % side) - static_cast<double>(i % side),
                 dy = static_cast<double>(j / side) - static_cast<double>(i / side);
    weights[j] = std::exp(-(dx * dx + dy * dy) / (2 * w * w));
  }
  return weights;
}

/// Oren's and Nayar's factor, in angles about the normal, as their paper has it.
double oren_nayar(const Beam& beam, double roughness) {
  const double s2 = roughness * roughness, a = 1 - 0.5 * s2 / (s2 + 0.33), b = 0.45 * s2 / (s2 + 0.09);
  const Vector3 n = beam.spot.normal, light = beam.to_source(), view = -1.0 * beam.spot.ray;
  const Vector3 flat_light = light - physics::dot(n, light) * n, flat_view = view - physics::dot(n, view) * n;
  const double theta_light = std::atan2(physics::norm(flat_light), physics::dot(n, light)),
               theta_view = std::atan2(physics::norm(flat_view), physics::dot(n, view));
  const double along = physics::dot(flat_light, flat_view) / (physics::norm(flat_light) * physics::norm(flat_view));
  return a + b * std::max(0.0, along) * std::sin(std::max(theta_light, theta_view)) *
                 std::tan(std::min(theta_light, theta_view));
}

double warm(double tau) { return 1 - std::exp(-500 / tau); }

double from_map(const std::vector<double>& map, double u, double v) {
  return map[static_cast<std::size_t>(v) * 204 + static_cast<std::size_t>(u)];  // the pixels' centres are whole
}

struct Row {
  std::string effect, parameters;
  Formula formula;
};

/// What the effects' maps hold, and where the files are.
struct Files {
  tests::TemporaryFolder folder;
  std::vector<double> offsets = numbers(1, 5e-3), slopes = numbers(2, 1e-3), gains = numbers(3, 0.02),
                      dark = numbers(4, 4), rate = numbers(5, 100);
  std::string maps = (folder.path() / "maps.h5").string(), table = (folder.path() / "table.csv").string();

  Files() {
    io::write_pixel_maps(maps,
                         {{"offsets", "m", offsets},
                          {"slopes", "", slopes},
                          {"gains", "", gains},
                          {"dark", "counts", dark},
                          {"rate", "counts/s", rate}},
                         204, 204);
    tests::write_text(table, "0.5,1\n8,5\n1,3\n");
  }
  std::string map(const std::string& name) const { return "{file: " + maps + ", dataset: " + name + "}"; }
  static std::vector<double> numbers(unsigned seed, double size) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, size);
    std::vector<double> values(std::size_t{204} * 204);
    for (double& value : values) value = normal(random);
    return values;
  }
};

std::vector<Row> geometry_rows() {
  return {
      {"source_position",
       "separation: 4 mm, shift: 3 mm, depth: -2 mm",
       {.world =
            [](World& w) {
              for (Vector3& source : w.sources) {
                source.x += (source.x > 0 ? 0.004 : -0.004) + 0.003;
                source.z -= 0.002;
              }
            }}},
      {"lens_distortion",
       "k1: -0.1, k2: 0.02, p1: 0.001, p2: -0.002, k3: 0.01",
       {.world =
            [](World& w) {
              w.distortion = {-0.1, 0.02, 0.001, -0.002, 0.01};
            }}},
      {"principal_point",
       "x: 1.5 px, y: -2 px",
       {.world =
            [](World& w) {
              w.centre_x += 1.5;
              w.centre_y -= 2;
            }}},
      {"board_tilt",
       "x: 5 mrad, y: -3 mrad",
       {.world =
            [](World& w) {
              w.tilt_x = 5e-3;
              w.tilt_y = -3e-3;
            }}},
      {"rail_scale", "scale: 0.2 %", {.world = [](World& w) { w.scale = 1.002; }}},
      {"rail_offset", "offset: 5 mm", {.world = [](World& w) { w.offset = 5e-3; }}},
      {"motion", "displacement: 2 mm", {.displacement = 2e-3}},
  };
}

std::vector<Row> beam_rows() {
  return {
      {"source_amplitude", "ratio: 20 %", {.beam = [](Beam& b) { b.scale(1 + 0.1 * b.side()); }}},
      {"source_phase", "difference: 100 mrad", {.beam = [](Beam& b) { b.phasor *= std::polar(1.0, 0.05 * b.side()); }}},
      {"beam_profile",
       "exponent: 3, toe: 5 deg",
       {.beam =
            [](Beam& b) {
              const Vector3 axis{b.side() * std::sin(5 * degrees), 0, std::cos(5 * degrees)};
              b.scale(std::pow(-physics::dot(axis, b.to_source()), 3));
            }}},
      {"vignetting", "exponent: 4", {.beam = [](Beam& b) { b.scale(std::pow(b.spot.ray.z, 4)); }}},
      {"surface_reflectance",
       "lambert: 0.7, roughness: 0.4 rad",
       {.beam =
            [](Beam& b) {
              const double rough = oren_nayar(b, 0.4), cosine = physics::dot(b.to_source(), b.spot.normal);
              b.scale(b.world.physical ? rough : 0.3 + 0.7 * cosine * rough);
            }}},
      {"specular",
       "strength: 0.3, exponent: 40",
       {.beam =
            [](Beam& b) {
              const Vector3 half = b.to_source() - b.spot.ray;
              const double along = physics::dot(half, b.spot.normal) / physics::norm(half);
              b.scale(1 + 0.3 / b.spot.reflectivity * std::pow(along, 40));
            }}},
      {"multipath",
       "strength: 5 %, extra_path: 0.8 m",
       {.beam =
            [](Beam& b) {
              b.phasor += 0.05 * std::polar(b.strength, b.wave(b.path + b.spot.back + 0.8));
              b.strength *= 1.05;
            }}},
      {"rail_reflection",
       "strength: 4 %, height: 300 mm",
       {.beam =
            [](Beam& b) {
              const Vector3 image{b.source.x, 0.6 - b.source.y, b.source.z};
              b.phasor += 0.04 * std::polar(b.strength, b.wave(physics::norm(b.spot.at - image) + b.spot.back));
              b.strength *= 1.04;
            }}},
      {"warm_up",
       "drift: 10 mm, time_constant: 700 s, droop: 3 %",
       {.beam = [](Beam& b) { b.scale(1 - 0.03 * warm(700)); },
        .turn = [](const Light& l) { return l.radians(10e-3 * warm(700)); }}},
      {"stray_light",
       "fraction: 4 %, width: 30 px, uniform: 0.4",
       {.weights =
            [](std::size_t i) {
              double norm = 0;  // over an endless line
              for (int j = -200; j <= 200; ++j) norm += std::exp(-j * j / (2 * std::pow(30 / spacing, 2)));
              std::vector<double> weights = gaussian(i, 30);
              for (double& w : weights) w = 0.04 * (0.6 * w / (norm * norm) + 0.4 / pixels);
              weights[i] += 1;
              return weights;
            }}},
      {"mixed_pixels",
       "blur: 20 px",
       {.weights =
            [](std::size_t i) {
              std::vector<double> weights = gaussian(i, 20);
              double sum = 0;
              for (const double w : weights) sum += w;
              for (double& w : weights) w /= sum;
              return weights;
            }}},
      {"crosstalk", "real: 3000 counts/s, imaginary: -2000 counts/s", {.inside = {6, -4}}},  // in 2 ms
  };
}

std::vector<Row> phase_rows(const Files& files) {
  return {
      {"amplitude_walk",
       "logarithmic: 8 mrad, inverse: 3 mrad",
       {.turn = [](const Light& l) { return 8e-3 * std::log(l.amplitude / 1000) + 3e-3 * 1000 / l.amplitude; }}},
      {"modulation_frequency",
       "error: 500 ppm",
       {.turn = [](const Light& l) { return 500e-6 * l.radians(l.distance); }}},
      {"integration_time_offset",
       "slope: 8 mm, linear: 3 m/s",
       {.turn = [](const Light& l) { return l.radians(8e-3 * std::log(2.0) + 3 * 1e-3); }}},
      {"integration_time_offset",
       "table: " + files.table,  // 2 ms: a third of the way from 1 to 8 in the logarithm
       {.turn = [](const Light& l) { return l.radians(3e-3 + 2e-3 / 3); }}},
      {"fixed_pattern",
       "scale: 2, map: " + files.map("offsets") + ", slope_map: " + files.map("slopes"),
       {.turn =
            [&files](const Light& l) {
              return 2 *
                     l.radians(from_map(files.offsets, l.u, l.v) + from_map(files.slopes, l.u, l.v) * (l.distance - 2));
            }}},
  };
}

std::vector<Row> sample_rows() {
  return {
      {"wiggling",
       "amplitude: 9 mm, phase: 0.7 rad, amplitude5: 4 mm, phase5: -1.1 rad, amplitude7: -3 mm, phase7: 0.3 rad",
       {.sample =
            [](Sample& s) {
              const double m = 4 * pi * s.frequency / c_light * 1e-3 * s.amplitude, angle = s.phase + s.step;
              s.c +=
                  m * (9 * std::cos(3 * angle + 0.7) + 4 * std::cos(5 * angle - 1.1) - 3 * std::cos(7 * angle + 0.3));
            }}},
      {"even_harmonic",
       "ratio: 0.03",
       {.sample = [](Sample& s) { s.c += 0.03 * s.amplitude * std::cos(2 * (s.phase + s.step)); }}},
      {"phase_step_error",
       "step1: 10 mrad, step2: -4 mrad, step3: 7 mrad",
       {.sample =
            [](Sample& s) {
              const double errors[] = {0, 0.010, -0.004, 0.007};
              s.c = s.amplitude * std::cos(s.phase + s.step + (s.k < 4 ? errors[s.k] : 0));
            }}},
      {"phase_gain",
       "gain1: 1 %, gain2: -0.5 %, gain3: 0.25 %",
       {.sample =
            [](Sample& s) {
              const double gains[] = {1, 1.01, 0.995, 1.0025}, gain = s.k < 4 ? gains[s.k] : 1;
              s.c *= gain;
              s.intensity *= gain;
            }}},
  };
}

std::vector<Row> tap_rows(const Files& files) {
  return {
      {"tap_mismatch",
       "ratio: 4 %",
       {.taps =
            [](Taps& t) {
              t.a *= 1.02;
              t.b *= 0.98;
            }}},
      {"ambient_light",
       "rate: 2e5 counts/s",
       {.taps =
            [](Taps& t) {
              t.a += 200;
              t.b += 200;
            }}},
      {"ambient_light",
       "rate: 2e5 counts/s, suppression: 1000 counts",
       {.taps =
            [](Taps& t) {
              const double mean = (t.a + t.b) / 2 + 200, kept = std::min(mean, 1000.0), c = t.a - t.b;
              t.a = kept + c / 2;
              t.b = kept - c / 2;
            }}},
      {"pixel_response",
       "scale: 1, map: " + files.map("gains") + ", dark_map: " + files.map("dark") +
           ", dark_rate_map: " + files.map("rate"),
       {.taps =
            [&files](Taps& t) {
              const double dark = from_map(files.dark, t.u, t.v) + from_map(files.rate, t.u, t.v) * integration_time;
              for (double* tap : {&t.a, &t.b}) *tap = *tap * (1 + from_map(files.gains, t.u, t.v)) + dark;
            }}},
      {"adc_nonlinearity",
       "quadratic: 4 %, cubic: 3 %",
       {.taps =
            [](Taps& t) {
              for (double* tap : {&t.a, &t.b}) *tap -= 0.04 * *tap * *tap / 30000 + 0.03 * std::pow(*tap, 3) / 9e8;
            }}},
      {"saturation",
       "full_well: 1000 counts",
       {.taps =
            [](Taps& t) {
              t.a = std::min(t.a, 1000.0);
              t.b = std::min(t.b, 1000.0);
            }}},
      {"temporal_noise", "factor: 2.5", {.noise = 2.5}},
  };
}

std::vector<Row> all_rows(const Files& files) {
  std::vector<Row> all;
  for (const auto& part : {geometry_rows(), beam_rows(), phase_rows(files), sample_rows(), tap_rows(files)})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// The greatest difference, in parts of the mean of the pixel's two taps; what is not a number is endless.
double difference(const std::vector<double>& real, const std::vector<double>& wanted) {
  if (real.size() != wanted.size()) return std::numeric_limits<double>::infinity();
  double most = 0;
  for (std::size_t i = 0; i < real.size(); ++i) {
    const std::size_t a = i / (2 * pixels) * (2 * pixels) + i % pixels;
    const double part = std::abs(real[i] - wanted[i]) / ((wanted[a] + wanted[a + pixels]) / 2);
    if (!(part <= most)) most = std::isnan(part) ? std::numeric_limits<double>::infinity() : part;
  }
  return most;
}

std::set<std::string> catalogue_effects(const graph::PluginRegistry& catalogue) {
  std::set<std::string> names;
  for (const graph::PluginFile& file : catalogue.files()) {
    if (file.kind == "effect") names.insert(file.name);
  }
  return names;
}

/// What is said of image 3 is refused where there is none.
std::string parameters_of(const Row& row, const Exposures& exposures) {
  std::string parameters = row.parameters;
  for (const char* of_image_3 : {", step3", ", gain3"})
    if (exposures.size() < 4 && parameters.find(of_image_3) != std::string::npos)
      parameters.erase(parameters.find(of_image_3));
  return parameters;
}

TEST(AnyExposures, EveryEffectIsItsFormula) {
  const Files files;
  const std::vector<Row> rows = all_rows(files);
  for (const Exposures& exposures : many()) {
    const Camera camera(exposures);
    for (const bool physical : {true, false}) {
      SCOPED_TRACE(physics::exposures_text(exposures) + (physical ? ", physical" : ", reference"));
      const View view = view_of(camera, physical);
      const std::vector<double> ideal = by_formula({}, camera, physical);
      EXPECT_LT(difference(expected("", view).taps, ideal), 1e-9);
      for (const Row& row : rows) {
        const Expectation real = expected("{effect: " + row.effect + ", " + parameters_of(row, exposures) + "}", view);
        const std::vector<double> wanted = by_formula(row.formula, camera, physical);
        EXPECT_LT(difference(real.taps, wanted), 1e-9) << row.effect;
        EXPECT_EQ(real.noise_factor, row.formula.noise) << row.effect;
        // A formula that does nothing would say nothing.
        EXPECT_TRUE(row.formula.noise != 1 || difference(wanted, ideal) > 1e-6) << row.effect;
      }
    }
  }
}

TEST(AnyExposures, NoEffectIsLeftOut) {
  const Files files;
  std::set<std::string> tested;
  for (const Row& row : all_rows(files)) tested.insert(row.effect);
  EXPECT_EQ(tested, catalogue_effects(graph::PluginRegistry(graph::plugin_path({}))));
  EXPECT_EQ(tested.size(), 33);
}

/// All effects with their sizes off and their shapes at the usual values.
std::string all_off() {
  const graph::PluginRegistry catalogue(graph::plugin_path({}));
  std::ostringstream list;
  list.precision(17);
  for (const graph::PluginFile& file : catalogue.files()) {
    if (file.kind != "effect") continue;
    list << (list.tellp() > 0 ? ", " : "") << "{effect: " << file.name;
    const graph::Plugin& plugin = catalogue.load(file);
    for (std::size_t i = 0; i < plugin.parameter_count; ++i) {
      const tofgraph_parameter& p = plugin.own_parameters[i];
      const double value = std::isnan(p.off) ? p.typical : p.off;
      if (p.kind == TOFGRAPH_KIND_NUMBER && !std::isnan(value))
        list << ", " << p.name << ": " << value << " " << (p.unit == nullptr ? "" : p.unit);
    }
    list << "}";
  }
  return list.str();
}

TEST(AnyExposures, AllEffectsOffChangeNoBit) {
  const std::string off = all_off();
  ASSERT_NE(off.find("{effect: wiggling, amplitude: 0 m, phase: 1 rad"), std::string::npos) << off;
  ASSERT_NE(off.find("{effect: temporal_noise, factor: 1"), std::string::npos) << off;
  for (const Exposures& exposures : many()) {
    const Camera camera(exposures);
    for (const bool physical : {true, false}) {
      SCOPED_TRACE(physics::exposures_text(exposures) + (physical ? ", physical" : ", reference"));
      View view = view_of(camera, physical);
      view.pixels = whole_image(camera.view());  // with the edge's rays
      view.acquisition.condition.velocity = 0.1;
      const Expectation without = expected("", view), with = expected(off, view);
      EXPECT_EQ(with.noise_factor, 1);
      ASSERT_EQ(without.taps.size(), 2 * exposures.size() * view.pixels.size());
      EXPECT_TRUE(with.taps == without.taps);
    }
  }
}

// What three equal steps make of it.

/// The samples of the pixels: [image][pixel].
struct Samples {
  std::vector<std::vector<double>> c, intensity;
  const Camera* camera;

  /// (2/n) sum c_k e^(-j step) over the images of a frequency: equal steps.
  Complex phasor(std::size_t i, double frequency = own) const {
    Complex sum;
    double count = 0;
    for (std::size_t k = 0; k < c.size(); ++k) {
      if (camera->frequency(k) != frequency) continue;
      sum += c[k][i] * std::polar(1.0, -camera->exposures()[k].phase);
      ++count;
    }
    return 2 / count * sum;
  }
  double mean(std::size_t i) const {
    double sum = 0;
    for (const auto& image : c) sum += image[i];
    return sum / static_cast<double>(c.size());
  }
};

Samples samples(const std::string& list, const View& view, const Camera& camera) {
  const std::vector<double> taps = expected(list, view).taps;
  const std::size_t n = view.pixels.size();
  Samples result{{}, {}, &camera};
  for (std::size_t k = 0; k < camera.exposures().size(); ++k) {
    result.c.emplace_back(n);
    result.intensity.emplace_back(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double a = taps[2 * k * n + i], b = taps[(2 * k + 1) * n + i];
      result.c[k][i] = a - b;
      result.intensity[k][i] = (a + b) / 2;
    }
  }
  return result;
}

class ThreeSteps : public testing::Test {
 protected:
  Samples with(const std::string& list) const { return samples(list, view_of(camera_), camera_); }

  const Camera camera_{three()};
  const Samples ideal_ = with("");
};

double length_of(double ratio) { return ratio * c_light / (4 * pi * own); }  // m, of wiggling
std::string wiggles(int order, double ratio, double angle) {
  const std::string suffix = order == 3 ? "" : std::to_string(order);
  std::ostringstream list;
  list.precision(17);
  list << "{effect: wiggling, amplitude" << suffix << ": " << length_of(ratio) << " m, phase" << suffix << ": " << angle
       << " rad}";
  return list.str();
}

TEST_F(ThreeSteps, TheThirdHarmonicIsAnOffset) {
  // 3 * 120 deg is a whole turn: the same in all three.
  const Samples real = with(wiggles(3, 0.03, 0.7));
  const physics::PhaseDecoding decode(three(), own);
  for (std::size_t i = 0; i < pixels; ++i) {
    const Complex p = ideal_.phasor(i);
    const double a = std::abs(p), offset = 0.03 * a * std::cos(3 * std::arg(p) + 0.7);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(real.c[k][i] - ideal_.c[k][i], offset, 1e-9 * a);
    EXPECT_LT(std::abs(real.phasor(i) - p), 1e-9 * a);
    EXPECT_NEAR(real.mean(i), offset, 1e-9 * a);
    const auto before = decode({ideal_.c[0][i], ideal_.c[1][i], ideal_.c[2][i]}),
               after = decode({real.c[0][i], real.c[1][i], real.c[2][i]});
    EXPECT_NEAR(after.distance, before.distance, 1e-9);
    EXPECT_NEAR(after.amplitude, before.amplitude, 1e-9 * a);
  }
}

TEST_F(ThreeSteps, TheFifthAndSeventhHarmonicsAreTurnsInSixCycles) {
  // 5 * 120 deg is -120 deg: the conjugate; 7 * 120 deg is 120 deg.
  const double m = 0.01;
  const Samples fifth = with(wiggles(5, m, -1.1)), seventh = with(wiggles(7, m, 0.3));
  for (std::size_t i = 0; i < pixels; ++i) {
    const Complex p = ideal_.phasor(i);
    const double a = std::abs(p), psi = std::arg(p);
    EXPECT_LT(std::abs(fifth.phasor(i) - p - m * a * std::polar(1.0, -(5 * psi - 1.1))), 1e-9 * a);
    EXPECT_LT(std::abs(seventh.phasor(i) - p - m * a * std::polar(1.0, 7 * psi + 0.3)), 1e-9 * a);
    EXPECT_NEAR(fifth.mean(i), 0, 1e-9 * a);
    EXPECT_NEAR(seventh.mean(i), 0, 1e-9 * a);
    // To first order; the second is half of m^2.
    EXPECT_NEAR(std::arg(fifth.phasor(i) / p), -m * std::sin(6 * psi - 1.1), m * m);
    EXPECT_NEAR(std::abs(fifth.phasor(i)) / a - 1, m * std::cos(6 * psi - 1.1), m * m);
    EXPECT_NEAR(std::arg(seventh.phasor(i) / p), m * std::sin(6 * psi + 0.3), m * m);
    EXPECT_NEAR(std::abs(seventh.phasor(i)) / a - 1, m * std::cos(6 * psi + 0.3), m * m);
  }
}

TEST_F(ThreeSteps, TheSecondHarmonicIsATurnInThreeCycles) {
  // Four samples see it in N2 alone; 2 * 120 deg is -120 deg.
  const double m = 0.02;
  const Samples real = with("{effect: even_harmonic, ratio: 0.02}");
  for (std::size_t i = 0; i < pixels; ++i) {
    const Complex p = ideal_.phasor(i);
    const double a = std::abs(p), psi = std::arg(p);
    EXPECT_LT(std::abs(real.phasor(i) - p - m * a * std::polar(1.0, -2 * psi)), 1e-9 * a);
    EXPECT_NEAR(real.mean(i), 0, 1e-9 * a);
    EXPECT_NEAR(std::arg(real.phasor(i) / p), -m * std::sin(3 * psi), m * m);
  }
}

TEST_F(ThreeSteps, ErrorsOfStepsAndGainsAreTheirMeanAndTwoCycles) {
  const Samples stepped = with("{effect: phase_step_error, step1: 10 mrad, step2: -4 mrad}"),
                gained = with("{effect: phase_gain, gain1: 1 %, gain2: -0.5 %}");
  const double errors[] = {0, 0.010, -0.004}, gains[] = {0, 0.010, -0.005};
  for (std::size_t i = 0; i < pixels; ++i) {
    const Complex p = ideal_.phasor(i);
    const double psi = std::arg(p);
    double turned_by_steps = 0, turned_by_gains = 0, more = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double twice = 2 * (psi + static_cast<double>(k) * 2 * pi / 3);
      turned_by_steps += errors[k] * (1 - std::cos(twice)) / 3;
      turned_by_gains -= gains[k] * std::sin(twice) / 3;
      more += gains[k] * (1 + std::cos(twice)) / 3;
      EXPECT_NEAR(stepped.intensity[k][i], ideal_.intensity[k][i], 1e-9 * ideal_.intensity[k][i]);
      EXPECT_NEAR(gained.intensity[k][i], (1 + gains[k]) * ideal_.intensity[k][i], 1e-9 * ideal_.intensity[k][i]);
    }
    EXPECT_NEAR(std::arg(stepped.phasor(i) / p), turned_by_steps, 1e-4) << "to first order";
    EXPECT_NEAR(std::arg(gained.phasor(i) / p), turned_by_gains, 1e-4);
    EXPECT_NEAR(std::abs(gained.phasor(i) / p) - 1, more, 1e-4);
  }
}

TEST_F(ThreeSteps, TapsThatDifferAddTheLightToTheMean) {
  const Samples real = with("{effect: tap_mismatch, ratio: 4 %}"),
                lit = with("{effect: ambient_light, rate: 2e5 counts/s}");
  for (std::size_t i = 0; i < pixels; ++i) {
    const double light = ideal_.intensity[0][i];
    EXPECT_NEAR(real.mean(i), 0.04 * light, 1e-9 * light);
    EXPECT_LT(std::abs(real.phasor(i) - ideal_.phasor(i)), 1e-9 * light);
    EXPECT_LT(std::abs(lit.phasor(i) - ideal_.phasor(i)), 1e-9 * light);
    EXPECT_NEAR(lit.intensity[2][i], light + 200, 1e-9 * light);
  }
}

TEST_F(ThreeSteps, AConverterOfThirdOrderMakesNoErrorOfThePhase) {
  // A^2 - B^2 = 2 I c; A^3 - B^3 = 3 I^2 c + c^3/4, and c^3 has a first and a third harmonic: the third is an offset.
  const Samples real = with("{effect: adc_nonlinearity, quadratic: 10 %, cubic: 20 %}");
  const double fs = 30000;
  for (std::size_t i = 0; i < pixels; ++i) {
    const Complex p = ideal_.phasor(i);
    const double a = std::abs(p), light = ideal_.intensity[0][i];
    const double less = 0.1 * 2 * light / fs + 0.2 * (3 * light * light + 3 * a * a / 16) / (fs * fs);
    EXPECT_LT(std::abs(real.phasor(i) - (1 - less) * p), 1e-9 * a);
    EXPECT_NEAR(real.mean(i), -0.2 * a * a * a / 16 * std::cos(3 * std::arg(p)) / (fs * fs), 1e-9 * a);
  }
}

TEST(AnyExposures, AMovingSceneIsSeenElsewhereInEachImage) {
  for (const Exposures& exposures : {three(), nine()}) {
    const Camera camera(exposures);
    View view;
    view.camera = &camera.view();
    view.board = {1.2, 0, 0, 0.85, 0, 0.4};
    view.acquisition.moving = true;
    const Samples real = samples("", view, camera);
    view.acquisition.moving = false;
    const auto count = static_cast<double>(exposures.size());
    for (std::size_t k = 0; k < exposures.size(); ++k) {
      View there = view;  // 80 frames/s
      there.board.distance += 0.4 * static_cast<double>(k) / (count * 80);
      const Samples still = samples("", there, camera);
      for (std::size_t i = 0; i < pixels; ++i)
        EXPECT_NEAR(real.c[k][i], still.c[k][i], 1e-9 * still.intensity[k][i]) << k;
    }
  }
}

// Several frequencies.

TEST(SeveralFrequencies, ALengthIsAnotherAngleAndAnAngleIsNot) {
  constexpr double slow = 16e6, fast = 80e6;
  const Camera camera(steps({0, 120, 240}, {fast, slow}));
  View view = view_of(camera);
  view.acquisition.on = {false, true};  // one source: its phase is that of its path
  const Samples ideal = samples("", view, camera);
  const auto with = [&](const std::string& list) { return samples("{effect: " + list + "}", view, camera); };
  const Samples wiggling = with("wiggling, amplitude5: 5 mm, phase5: 0.4 rad"),
                multipath = with("multipath, strength: 5 %, extra_path: 0.8 m"),
                warm_up = with("warm_up, drift: 10 mm, time_constant: 700 s"),
                crystal = with("modulation_frequency, error: 500 ppm"),
                crosstalk = with("crosstalk, real: 3000 counts/s, imaginary: -2000 counts/s"),
                source = with("source_phase, difference: 100 mrad");
  for (const double f : {slow, fast}) {
    const double radians = 4 * pi * f / c_light;
    for (std::size_t i = 0; i < pixels; ++i) {
      const Complex p = ideal.phasor(i, f);
      const double a = std::abs(p);
      const auto turn = [&](const Samples& real) { return std::arg(real.phasor(i, f) / p); };
      EXPECT_LT(std::abs(wiggling.phasor(i, f) - p - 5e-3 * radians * a * std::polar(1.0, -(5 * std::arg(p) + 0.4))),
                1e-9 * a);
      const double delta = 2 * pi * f * 0.8 / c_light;
      EXPECT_NEAR(turn(multipath), std::atan2(0.05 * std::sin(delta), 1 + 0.05 * std::cos(delta)), 1e-9);
      EXPECT_NEAR(turn(warm_up), 10e-3 * warm(700) * radians, 1e-9);
      const World world;
      const Spot at = spot(world, view.pixels.at[2 * i], view.pixels.at[2 * i + 1]);
      const double path = physics::norm(at.at - world.sources[1]) + at.back;
      EXPECT_NEAR(turn(crystal), 500e-6 * radians * path / 2, 1e-9);
      EXPECT_LT(std::abs(crosstalk.phasor(i, f) - p - Complex(6, -4)), 1e-9 * a);
      EXPECT_NEAR(turn(source), 0.05, 1e-9);
    }
  }
}

// Images from 4 on.

TEST(Further, AreTheImagesFromFourOn) {
  const Camera camera(nine());
  const View view = view_of(camera);
  const Samples ideal = samples("", view, camera);
  const Samples stepped = samples(
      "{effect: phase_step_error, step1: 1 mrad, step2: 2 mrad, step3: 3 mrad, further: [4 mrad, 5 mrad, -6 mrad]}",
      view, camera);
  const Samples gained =
      samples("{effect: phase_gain, gain1: 1 %, gain2: 2 %, gain3: 3 %, further: [0.04, 0.05, -0.06, 0.07, 0.08]}",
              view, camera);
  const double errors[] = {0, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3, -6e-3, 0, 0};
  const double gains[] = {1, 1.01, 1.02, 1.03, 1.04, 1.05, 0.94, 1.07, 1.08};
  for (std::size_t k = 0; k < 9; ++k) {
    for (std::size_t i = 0; i < pixels; ++i) {
      const Complex p = ideal.phasor(i, camera.frequency(k));
      const double light = ideal.intensity[k][i];
      const double c = std::abs(p) * std::cos(std::arg(p) + nine()[k].phase + errors[k]);
      EXPECT_NEAR(stepped.c[k][i], c, 1e-9 * light) << k;
      EXPECT_NEAR(stepped.intensity[k][i], light, 1e-9 * light) << k;
      EXPECT_NEAR(gained.c[k][i], gains[k] * ideal.c[k][i], 1e-9 * light) << k;
      EXPECT_NEAR(gained.intensity[k][i], gains[k] * light, 1e-9 * light) << k;
    }
  }
}

TEST(Further, OfMoreImagesThanThereAreIsRefused) {
  const auto problem = [](const std::string& list, const Exposures& exposures) {
    const Camera camera(exposures);
    try {
      effects(list, camera.view());
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  const Exposures five = steps({10, 63, 150, 215, 301});
  for (const std::string effect : {"phase_step_error", "phase_gain"}) {
    const std::string unit = effect == "phase_gain" ? "" : " rad", begin = "{effect: " + effect + ", further: [";
    const std::string one = begin + "0.01" + unit + "]}", two = begin + "0.01" + unit + ", 0.02" + unit + "]}";
    EXPECT_EQ(problem(one, five), "none");
    EXPECT_EQ(problem(two, nine()), "none");
    EXPECT_NE(problem(two, five).find("has 2 values, but the camera takes 5 images"), std::string::npos)
        << problem(two, five);
    EXPECT_NE(problem(two, five).find("further"), std::string::npos);
    EXPECT_NE(problem(one, three()).find("has 1 values, but the camera takes 3 images"), std::string::npos)
        << problem(one, three());
    EXPECT_NE(problem(one, steps({0, 90, 180, 270})).find("takes 4 images"), std::string::npos);
  }
  for (const char* third : {"{effect: phase_step_error, step3: 1 mrad}", "{effect: phase_gain, gain3: 1 %}"})
    EXPECT_NE(problem(third, three()).find("is that of image 3, but the camera takes 3"), std::string::npos);
}

// Noise.

/// Equal steps at one frequency.
Exposures equal_steps(std::size_t count) {
  std::vector<double> angles(count);
  for (std::size_t k = 0; k < count; ++k) angles[k] = 360.0 * static_cast<double>(k) / static_cast<double>(count);
  return steps(angles);
}

using Images = std::vector<std::vector<double>>;

/// Images of what should be standard normal and independent of each other.
void expect_standard(const Images& images) {
  const auto n = static_cast<double>(images[0].size()), five_sigma = 5 / std::sqrt(n);
  for (std::size_t a = 0; a < images.size(); ++a) {
    double sum = 0;
    for (const double z : images[a]) sum += z;
    EXPECT_NEAR(sum / n, 0, five_sigma) << a;
    for (std::size_t b = 0; b <= a; ++b) {
      double product = 0;
      for (std::size_t i = 0; i < images[a].size(); ++i) product += images[a][i] * images[b][i];
      if (a == b)
        EXPECT_NEAR(product / n, 1, five_sigma * std::sqrt(2.0)) << a;
      else
        EXPECT_NEAR(product / n, 0, five_sigma) << a << " and " << b;
    }
  }
}

TEST(Noise, OfAllImagesIsIndependentAndAsGreatAsItShouldBe) {
  constexpr double read = 3, shot_noise = 0.012, factor = 2;
  for (const std::size_t count : {3, 5, 9, 32}) {
    SCOPED_TRACE(count);
    const Camera camera(equal_steps(count));
    const View view = view_of(camera);
    const Pixels all = whole_image(camera.view());
    const std::size_t n = all.size();
    const ForwardModel model(camera.view(), true, effects("{effect: temporal_noise, factor: 2}", camera.view()));
    const std::vector<double> mean = model.expect(view.tracer, view.acquisition, all).taps;
    const auto variance = [&](std::size_t at) { return factor * factor * (read * read + shot_noise * mean[at]); };
    Images by_samples, by_taps, whole;
    for (const std::uint32_t condition : {0U, 1U}) {
      for (const bool with_taps : {false, true}) {
        const Frames frames(model, view.tracer, view.acquisition, all, {read, shot_noise}, {7, condition}, with_taps);
        ASSERT_EQ(frames.exposures(), count);
        for (const std::uint64_t frame : {0U, 1U}) {
          std::vector<float> phases(count * n);
          frames.phases(frame, phases.data());
          for (std::size_t k = 0; k < count; ++k) {
            std::vector<double>& image = (with_taps ? by_taps : by_samples).emplace_back(n);
            for (std::size_t i = 0; i < n; ++i) {
              const std::size_t a = 2 * k * n + i, b = a + n;
              image[i] = (double{phases[k * n + i]} - (mean[a] - mean[b])) / std::sqrt(variance(a) + variance(b));
            }
          }
        }
        if (!with_taps || condition > 0) continue;
        std::vector<std::uint16_t> taps(2 * count * n);
        frames.taps(0, taps.data());
        for (std::size_t plane = 0; plane < 2 * count; ++plane) {
          std::vector<double>& image = whole.emplace_back(n);
          for (std::size_t i = 0; i < n; ++i) {
            const std::size_t at = plane * n + i;  // whole counts add 1/12
            image[i] = (static_cast<double>(taps[at]) - mean[at]) / std::sqrt(variance(at) + 1.0 / 12);
          }
        }
      }
    }
    expect_standard(by_samples);
    expect_standard(by_taps);
    expect_standard(whole);
  }
}

TEST(Frames, DecodeTheDistanceFromAnyExposures) {
  const std::vector<Exposures> sets = {steps({0, 90, 180, 270}, {30e6}), steps({0, 270, 180, 90}, {30e6}),
                                       steps({0, 120, 240}, {30e6}), nine(), three()};
  for (const Exposures& exposures : sets) {
    SCOPED_TRACE(physics::exposures_text(exposures));
    const Camera camera(exposures);
    const BoardPose board{1.3, 0, 0, 0.85};
    const Acquisition acquisition = acquisition_of(camera.view(), integration_time);
    const Pixels all = superpixels(camera.view(), side, side);
    const ForwardModel model(camera.view(), false, {});  // equal sources: the phase of their mean path
    const Frames frames(model, board_tracer(focal_length, board), acquisition, all, {}, {});
    std::vector<float> distance(pixels), amplitude(pixels);
    frames.distance(0, distance.data(), amplitude.data());
    for (std::size_t i = 0; i < pixels; i += 13) {
      const Hit& hit = frames.hits()[i];
      const double path =
          (physics::norm(hit.point - Vector3{-0.05, 0, 0}) + physics::norm(hit.point - Vector3{0.05, 0, 0})) / 2;
      const double wanted = (path + hit.return_path + focal_length / all.rays[i].z) / 2;
      EXPECT_NEAR(static_cast<double>(distance[i]), wanted, 1e-6);
    }
  }
}

}  // namespace
