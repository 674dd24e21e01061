// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/integration_control.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "io/calibration.hpp"

namespace tofgraph::camcube {
namespace {

constexpr std::size_t pixel_step = 7;   ///< subsampling: 6000 pixels of 204 x 204
constexpr double bright_tap = 0.99;     ///< percentile of the brighter tap, which must not reach the full well
constexpr double max_filling = 0.8;     ///< relative to the full well
constexpr double when_saturated = 0.4;  ///< factor of the time, since the excess over the full well cannot be measured
constexpr double max_change = 8;        ///< maximum factor per step
constexpr double not_worth = 0.02;      ///< relative change too small to be made
constexpr int max_ignored = 40;         ///< frames after which a new time that never took effect is given up

float percentile(std::vector<float>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

double use_calibration(const std::string& file, const std::string& camera, ControlLimits& limits) {
  io::CalibrationReader reader(file, "integration-time", camera);
  const io::Calibrated shortest = reader.column("shortest", "s", 0, "[0.5 ms, 1 ms]");
  const io::Calibrated longest = reader.column("longest", "s", shortest.value.size(), "[2 ms, 4 ms]");
  const double recommended = reader.has("recommended") ? reader.need("recommended", "s", 1, "2 ms").value.front()
                                                       : std::numeric_limits<double>::quiet_NaN();
  // The other keys are for human readers.
  if (reader.has("recommended_error")) static_cast<void>(reader.need("recommended_error", "m", 1, "{value: 5 mm}"));
  for (const auto& [key, unit] : {std::pair{"target", ""},
                                  {"distance", "m"},
                                  {"integration_time", "s"},
                                  {"rmse", "m"},
                                  {"several", "s"},
                                  {"saturates", "s"},
                                  {"held_out_excess", ""}})
    if (reader.has(key)) static_cast<void>(reader.column(key, unit, 0, "[0, 0]"));
  reader.finish();
  const auto finite = [](double value) { return std::isfinite(value); };
  if (std::ranges::any_of(shortest.value, finite) && std::ranges::any_of(longest.value, finite)) {
    limits.times[0] = std::max(limits.times[0], std::ranges::min(shortest.value));
    limits.times[1] = std::min(limits.times[1], std::ranges::max(longest.value));
  }
  return recommended;
}

/// Equation of the amplitude: sqrt((c3 - c1)^2 + (c0 - c2)^2) / 2.
void IntegrationControl::measure(std::span<const std::uint16_t> taps) {
  const std::size_t pixels = taps.size() / 8;
  amplitudes_.clear();
  taps_.clear();
  for (std::size_t i = 0; i < pixels; i += pixel_step) {
    float c[4];
    std::uint16_t brightest = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint16_t a = taps[2 * k * pixels + i], b = taps[(2 * k + 1) * pixels + i];
      c[k] = static_cast<float>(a) - static_cast<float>(b);
      brightest = std::max({brightest, a, b});
    }
    amplitudes_.push_back(std::hypot(c[3] - c[1], c[0] - c[2]) / 2);
    taps_.push_back(brightest);
  }
}

std::optional<double> IntegrationControl::next(std::span<const std::uint16_t> taps, double time) {
  if (taps.size() < 8 || !(time > 0)) return std::nullopt;
  if (before_ && std::abs(*before_ - time) <= 0.6e-6 && ++ignored_ < max_ignored) return std::nullopt;
  before_.reset();
  ignored_ = 0;
  measure(taps);
  const double amplitude = std::max(percentile(amplitudes_, limits_.percentile), 1.0F);
  const double tap = percentile(taps_, bright_tap);
  const double well = std::isfinite(limits_.full_well) ? limits_.full_well : std::numeric_limits<double>::infinity();
  double factor = 1;
  if (amplitude < limits_.low || amplitude > limits_.high) factor = std::sqrt(limits_.low * limits_.high) / amplitude;
  if (tap > 0) factor = std::min(factor, max_filling * well / tap);
  if (tap >= 0.99 * well) factor = when_saturated;
  factor = std::clamp(factor, 1 / max_change, max_change);
  const double wanted = std::round(std::clamp(time * factor, limits_.times[0], limits_.times[1]) * 1e6) * 1e-6;
  if (std::abs(wanted - time) < not_worth * time) return std::nullopt;
  before_ = time;
  return wanted;
}

}  // namespace tofgraph::camcube
