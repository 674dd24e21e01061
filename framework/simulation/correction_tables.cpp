// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Corrections compiled into tables.
#include "simulation/correction_views.hpp"
#include "simulation/cross_approximation.hpp"

#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::simulation {
namespace {

constexpr std::size_t nodes_per_range = 256;
constexpr double closest = 0.25;  // m: smaller distances are interpreted as beyond the range

/// Amplitudes from the noise level to full taps: tap = amplitude (1 / (2 contrast) + 1 / 2) at most.
void choose_amplitudes(const tofgraph_camera& camera, CorrectionTables& tables) {
  constexpr double weakest = 8, largest = 65536, medium = 1024;
  const double full = camera.full_well * 2 * camera.contrast / (1 + camera.contrast);
  const double strongest = full > 2 * weakest ? full : largest;
  tables.weakest = tables.strongest = tables.needs.amplitude ? weakest : medium;
  for (tables.amplitudes = 1; tables.needs.amplitude && tables.strongest < strongest; ++tables.amplitudes)
    tables.strongest = node_amplitude(tables, tables.amplitudes);
}

void store(const Products& products, const std::vector<double>& factors, std::size_t pixels, CorrectionTables& tables) {
  const std::size_t rank = products.nodes.size(), corners = tables.corners.size();
  while (tables.lanes < rank + 1) tables.lanes *= 2;
  tables.pixels.assign(pixels * tables.lanes, 0);
  for (std::size_t p = 0; p < pixels; ++p)
    for (std::size_t r = 0; r < rank; ++r)
      tables.pixels[p * tables.lanes + r] = static_cast<float>(products.pixels[r][p]);
  const std::size_t each = factors.size() / corners;
  for (std::size_t c = 0; c < corners; ++c) {
    std::vector<float>& nodes = tables.corners[c];
    nodes.assign(each * tables.lanes, 0);
    for (std::size_t i = 0; i < each; ++i) {
      for (std::size_t r = 0; r < rank; ++r)
        nodes[i * tables.lanes + r] = static_cast<float>(products.nodes[r][c * each + i]);
      nodes[i * tables.lanes + tables.lanes - 1] = static_cast<float>(factors[c * each + i]);
    }
  }
}

/// Excess of the measured distance at the end of the range, m, for each amplitude; it may be large for weak
/// light.
std::vector<float> shifts_of(const CameraInverse& inverse, const Nodes& nodes, const CorrectionTables& tables,
                             const Acquisition& acquisition) {
  const double end = tables.first + tables.range, time = acquisition.condition.integration_time;
  const std::size_t count = tables.amplitudes;
  Views views{std::vector<std::uint32_t>(count, inverse.middle()),
              std::vector<double>(count, inverse.return_path_at(inverse.middle(), end)),
              {}};
  for (std::size_t a = 0; a < count; ++a)
    views.reflectivity.push_back(inverse.reflectivity_for(nodes.amplitude(a * tables.distances), end, time));
  Measurements seen;
  constexpr int steps = 8;
  for (int step = 0; step < steps; ++step) {
    seen = inverse.measure(acquisition, views);
    for (std::size_t a = 0; a < count; ++a)
      views.reflectivity[a] *= std::clamp(nodes.amplitude(a * tables.distances) / seen.amplitude[a], 0.5, 2.0);
  }
  std::vector<float> shifts;
  for (const double distance : seen.distance)
    shifts.push_back(static_cast<float>(std::remainder(distance - end, tables.range)));
  return shifts;
}

/// Change of distances between two values of a setting, m.
struct Drift {
  double change = 0, bend = 0;  ///< maximum from end to end; maximum deviation from linear at the midpoint
};
Drift drift_of(const CameraInverse& inverse, const Views& views, const Acquisition& usual,
               double tofgraph_condition::*what, double first, double last) {
  Acquisition acquisition = usual;
  std::array<Measurements, 3> seen;
  const std::array<double, 3> values = {first, (first + last) / 2, last};
  for (std::size_t i = 0; i < values.size(); ++i) {
    acquisition.condition.*what = values[i];
    seen[i] = inverse.measure(acquisition, views);
  }
  const double range = inverse.range(acquisition);
  Drift drift;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double before = std::remainder(seen[0].distance[i] - seen[1].distance[i], range);
    const double after = std::remainder(seen[2].distance[i] - seen[1].distance[i], range);
    drift.change = std::max(drift.change, std::abs(after - before));
    drift.bend = std::max(drift.bend, std::abs(before + after) / 2);
  }
  return drift;
}

}  // namespace

bool CorrectionTables::covers(const FrameSettings& settings) const {
  const auto within = [](double value, const std::array<double, 2>& range) {
    return value >= range[0] && value <= range[1];
  };
  const bool same_frequency =
      !(settings.modulation_frequency > 0) || settings.modulation_frequency == modulation_frequency;
  return same_frequency && (!needs.integration_time || settings.integration_time == integration_time) &&
         (!needs.time_since_power_on || within(settings.time_since_power_on, ends[0])) &&
         (!needs.temperature || within(settings.temperature, ends[1]));
}

std::shared_ptr<const std::vector<float>> CorrectionTables::nodes_at(const FrameSettings& settings) const {
  if (corners.size() == 1) return {shared_from_this(), &corners.front()};
  const std::array<double, 2> values = {settings.time_since_power_on, settings.temperature};
  Mixed now{{0, 0}, nullptr};
  std::vector<double> weights = {1};
  for (std::size_t axis = 0; axis < values.size(); ++axis) {
    const auto& [low, high] = ends[axis];
    if (!(high > low)) continue;
    now.at[axis] = std::round((values[axis] - low) / (high - low) * steps[axis]);
    const double share = now.at[axis] / steps[axis];
    const std::size_t before = weights.size();
    for (std::size_t i = 0; i < before; ++i) weights.push_back(weights[i] * share);
    for (std::size_t i = 0; i < before; ++i) weights[i] *= 1 - share;
  }
  const std::lock_guard lock(mutex_);
  if (mixed_.at == now.at) return mixed_.nodes;
  std::vector<float> mixed(corners.front().size(), 0);
  for (std::size_t c = 0; c < corners.size(); ++c) {
    const auto weight = static_cast<float>(weights[c]);
    for (std::size_t i = 0; i < mixed.size(); ++i) mixed[i] += weight * corners[c][i];
  }
  now.nodes = std::make_shared<const std::vector<float>>(std::move(mixed));
  mixed_ = now;
  return mixed_.nodes;
}

void Correction::find_ends(CorrectionTables& tables, const FrameSettings& settings) const {
  const Acquisition acquisition = acquisition_for(camera_->view(), settings);
  const Views views = some_views(*pixels_);
  constexpr double straight = 1e-5, unnoticed = 2e-6;  // m
  // Ends are multiples of the interval length, so that they do not depend on which frame comes first.
  const auto find = [&](std::size_t axis, bool needed, double tofgraph_condition::*what, double longest) {
    const double value = acquisition.condition.*what;
    tables.ends[axis] = {value, value};
    if (!needed) return;
    Drift drift;
    for (double length = longest;; length /= 2) {
      const double first = std::floor(value / length) * length;
      drift = drift_of(*pixels_, views, acquisition, what, first, first + length);
      tables.ends[axis] = {first, first + length};
      if (drift.bend < straight || length < 1e-3) break;
    }
    tables.steps[axis] = std::max(1.0, std::ceil(drift.change / unnoticed));
  };
  constexpr double day = 86400, degrees = 64;
  find(0, needs_.time_since_power_on, &tofgraph_condition::time_since_power_on, day);
  find(1, needs_.temperature, &tofgraph_condition::temperature, degrees);
}

std::shared_ptr<const CorrectionTables> Correction::compile(const FrameSettings& settings) const {
  const tofgraph_camera& camera = camera_->view();
  Acquisition acquisition = acquisition_for(camera, settings);
  auto tables = std::make_shared<CorrectionTables>();
  tables->needs = needs_;
  tables->integration_time = acquisition.condition.integration_time;
  tables->modulation_frequency = acquisition.condition.modulation_frequency;
  find_ends(*tables, settings);
  acquisition.condition.time_since_power_on = tables->ends[0][0];  // independent of the current frame
  acquisition.condition.temperature = tables->ends[1][0];
  std::vector<Acquisition> corners;
  for (const double temperature : tables->ends[1]) {
    for (const double time : tables->ends[0]) {
      corners.push_back(acquisition);
      corners.back().condition.time_since_power_on = time;
      corners.back().condition.temperature = temperature;
      if (!(tables->ends[0][1] > tables->ends[0][0])) break;
    }
    if (!(tables->ends[1][1] > tables->ends[1][0])) break;
  }
  const std::vector<double> frequencies =
      physics::frequencies_of(physics::exposures_of(camera), acquisition.condition.modulation_frequency);
  const double highest = std::ranges::max(frequencies);
  tables->range = pixels_->range(acquisition);
  tables->first = closest;
  const double ranges = tables->range / physics::unambiguous_range(highest);
  constexpr double most = 8192, fewest_per_range = 64;
  const double count = std::min(static_cast<double>(nodes_per_range) * ranges, most);
  if (count < fewest_per_range * ranges)
    throw std::invalid_argument("cannot be undone: the modulation frequencies repeat together only after " +
                                std::to_string(physics::to_integer(tables->range, 0L)) + " m, too far for tables");
  tables->distances = physics::to_integer(count, std::size_t{0}) + 1;
  tables->step = tables->range / static_cast<double>(tables->distances - 1);
  choose_amplitudes(camera, *tables);
  tables->corners.resize(corners.size());
  const Nodes nodes(*pixels_, *tables, std::move(corners));
  tables->shifts = shifts_of(*pixels_, nodes, *tables, acquisition);
  CrossApproximation cross(nodes, *tables, *pixels_, physics::metres_per_radian(highest));
  constexpr std::size_t max_products = 15;
  tables->worst = cross.run(max_products);
  store(cross.products(), cross.factors(), pixels_->pixels().size(), *tables);
  return tables;
}

}  // namespace tofgraph::simulation
