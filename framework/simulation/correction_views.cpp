// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/correction_views.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph::simulation {
namespace {

bool known(double value) { return value > 0; }  // false for NaN

/// Surfaces at these distances that the pixel sees with this amplitude.
Views row_of(const CameraInverse& inverse, const Acquisition& acquisition, std::uint32_t pixel, double amplitude,
             const std::vector<double>& distances) {
  Views views;
  for (const double distance : distances) {
    views.pixel.push_back(pixel);
    views.return_path.push_back(inverse.return_path_at(pixel, distance));
    views.reflectivity.push_back(inverse.reflectivity_for(amplitude, distance, acquisition.condition.integration_time));
  }
  return views;
}

}  // namespace

Acquisition acquisition_for(const tofgraph_camera& camera, const FrameSettings& settings) {
  const double* valid = camera.integration_time;
  const double usual = known(valid[0]) && known(valid[1]) ? std::sqrt(valid[0] * valid[1]) : 1e-3;
  Acquisition acquisition =
      acquisition_of(camera, known(settings.integration_time) ? settings.integration_time : usual);
  tofgraph_condition& condition = acquisition.condition;
  if (known(settings.modulation_frequency)) condition.modulation_frequency = settings.modulation_frequency;
  condition.temperature = known(settings.temperature) ? settings.temperature : 298;
  condition.time_since_power_on = settings.time_since_power_on >= 0 ? settings.time_since_power_on : 3600;
  return acquisition;
}

Views some_views(const CameraInverse& inverse) {
  const tofgraph_camera& camera = inverse.camera();
  const Acquisition acquisition = acquisition_for(camera, {});
  const double range = inverse.range(acquisition);
  std::vector<double> distances;
  for (int i = 0; i < 9; ++i) distances.push_back(range * (0.06 + 0.1 * i));
  const std::uint32_t last = camera.width * camera.height - 1;
  Views all;
  for (const std::uint32_t pixel : {inverse.middle(), 0U, camera.width - 1, last - (camera.width - 1), last}) {
    if (std::isnan(inverse.pixels().rays[pixel].z)) continue;
    for (const double amplitude : {50.0, 2000.0}) {
      const Views row = row_of(inverse, acquisition, pixel, amplitude, distances);
      all.pixel.insert(all.pixel.end(), row.pixel.begin(), row.pixel.end());
      all.return_path.insert(all.return_path.end(), row.return_path.begin(), row.return_path.end());
      all.reflectivity.insert(all.reflectivity.end(), row.reflectivity.begin(), row.reflectivity.end());
    }
  }
  return all;
}

std::optional<Fold> first_fold(const CameraInverse& inverse, const Acquisition& acquisition) {
  constexpr std::size_t count = 400;
  const double range = inverse.range(acquisition), step = range / count;
  std::vector<double> distances;
  for (std::size_t i = 0; i < count; ++i) distances.push_back(0.1 + step * static_cast<double>(i));
  std::vector<bool> folded(count, true);
  for (const double amplitude : {100.0, 1000.0, 5000.0}) {
    const Views views = row_of(inverse, acquisition, inverse.middle(), amplitude, distances);
    const Measurements seen = inverse.measure(acquisition, views);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t low = std::min(i, count - 2);
      const double rise = std::remainder(seen.distance[low + 1] - seen.distance[low], range) / step;
      if (!(rise < 0.02)) folded[i] = false;
    }
  }
  const auto begin = std::ranges::find(folded, true);
  if (begin == folded.end()) return {};
  const auto end = std::find(begin, folded.end(), false);
  const auto at = [&](auto place) { return distances.front() + step * static_cast<double>(place - folded.begin()); };
  return Fold{at(begin), at(end)};
}

Pixels window(const Pixels& image, std::size_t rows, std::size_t columns) {
  Pixels part{rows, columns, image.spacing, {}, {}};
  const std::size_t top = (image.rows - rows) / 2, left = (image.columns - columns) / 2;
  for (std::size_t row = top; row < top + rows; ++row) {
    for (std::size_t column = left; column < left + columns; ++column) {
      const std::size_t i = row * image.columns + column;
      part.at.insert(part.at.end(), {image.at[2 * i], image.at[2 * i + 1]});
      part.rays.push_back(image.rays[i]);
    }
  }
  return part;
}

PhasorImage random_phasors(std::size_t size) {
  std::mt19937 random(1);  // fixed seed for reproducibility
  std::normal_distribution<double> normal;
  PhasorImage image(size);
  for (std::complex<double>& value : image) value = {normal(random), normal(random)};
  return image;
}

double norm_of(const PhasorImage& image) {
  double sum = 0;
  for (const std::complex<double>& value : image) sum += std::norm(value);
  return std::sqrt(sum);
}

PhasorImage look(const CameraInverse& inverse, const Acquisition& acquisition, const Pixels& pixels,
                 const PhasorImage& light) {
  const double range = inverse.range(acquisition), time = acquisition.condition.integration_time;
  constexpr double nearest = 0.3;  // m: smaller distances are moved one range farther
  const Tracer tracer = [&](const BoardChange&, std::span<const Vector3> rays, std::span<Hit> hits) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const double turns = std::arg(light[i]) / physics::two_pi, amplitude = std::abs(light[i]);
      double distance = range * (turns < 0 ? turns + 1 : turns);
      if (distance < nearest) distance += range;
      if (!(amplitude > 0) || std::isnan(rays[i].z)) continue;
      const double path = inverse.return_path_on(rays[i], distance);
      hits[i] = {path,       inverse.point_on(rays[i], path),
                 {0, 0, -1}, inverse.reflectivity_for(amplitude, distance, time),
                 0,          nullptr};
    }
  };
  const Measurements seen = inverse.measure_image(acquisition, tracer, pixels);
  PhasorImage result(light.size());
  for (std::size_t i = 0; i < light.size(); ++i)
    result[i] = std::polar(seen.amplitude[i], physics::two_pi * seen.distance[i] / range);
  return result;
}

}  // namespace tofgraph::simulation
