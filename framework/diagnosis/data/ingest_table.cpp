// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Campaigns that exist only as statistics: one mean over a window of the board per condition.
#include "diagnosis/data/ingest.hpp"
#include "diagnosis/data/search_settings.hpp"

#include "simulation/simulation.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/constants.hpp>

#include <cmath>

namespace tofgraph::diagnosis {
namespace {

/// Means of the ideal camera over a condition's window.
struct Ideal {
  double path = 0, amplitude = 0, count = 0;  ///< m, counts, pixels
};

Ideal ideal_of(const tofgraph_camera& camera, bool physical, const io::Condition& condition) {
  const simulation::Pixels pixels = simulation::whole_image(camera);
  const simulation::ForwardModel model(camera, physical, {});
  const Demodulation demodulation(physics::exposures_of(camera));
  const auto tracer = simulation::board_tracer(camera.focal_length, pose_of(condition));
  const auto taps = model.expect(tracer, simulation::acquisition_of(camera, condition), pixels).taps;
  const io::Roi window = condition.roi.value_or(io::Roi{0, camera.width - 1, 0, camera.height - 1});
  const double scale = physics::metres_per_radian(camera.modulation_frequency);
  const double range = physics::unambiguous_range(camera.modulation_frequency);
  Ideal sum;
  for (std::size_t v = window.first_row; v <= window.last_row; ++v) {
    for (std::size_t u = window.first_column; u <= window.last_column; ++u) {
      const Signal signal = demodulation.of_taps(&taps[v * camera.width + u], pixels.size());
      if (std::isnan(signal.intensity)) continue;  // outside the lens model
      const double folded = scale * std::arg(signal.phasor);
      // Half paths are slightly longer than the board distance, so the period nearest to it is right.
      sum.path += folded + range * std::round((condition.board_distance - folded) / range);
      sum.amplitude += std::abs(signal.phasor);
      ++sum.count;
    }
  }
  if (sum.count == 0)
    throw std::invalid_argument(fmt::format("condition '{}': the lens model has no pixel of its roi", condition.id));
  return {sum.path / sum.count, sum.amplitude / sum.count, sum.count};
}

}  // namespace

Measurements measure_table(const io::Campaign& campaign, const IngestOptions& options) {
  const bool physical = options.physical;
  Measurements result;
  result.table = true;
  std::vector<io::Condition> used;
  for (const io::Condition& condition : campaign.conditions) {
    const bool known = std::isfinite(condition.measured.depth) || std::isfinite(condition.measured.distance);
    if (known && std::isfinite(condition.integration_time))
      used.push_back(condition);
    else if (known || std::isnan(condition.measured.depth_sd))  // otherwise it states only the spread of the pixels
      result.left_out.push_back(
          fmt::format("{}: it has no {}", condition.id, known ? "integration_time" : "measured_depth"));
  }
  require_enough(used.size(), result.left_out);
  result.frames = used.size();
  result.replicates = true;
  result.recorded_times.assign(used.size(), io::unknown);
  result.design = std::make_shared<const Design>(campaign.camera, physical, used, single, campaign.jitter);
  result.searched = representative_conditions(used, options.max_conditions);
  for (std::size_t i = 0; i < used.size(); ++i) {
    const io::Measured& measured = used[i].measured;
    const Ideal ideal = ideal_of(campaign.camera->view(), physical, used[i]);
    Observations o{std::vector<double>(observables, 0),
                   std::vector<double>(observables, std::numeric_limits<double>::infinity())};
    o.value[distance] = std::isfinite(measured.depth)
                            ? (measured.depth - used[i].board_distance) * result.design->shift(i)[distance]
                            : measured.distance - ideal.path;
    const double pixels = std::isfinite(measured.count) ? std::max(measured.count, 1.0) : ideal.count;
    const double spread = std::isfinite(measured.depth_sd) ? measured.depth_sd : 0;
    o.variance[distance] = spread * spread / pixels + settings.table_min_sd * settings.table_min_sd;
    if (std::isfinite(measured.amplitude) && measured.amplitude > 0) {
      o.value[amplitude] = std::log(measured.amplitude / ideal.amplitude);
      o.variance[amplitude] = settings.table_amplitude_sd * settings.table_amplitude_sd;
    }
    result.observations.push_back(std::move(o));
  }
  return result;
}

}  // namespace tofgraph::diagnosis
