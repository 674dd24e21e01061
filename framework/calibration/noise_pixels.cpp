// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/noise_pixels.hpp"

#include "calibration/pixel_outliers.hpp"

#include <tbb/parallel_for.h>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tofgraph::calibration {
namespace {

constexpr double deviations = outlier_deviate;
constexpr double min_noisy = 1.25;      ///< noise relative to the fit: smaller excess does not justify losing a pixel
constexpr double max_stuck = 0.5;       ///< noise relative to the fit of a stuck pixel
constexpr double min_response = 0.2;    ///< relative difference from the neighbours
constexpr double max_dead = 0.25;       ///< relative to the neighbours' light
constexpr double min_hot = 1.5;         ///< relative to the neighbours' light in the darkest condition
constexpr double max_modulation = 0.5;  ///< relative to the neighbours' ratio of amplitude to light
constexpr std::size_t few = 3;          ///< conditions: with fewer, a scene edge resembles a bad pixel
constexpr double log_chance = -20.7;    ///< ln 1e-9

/// Logarithm of each pixel's value relative to its neighbours' median; NaN if the neighbours are unknown.
std::vector<double> against_neighbours(const NoiseData& data, const NoiseCondition& condition,
                                       const std::vector<double>& values) {
  constexpr double least = 1e-3;  // avoids the logarithm of 0
  std::vector<double> good(values.size(), unknown), result(values.size(), unknown);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (condition.pixels.is_good(i) && data.listed[i] == 0) good[i] = values[i];
  tbb::parallel_for(std::size_t{0}, values.size(), [&](std::size_t i) {
    if (condition.pixels.use[i] == PixelUse::outside) return;
    const double around = neighbour_quantile(good, data.columns, i);
    if (around > 0 && !std::isnan(values[i])) result[i] = std::log(std::max(values[i] / around, least));
  });
  return result;
}

/// Median of each pixel over the conditions. @returns NaN if it is known in fewer than `least`
std::vector<double> medians_over_conditions(const std::vector<std::vector<double>>& conditions, std::size_t pixels,
                                            std::size_t least) {
  std::vector<double> result(pixels, unknown);
  for (std::size_t i = 0; i < pixels; ++i) {
    std::vector<double> known;
    for (const std::vector<double>& values : conditions)
      if (std::isfinite(values[i])) known.push_back(values[i]);
    if (known.size() >= least) result[i] = physics::median(known);
  }
  return result;
}

std::vector<double> pixel_levels(const NoiseCondition& c) { return {c.pixels.level.begin(), c.pixels.level.end()}; }

/// Amplitude relative to light; NaN if there is too little light to show modulation.
std::vector<double> modulation_of(const NoiseCondition& c) {
  constexpr double dark = 10;  // counts
  std::vector<double> result;
  for (std::size_t i = 0; i < c.pixels.level.size(); ++i)
    result.push_back(c.pixels.level[i] > dark ? double{c.pixels.amplitude[i]} / c.pixels.level[i] : unknown);
  return result;
}

/// Median over the good pixels of a condition. @returns NaN if less than half of them are good
double middle_of(const NoiseCondition& c, const std::vector<float>& values) {
  std::vector<double> good;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (c.pixels.is_good(i)) good.push_back(values[i]);
  const auto looked_at = std::ranges::count_if(c.pixels.use, [](PixelUse u) { return u != PixelUse::outside; });
  return 2 * std::ssize(good) < looked_at ? unknown : physics::median(good);
}

/// True if the amplitude is significant even when halved.
bool shows_modulation(const NoiseCondition& c) {
  constexpr double clear = 20;  // standard deviations
  const double noise = std::sqrt(middle_of(c, c.pixels.variance) / static_cast<double>(c.frames));
  return !c.capped && middle_of(c, c.pixels.amplitude) > clear * noise;
}

/// Marks dead pixels and those with other responses by the light on flat boards.
void mark_light(const std::vector<std::vector<double>>& levels, NoiseFit& fit) {
  const std::size_t n = fit.bad.size();
  fit.response_judged = levels.size() >= few;
  const std::vector<double> light = medians_over_conditions(levels, n, 1),
                            response = medians_over_conditions(levels, n, few);
  const double dead = std::min(-deviations * robust_sd(light), std::log(max_dead));
  const double limit = std::max(deviations * robust_sd(response), std::log1p(min_response));
  for (std::size_t i = 0; i < n; ++i) {
    if (light[i] < dead)
      fit.bad[i] |= bad_dead;
    else if (std::abs(response[i]) > limit)
      fit.bad[i] |= bad_response;
  }
}

/// Marks hot pixels: by their level in the darkest condition, or saturated while their neighbours are not.
void mark_hot(const NoiseData& data, const NoiseCondition& darkest, const std::vector<double>& level, NoiseFit& fit) {
  const double limit = std::max(deviations * robust_sd(level), std::log(min_hot));
  for (std::size_t i = 0; i < level.size(); ++i) {
    const bool full = darkest.pixels.use[i] == PixelUse::saturated && std::isfinite(level[i]) && level[i] > 0;
    if (level[i] > limit || full) fit.bad[i] |= bad_hot;
  }
  for (std::size_t i = 0; i < level.size(); ++i) {  // saturated in every condition
    const auto is_full = [i](const NoiseCondition& c) { return c.pixels.use[i] == PixelUse::saturated; };
    if (std::isfinite(level[i]) && std::ranges::all_of(data.conditions, is_full)) fit.bad[i] |= bad_hot;
  }
}

}  // namespace

std::span<const BadPixelReason> bad_pixel_reasons() {
  static constexpr BadPixelReason reasons[] = {
      {bad_dead, "dead", "less than a quarter of its neighbours' light on flat boards, or never a number"},
      {bad_stuck, "stuck", "less than half of the fitted noise, or a tap that never changes"},
      {bad_noisy, "noisy", "more than 1.25 times the fitted noise"},
      {bad_hot, "hot", "more than 1.5 times its neighbours' counts where there is least light, or always full"},
      {bad_modulation, "without modulation", "less than half of its neighbours' ratio of amplitude to light"},
      {bad_response, "with another response", "20 % or more from its neighbours' light, in three flat boards or more"},
      {bad_listed, "listed before", "in the map that the camera's profile names"}};
  return reasons;
}

void mark_response(const NoiseData& data, NoiseFit& fit) {
  std::vector<std::vector<double>> flat, modulation;
  const NoiseCondition* darkest = nullptr;
  std::vector<double> dark_level;
  double least = 0;
  for (const NoiseCondition& c : data.conditions) {
    if (shows_modulation(c)) modulation.push_back(against_neighbours(data, c, modulation_of(c)));
    if (!c.flat && !c.capped) continue;
    std::vector<double> level = against_neighbours(data, c, pixel_levels(c));
    const double middle = middle_of(c, c.pixels.level);
    if (data.source == NoiseSource::taps && std::isfinite(middle) && (darkest == nullptr || middle < least)) {
      darkest = &c;
      least = middle;
      dark_level = level;
    }
    if (c.flat) flat.push_back(std::move(level));
  }
  mark_light(flat, fit);
  if (darkest != nullptr) mark_hot(data, *darkest, dark_level, fit);
  const std::vector<double> ratio = medians_over_conditions(modulation, fit.bad.size(), 1);
  const double limit = std::min(-deviations * robust_sd(ratio), std::log(max_modulation));
  for (std::size_t i = 0; i < fit.bad.size(); ++i) {
    if (ratio[i] < limit && (fit.bad[i] & (bad_dead | bad_hot)) == 0) fit.bad[i] |= bad_modulation;
    const auto never = [i](const NoiseCondition& c) { return c.pixels.use[i] == PixelUse::invalid; };
    if (std::ranges::all_of(data.conditions, never)) fit.bad[i] |= bad_dead;
  }
}

void mark_noise(const NoiseData& data, NoiseFit& fit) {
  fit.ratio.assign(fit.bad.size(), unknown);
  const double read = fit.noise.read_noise * fit.noise.read_noise;
  for (std::size_t i = 0; i < fit.bad.size(); ++i) {
    double sum = 0, freedom = 0;
    bool clipped = false;
    for (const bool good : {true, false}) {  // also detects noisy pixels that are clipped everywhere
      for (const NoiseCondition& c : data.conditions) {
        const bool use = good ? c.pixels.is_good(i) : c.pixels.use[i] == PixelUse::clipped;
        if (!use || !std::isfinite(c.pixels.variance[i])) continue;
        sum += c.pixels.samples * c.pixels.variance[i] / (read + fit.noise.shot_noise * c.pixels.level[i]);
        freedom += c.pixels.samples;
        clipped = !good;
      }
      if (freedom > 0) break;
    }
    fit.bad[i] &= static_cast<std::uint8_t>(~(bad_noisy | bad_stuck));
    if (freedom == 0) continue;
    const double ratio = sum / freedom;
    if (!clipped) fit.ratio[i] = std::sqrt(ratio);
    if (ratio > std::max(variance_ratio_at(freedom, deviations), min_noisy * min_noisy)) fit.bad[i] |= bad_noisy;
    if (!clipped && ratio < std::min(variance_ratio_at(freedom, -deviations), max_stuck * max_stuck))
      fit.bad[i] |= bad_stuck;
  }
}

void mark_frozen(const NoiseData& data, NoiseFit& fit) {
  const double read = fit.noise.read_noise * fit.noise.read_noise;
  for (std::size_t i = 0; i < fit.bad.size(); ++i) {
    std::uint64_t frozen = ~std::uint64_t{0};
    double log_probability = 0;
    for (const NoiseCondition& c : data.conditions) {
      const PixelUse use = c.pixels.use[i];
      if (use == PixelUse::outside || use == PixelUse::saturated || use == PixelUse::invalid) continue;
      frozen &= c.pixels.frozen[i];
      // Two rounded normal values are equal with a probability of 1 / (2 sqrt(pi) sd).
      const double sd = std::sqrt(read + fit.noise.shot_noise * std::max(c.pixels.level[i], 0.0F));
      const double equal = std::min(1 / (2 * std::sqrt(std::numbers::pi) * std::max(sd, 1e-9)), 1.0);
      log_probability += static_cast<double>(c.frames - 1) * std::log(equal);
    }
    const std::size_t images = std::min<std::size_t>(data.conditions.front().pixels.images, 64);
    const std::uint64_t own = images == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << images) - 1;
    if (data.source != NoiseSource::taps || (frozen & own) == 0 || log_probability >= log_chance) continue;
    // Its level and missing modulation are consequences: they are not reported as separate reasons.
    fit.bad[i] = static_cast<std::uint8_t>((fit.bad[i] | bad_stuck) & ~(bad_hot | bad_modulation));
  }
}

}  // namespace tofgraph::calibration
