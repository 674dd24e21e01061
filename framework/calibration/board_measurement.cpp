// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/board_measurement.hpp"

#include "io/light_sources.hpp"
#include "simulation/files/pose.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/non_linearity.hpp>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tofgraph::calibration {

using physics::Vector3;

physics::Plane plane_of(const io::Condition& c) {
  physics::Plane plane = physics::board(c.board_distance, c.board_tilt_x, c.board_tilt_y);
  plane.normal = simulation::rotation(0, 0, -c.roll) * plane.normal;
  return plane;
}

std::array<double, 2> on_board(const io::Condition& c, Vector3 point) {
  const Vector3 p = simulation::rotation(0, 0, c.roll) * point - Vector3{0, 0, c.board_distance};
  const double cy = std::cos(c.board_tilt_y), sy = std::sin(c.board_tilt_y);
  const double x = cy * p.x - sy * p.z, z = sy * p.x + cy * p.z;
  return {x, std::cos(c.board_tilt_x) * p.y + std::sin(c.board_tilt_x) * z};
}

UnusablePixels& UnusablePixels::operator+=(const UnusablePixels& other) {
  for (std::size_t UnusablePixels::*count :
       {&UnusablePixels::pixels, &UnusablePixels::map, &UnusablePixels::invalid, &UnusablePixels::saturated,
        &UnusablePixels::amplitude, &UnusablePixels::noisy, &UnusablePixels::distance, &UnusablePixels::wrapped})
    this->*count += other.*count;
  return *this;
}

std::string UnusablePixels::described() const {
  const std::pair<std::size_t, const char*> reasons[] = {
      {map, "bad in the profile's map"},
      {invalid, "without a valid number"},
      {saturated, "saturated"},
      {amplitude, "with another amplitude than their neighbours (dead, stuck or without modulation)"},
      {noisy, "noisier than their neighbours"},
      {distance, "with another distance than their neighbours"},
      {wrapped, "wrapped"}};
  std::string text;
  for (const auto& [count, reason] : reasons)
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, reason);
  return text;
}

Moments moments_of(const std::vector<double>& values) {
  if (values.empty()) return {};
  Moments m{0, 0};
  for (const double v : values) m.mean += v / static_cast<double>(values.size());
  for (const double v : values) m.sd += (v - m.mean) * (v - m.mean);
  m.sd = values.size() > 1 ? std::sqrt(m.sd / static_cast<double>(values.size() - 1)) : unknown;
  return m;
}

/// Pixels of the window with their rays, and the ideal measurement of the board.
struct BoardModel::Places {
  std::vector<Vector3> rays;
  std::vector<double> true_path, true_depth, modelled;  ///< D_ref(T), T, D(T)

  /// Values of some of the pixels. @param chosen indices of the vectors
  Places part(const std::vector<std::size_t>& chosen) const {
    return {chosen_of(rays, chosen), chosen_of(true_path, chosen), chosen_of(true_depth, chosen),
            chosen_of(modelled, chosen)};
  }
  template <class T>
  static std::vector<T> chosen_of(const std::vector<T>& all, const std::vector<std::size_t>& chosen) {
    std::vector<T> some;
    for (const std::size_t i : chosen) some.push_back(all[i]);
    return some;
  }
};

namespace {

/// Limit of a pixel's deviation from the median depth in the reference's tables, m. Inferred: where the measured
/// standard deviation exceeds 12 mm, that of the corrected depth stays below 11.5 mm, the value of a uniform
/// distribution 40 mm wide, and the mean of Ms.D + O.M differs from that of O.C.D.
constexpr double printed_reach = 20e-3;

/// Indices of the values within `reach` of their median; all if the reach is infinite or some are NaN.
std::vector<std::size_t> near_median(const std::vector<double>& values, double reach) {
  const bool whole = std::isinf(reach) || std::ranges::any_of(values, [](double v) { return std::isnan(v); });
  const double middle = whole ? 0 : physics::median(std::vector(values));
  std::vector<std::size_t> near;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (whole || std::abs(values[i] - middle) <= reach) near.push_back(i);
  }
  return near;
}

physics::Geometry geometry_with(const tofgraph_camera& camera, const std::vector<std::string>& sources) {
  tofgraph_camera some = camera;
  const std::vector<tofgraph_light> lights = io::lights_named(camera, sources);
  some.lights = lights.data();
  some.light_count = lights.size();
  return physics::geometry_of(some);
}

}  // namespace

BoardModel::BoardModel(const tofgraph_camera& camera, io::OffsetVariant variant,
                       const std::vector<std::string>& sources)
    : camera_(camera), geometry_(geometry_with(camera, sources)), variant_(variant) {
  const std::size_t pixels = std::size_t{camera.width} * camera.height;
  for (std::size_t i = 0; i < pixels; ++i) rays_.push_back(physics::unit_ray(camera.rays + 3 * i));
}

std::vector<std::size_t> BoardModel::window(const io::Condition& c) const {
  const io::Roi roi = c.roi.value_or(io::Roi{0, camera_.width - 1, 0, camera_.height - 1});
  const physics::Plane plane = plane_of(c);
  std::vector<std::size_t> pixels;
  for (std::size_t v = roi.first_row; v <= roi.last_row; ++v) {
    for (std::size_t u = roi.first_column; u <= roi.last_column; ++u) {
      const std::size_t i = v * camera_.width + u;
      const double path = physics::reflected_path(geometry_, rays_[i], plane);
      if (!std::isfinite(path)) continue;
      const auto [x, y] = on_board(c, physics::point_on_ray(geometry_, rays_[i], path));
      const bool inside =
          !c.board_size || (std::abs(x) < (*c.board_size)[0] / 2 && std::abs(y) < (*c.board_size)[1] / 2);
      if (inside) pixels.push_back(i);
    }
  }
  return pixels;
}

BoardModel::Places BoardModel::places(const io::Condition& c, const std::vector<std::size_t>& pixels) const {
  Places p;
  const physics::Plane plane = plane_of(c);
  for (const std::size_t i : pixels) {
    p.rays.push_back(rays_[i]);
    p.true_path.push_back(physics::reflected_path(geometry_, rays_[i], plane));
    p.true_depth.push_back(physics::depth_of(geometry_, rays_[i], p.true_path.back()));
    p.modelled.push_back(physics::distance_at(geometry_, rays_[i], p.true_path.back()));
  }
  return p;
}

std::vector<double> BoardModel::modelled(const io::Condition& c, const std::vector<std::size_t>& pixels) const {
  return places(c, pixels).modelled;
}

double BoardModel::angle(std::size_t pixel) const {
  const Vector3 ray = rays_[pixel];
  return (ray.x * ray.x + ray.y * ray.y) / (ray.z * ray.z);
}

/// (6.4) to (6.7). @param measured D_mes of each pixel
void BoardModel::remodel(Board& board, const Places& p, const std::vector<double>& measured) const {
  const double shift = -board.error();  // D_avg - T
  std::vector<double> again, offset, corrected, final;
  double square = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const double path = p.true_path[i] + shift / p.rays[i].z;
    // In the printed variant the reflected path of every pixel increases by the change of the depth.
    const double excess = variant_ == io::OffsetVariant::printed ? (shift - shift / p.rays[i].z) / 2 : 0;
    again.push_back(physics::distance_at(geometry_, p.rays[i], path) + excess);
    offset.push_back(p.modelled[i] - again.back());
    corrected.push_back(measured[i] + offset.back());
    final.push_back(physics::depth_of(geometry_, p.rays[i],
                                      physics::optimized_bistatic_newton(geometry_, p.rays[i], corrected.back())));
    square += (corrected.back() - p.modelled[i]) * (corrected.back() - p.modelled[i]);
  }
  board.modelled = moments_of(p.modelled);
  board.remodelled = moments_of(again);
  board.offset = moments_of(offset);
  board.offset_corrected = moments_of(corrected);
  board.final = moments_of(final);
  board.rmse = std::sqrt(square / static_cast<double>(measured.size()));
}

Board BoardModel::measure(const io::Condition& condition, const MeanImages& images) const {
  Board board{.condition = condition,
              .frames = images.frames,
              .pixels = static_cast<double>(images.pixels.size()),
              .noise = images.noise,
              .saturated = images.saturated,
              .shows_saturation = images.shows_saturation};
  const Places p = places(condition, images.pixels);
  std::vector<double> depth, levels, angles;
  for (std::size_t i = 0; i < images.pixels.size(); ++i) {
    const double d = images.distance[i];
    depth.push_back(
        physics::depth_of(geometry_, p.rays[i], physics::optimized_bistatic_newton(geometry_, p.rays[i], d)));
    if (images.amplitude.empty() || !(images.amplitude[i] > 0)) continue;
    levels.push_back(std::log(images.amplitude[i] * 4 * d * d / (camera_.gain * condition.integration_time)));
    angles.push_back(angle(images.pixels[i]));
  }
  board.measured = moments_of(images.distance);
  const bool printed = variant_ == io::OffsetVariant::printed;
  const std::vector<std::size_t> used =
      near_median(depth, printed ? printed_reach : std::numeric_limits<double>::infinity());
  board.corrected = moments_of(Places::chosen_of(depth, used));
  const bool tilted = condition.board_tilt_x != 0 || condition.board_tilt_y != 0;
  board.distance = tilted ? std::round(moments_of(p.true_depth).mean * 1e6) * 1e-6 : condition.board_distance;
  board.depth_sd = board.corrected.sd / std::sqrt(board.pixels);
  remodel(board, p.part(used), Places::chosen_of(images.distance, used));
  if (levels.empty()) return board;
  board.amplitude = moments_of(images.amplitude).mean;
  FalloffSums& f = board.falloff;
  f.count = static_cast<double>(levels.size());
  f.level = moments_of(levels).mean;
  for (const double q : angles) {
    f.q += q / f.count;
    f.q2 += q * q / f.count;
  }
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const double a = angles[i] - f.q, b = angles[i] * angles[i] - f.q2, level = levels[i] - f.level;
    f.square = {f.square[0] + a * a, f.square[1] + a * b, f.square[2] + b * b};
    f.product = {f.product[0] + a * level, f.product[1] + b * level};
  }
  board.reflectivity = std::exp(f.level);
  return board;
}

/// Depth of a perpendicular board with this mean distance over the window, by fixed-point iteration.
double BoardModel::depth_of_mean(const std::vector<std::size_t>& pixels, double distance, double start) const {
  double z = start;
  for (int step = 0; step < 50; ++step) {
    double mean = 0;
    for (const std::size_t i : pixels)
      mean += physics::distance_at_depth(geometry_, rays_[i], z) / static_cast<double>(pixels.size());
    z += distance - mean;  // the slope of the mean distance is nearly 1
    if (std::abs(distance - mean) < 1e-9) break;
  }
  return z;
}

Board BoardModel::measure(const io::Condition& condition) const {
  const io::Measured& m = condition.measured;
  const std::vector<std::size_t> pixels = window(condition);
  Board board{.condition = condition, .frames = 1, .pixels = static_cast<double>(pixels.size())};
  board.distance = condition.board_distance;
  board.corrected = {m.depth, m.depth_sd};
  if (!std::isfinite(m.depth)) board.corrected.mean = depth_of_mean(pixels, m.distance, board.distance);
  const Places p = places(condition, pixels);
  std::vector<double> distance;
  double slope = 0;
  for (const std::size_t i : pixels) {
    distance.push_back(physics::distance_at_depth(geometry_, rays_[i], board.corrected.mean));
    slope += (physics::distance_at_depth(geometry_, rays_[i], board.corrected.mean + 1e-3) - distance.back()) / 1e-3;
  }
  if (!std::isfinite(distance.front())) throw std::invalid_argument("the measured depth is behind the lens");
  remodel(board, p, distance);
  board.measured.mean = std::isfinite(m.distance) ? m.distance : moments_of(distance).mean;
  board.offset_corrected = {board.measured.mean + board.offset.mean, unknown};
  board.final.sd = board.corrected.sd;  // the offset is smooth: the noise is unchanged
  const double in_distance = board.corrected.sd * slope / board.pixels;
  board.rmse = std::hypot(board.rmse, in_distance);
  const double independent = std::isfinite(m.count) ? std::min(m.count, board.pixels) : board.pixels;
  board.depth_sd = m.depth_sd / std::sqrt(std::max(independent, 1.0));
  board.amplitude = m.amplitude;
  const double path = 2 * board.measured.mean;
  board.reflectivity = m.amplitude * path * path / (camera_.gain * condition.integration_time);
  if (!std::isfinite(m.amplitude)) board.reflectivity = condition.reflectivity;
  return board;
}

BoardModels::BoardModels(const tofgraph_camera& camera, io::OffsetVariant variant,
                         const std::vector<io::Condition>& conditions) {
  models_.try_emplace({}, camera, variant);
  for (const io::Condition& c : conditions) models_.try_emplace(c.sources, camera, variant, c.sources);
}

std::array<double, 2> fit_falloff(const std::vector<Board>& boards) {
  std::array<double, 3> a{};
  std::array<double, 2> b{};
  double count = 0;
  for (const Board& board : boards) {
    for (std::size_t i = 0; i < 3; ++i) a[i] += board.falloff.square[i];
    for (std::size_t i = 0; i < 2; ++i) b[i] += board.falloff.product[i];
    count += board.falloff.count;
  }
  constexpr double narrow = 0.02;  // minimum spread of tan^2 for a fit
  if (!(std::sqrt(a[0] / std::max(count, 1.0)) > narrow)) return {};
  const double determinant = a[0] * a[2] - a[1] * a[1];
  if (!(determinant > 1e-6 * a[0] * a[2])) return {b[0] / a[0], 0};
  return {(a[2] * b[0] - a[1] * b[1]) / determinant, (a[0] * b[1] - a[1] * b[0]) / determinant};
}

}  // namespace tofgraph::calibration
