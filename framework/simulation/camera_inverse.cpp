// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/camera_inverse.hpp"

#include <tofgraph/physics/four_phase.hpp>
#include <tofgraph/physics/non_linearity.hpp>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace tofgraph::simulation {
namespace {

/// Number of points that fit into the processor's cache.
constexpr std::size_t chunk = 2048;

/// Quasi-Newton (Broyden) iteration for one pixel: x = (distance, ln reflectivity), with the measured (distance,
/// ln amplitude) as target. Distances are in units of 1 m, so that both are of the same order.
struct Broyden {
  std::array<double, 2> x{}, rest{}, step{};
  std::array<double, 4> inverse{1, 0, 0, 1};  // of the Jacobian, row-major

  void take(const std::array<double, 2>& now) {
    if (step[0] != 0 || step[1] != 0) update({rest[0] - now[0], rest[1] - now[1]});
    rest = now;
    for (std::size_t i = 0; i < 2; ++i) step[i] = inverse[2 * i] * rest[0] + inverse[2 * i + 1] * rest[1];
    step[0] = std::clamp(step[0], -max_step, max_step);
    step[1] = std::clamp(step[1], -max_step, max_step);
    for (std::size_t i = 0; i < 2; ++i) x[i] += step[i];
  }
  bool is_settled() const { return std::abs(rest[0]) < 2e-8 && std::abs(rest[1]) < 1e-6; }

 private:
  static constexpr double max_step = 2;  // m, or a factor of 7

  /// "Good" Broyden update. @param change observed change of the measurement by the last step
  void update(const std::array<double, 2>& change) {
    const double u = inverse[0] * change[0] + inverse[1] * change[1];
    const double v = inverse[2] * change[0] + inverse[3] * change[1];
    const double scale = step[0] * u + step[1] * v;
    if (!(std::abs(scale) > 1e-300)) return;
    const double row0 = step[0] * inverse[0] + step[1] * inverse[2], row1 = step[0] * inverse[1] + step[1] * inverse[3];
    const double du = (step[0] - u) / scale, dv = (step[1] - v) / scale;
    inverse = {inverse[0] + du * row0, inverse[1] + du * row1, inverse[2] + dv * row0, inverse[3] + dv * row1};
  }
};

}  // namespace

CameraInverse::CameraInverse(const tofgraph_camera& camera, bool physical, const std::vector<EffectPtr>& effects)
    : real_(camera, physical, effects, 1),
      ideal_(camera, physical, {}, 1),
      geometry_(physics::geometry_of(camera)),
      pixels_(whole_image(camera)),
      exposures_(physics::exposures_of(camera)) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    if (std::isnan(pixels_.rays[i].z)) continue;
    const double away = std::hypot(pixels_.at[2 * i] - 0.5 * camera.width, pixels_.at[2 * i + 1] - 0.5 * camera.height);
    if (away >= nearest) continue;
    nearest = away;
    middle_ = static_cast<std::uint32_t>(i);
  }
  if (!std::isfinite(nearest))
    throw std::invalid_argument(std::string("no pixel of the camera '") + camera.name + "' lies within its lens model");
}

Measurements CameraInverse::measure(const Acquisition& acquisition, const Views& views, bool with_effects) const {
  Measurements all{std::vector<double>(views.size()), std::vector<double>(views.size())};
  const ForwardModel& model = with_effects ? real_ : ideal_;
  const std::size_t chunks = (views.size() + chunk - 1) / chunk;
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    const std::size_t first = c * chunk, count = std::min(chunk, views.size() - first);
    Pixels some{1, count, 1, {}, {}};
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t pixel = views.pixel[first + i];
      some.at.insert(some.at.end(), {pixels_.at[2 * pixel], pixels_.at[2 * pixel + 1]});
      some.rays.push_back(pixels_.rays[pixel]);
    }
    const Tracer tracer = [&](const BoardChange&, std::span<const Vector3> rays, std::span<Hit> hits) {
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const double path = views.return_path[first + i];
        hits[i] = {path,       physics::point_on_ray(geometry_, rays[i], path),
                   {0, 0, -1}, views.reflectivity[first + i],
                   0,          nullptr};
      }
    };
    const Measurements part = measure(model, acquisition, tracer, some);
    const auto to = static_cast<std::ptrdiff_t>(first);
    std::ranges::copy(part.distance, all.distance.begin() + to);
    std::ranges::copy(part.amplitude, all.amplitude.begin() + to);
  });
  return all;
}

Measurements CameraInverse::measure_image(const Acquisition& acquisition, const Tracer& tracer,
                                          const Pixels& pixels) const {
  return measure(real_, acquisition, tracer, pixels);
}

Measurements CameraInverse::measure(const ForwardModel& model, const Acquisition& acquisition, const Tracer& tracer,
                                    const Pixels& pixels) const {
  Expectation expectation = model.expect(tracer, acquisition, pixels);
  if (model.has_readout()) model.read_out(acquisition, pixels, expectation.taps);
  return decode(acquisition, expectation.taps, pixels.size());
}

Measurements CameraInverse::decode(const Acquisition& acquisition, std::span<const double> taps,
                                   std::size_t pixels) const {
  Measurements result{std::vector<double>(pixels), std::vector<double>(pixels)};
  const double own = acquisition.condition.modulation_frequency;
  const auto sample = [&](std::size_t k, std::size_t i) {
    return taps[2 * k * pixels + i] - taps[(2 * k + 1) * pixels + i];
  };
  if (physics::are_the_four(exposures_)) {
    const double scale = physics::metres_per_radian(exposures_[0].frequency > 0 ? exposures_[0].frequency : own);
    for (std::size_t i = 0; i < pixels; ++i) {
      const physics::Decoded decoded = physics::decode({sample(0, i), sample(1, i), sample(2, i), sample(3, i)});
      result.distance[i] = scale * decoded.phase;
      result.amplitude[i] = decoded.amplitude;
    }
    return result;
  }
  const physics::PhaseDecoding decoding(exposures_, own);
  std::vector<double> samples(exposures_.size());
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t k = 0; k < samples.size(); ++k) samples[k] = sample(k, i);
    const auto decoded = decoding(samples);
    result.distance[i] = decoded.distance;
    result.amplitude[i] = decoded.amplitude;
  }
  return result;
}

double CameraInverse::range(const Acquisition& acquisition) const {
  return physics::PhaseDecoding(exposures_, acquisition.condition.modulation_frequency).range();
}

double CameraInverse::reflectivity_for(double amplitude, double distance, double integration_time) const {
  return amplitude * 4 * distance * distance / (camera().gain * integration_time);
}

double CameraInverse::return_path_on(Vector3 ray, double distance) const {
  constexpr double nearest = 1e-4;
  double path = std::max(nearest, distance);
  for (int i = 0; i < 4; ++i) {  // strictly increasing and convex: Newton from far away converges monotonically
    const double slope = ray.z / physics::optimized_bistatic_slope(geometry_, ray, path);
    path = std::max(nearest, path - (physics::distance_at(geometry_, ray, path) - distance) / slope);
  }
  return path;
}

std::vector<Undone> CameraInverse::solve(const Acquisition& acquisition, std::span<const Measured> measured) const {
  const double range = this->range(acquisition), time = acquisition.condition.integration_time;
  std::vector<Broyden> solvers(measured.size());
  std::vector<std::uint32_t> open(measured.size());
  std::iota(open.begin(), open.end(), 0U);
  std::erase_if(open, [&](std::uint32_t i) { return std::isnan(pixels_.rays[measured[i].pixel].z); });
  for (const std::uint32_t i : open)
    solvers[i].x = {measured[i].guess, std::log(reflectivity_for(measured[i].amplitude, measured[i].guess, time))};
  std::vector<Undone> result(measured.size(), {std::numeric_limits<double>::quiet_NaN(), false});
  const auto views_of = [&](const std::vector<std::uint32_t>& some) {
    Views views{{}, std::vector<double>(some.size()), std::vector<double>(some.size())};
    for (const std::uint32_t i : some) views.pixel.push_back(measured[i].pixel);
    tbb::parallel_for(std::size_t{0}, some.size(), [&](std::size_t j) {
      views.return_path[j] = return_path_at(views.pixel[j], solvers[some[j]].x[0]);
      views.reflectivity[j] = std::exp(solvers[some[j]].x[1]);
    });
    return views;
  };
  std::vector<std::uint32_t> settled;
  constexpr int max_steps = 25, only_light = 3;
  constexpr double max_change = 2;  // a factor of 7
  for (int step = 0; step < max_steps && !open.empty(); ++step) {
    const Measurements now = measure(acquisition, views_of(open));
    std::vector<std::uint32_t> still;
    for (std::size_t j = 0; j < open.size(); ++j) {
      Broyden& solver = solvers[open[j]];
      const Measured& wanted = measured[open[j]];
      const std::array<double, 2> x = solver.x;
      const std::array<double, 2> rest = {std::remainder(wanted.distance - now.distance[j], range),
                                          std::log(wanted.amplitude / now.amplitude[j])};
      if (!std::isfinite(rest[0]) || !std::isfinite(rest[1])) continue;
      if (step < only_light && std::abs(rest[1]) > 0.01) {  // too large an amplitude error misleads the distance
        solver.x[1] += std::clamp(rest[1], -max_change, max_change);
        still.push_back(open[j]);
        continue;
      }
      solver.take(rest);
      if (std::abs(solver.x[0] - wanted.guess) > range / 3) continue;  // a different solution, ranges away
      if (!solver.is_settled()) {
        still.push_back(open[j]);
        continue;
      }
      solver.x = x;
      settled.push_back(open[j]);
    }
    open = std::move(still);
  }
  // Measurement of the camera without effects: at short distances not exactly the mean path.
  const Views views = views_of(settled);
  const Measurements ideal = measure(acquisition, views, false);
  for (std::size_t j = 0; j < settled.size(); ++j) {
    const double near = solvers[settled[j]].x[0];
    result[settled[j]] = {near + std::remainder(ideal.distance[j] - near, range), true};
  }
  return result;
}

}  // namespace tofgraph::simulation
