// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/plausibility.hpp"

namespace tofgraph::diagnosis {
namespace {

using calibration::BoardPhasors;

BoardPhasors::Phasors phasors_of(const std::vector<Signal>& signals) {
  BoardPhasors::Phasors phasors;
  for (const Signal& s : signals) phasors.push_back(s.phasor);
  return phasors;
}

/// Adds the measured phasors of a condition's superpixels; NaN without a distance.
void add_measured(const Measurements& m, std::size_t i, BoardPhasors& result) {
  const Observations& data = m.observations[i];
  const std::size_t n = m.design->superpixels();
  const double scale = physics::metres_per_radian(m.design->camera().modulation_frequency);
  BoardPhasors::Phasors phasors;
  bool has_amplitude = true;
  for (std::size_t s = 0; s < n && m.design->shows_board(i); ++s) {
    phasors.emplace_back(io::unknown, io::unknown);
    if (!std::isfinite(data.variance[distance * n + s])) continue;
    has_amplitude = has_amplitude && std::isfinite(data.variance[amplitude * n + s]);
    phasors.back() = m.design->ideal(i)[s].phasor *
                     std::polar(std::exp(data.value[amplitude * n + s]), data.value[distance * n + s] / scale);
  }
  result.measured.push_back(std::move(phasors));
  result.has_amplitude.push_back(has_amplitude ? 1 : 0);
}

}  // namespace

BoardPhasors phasors_of(const Measurements& m) {
  const Design& design = *m.design;
  BoardPhasors result{.conditions = design.conditions(),
                      .modulation_frequency = design.camera().modulation_frequency,
                      .min_distance = 1.01 * design.camera().focal_length,
                      .recorded_times = m.recorded_times};
  for (std::size_t i = 0; i < design.size(); ++i) {
    result.ideal.push_back(phasors_of(design.ideal(i)));
    add_measured(m, i, result);
  }
  result.ideal_of = [&design](const io::Condition& condition) {
    const Design there(design.camera_pointer(), design.physical(), {condition}, design.side());
    return phasors_of(there.ideal(0));
  };
  return result;
}

std::vector<Contradiction> contradictions(const Measurements& measurements) {
  return calibration::contradictions(phasors_of(measurements));
}

void require_consistent(const Measurements& measurements) {
  config::Diagnostics diagnostics;
  for (const Contradiction& one : contradictions(measurements)) {
    const io::Condition& condition = measurements.design->conditions()[one.condition];
    diagnostics.error(
        condition.place(one.key()), fmt::format("condition '{}': {}", condition.id, one.text),
        fmt::format("correct it, or continue without the condition: --exclude-condition {}", condition.id));
  }
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
}

}  // namespace tofgraph::diagnosis
