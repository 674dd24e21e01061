// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The calibration `noise`: the file, its maps and its summary.
#include "calibration/noise.hpp"

#include "calibration/campaign_inputs.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tofgraph::calibration {
namespace {

const char* name_of(NoiseSource source) {
  constexpr const char* names[] = {"taps", "phases", "decoded"};
  return names[static_cast<std::size_t>(source)];
}

std::size_t count(const NoiseFit& fit, std::uint8_t bit) {
  return static_cast<std::size_t>(std::ranges::count_if(fit.bad, [bit](std::uint8_t b) { return (b & bit) != 0; }));
}

void write_values(const NoiseFit& fit, io::CalibrationWriter& writer) {
  writer.number("read_noise", fit.noise.read_noise, fit.read_sd, "counts", 1);
  writer.number("shot_noise", fit.noise.shot_noise, fit.shot_sd, "counts", 1);
  if (fit.noise.shot_noise > 0)
    writer.number("converter_gain", 1 / fit.noise.shot_noise, fit.shot_sd / std::pow(fit.noise.shot_noise, 2),
                  "e/counts", 1);
  writer.number("bad_pixels",
                static_cast<double>(fit.bad.size()) - static_cast<double>(std::ranges::count(fit.bad, std::uint8_t{0})),
                unknown, "", 1);
  if (std::isfinite(fit.held_out.value))
    writer.column("held_out_" + fit.left_out, {{fit.held_out.value, fit.held_out.low, fit.held_out.high}, {}}, "", 1);
  if (fit.conditions.empty()) return;
  io::Calibrated time, amplitude, measured, predicted, strength;
  for (const SigmaRatio& c : fit.conditions) {
    time.value.push_back(c.integration_time);
    amplitude.value.push_back(c.amplitude);
    measured.value.push_back(c.measured);
    predicted.value.push_back(c.predicted);
    strength.value.push_back(std::numbers::sqrt2 * c.measured);
  }
  if (known(time)) writer.column("integration_time", time, "ms", 1e-3);
  writer.column("amplitude", amplitude, "counts", 1);
  writer.column("sigma", measured, "mm", 1e-3);
  writer.column("predicted_sigma", predicted, "mm", 1e-3);
  writer.column("strength", strength, "mm", 1e-3);
}

std::string summary_of(const NoiseData& data, const NoiseFit& fit) {
  const double gain = fit.noise.shot_noise > 0 ? 1 / fit.noise.shot_noise : unknown;
  std::vector<std::string> lines = {
      fmt::format("a tap's noise from {} condition{} ({}): read noise {:.3f} +- {:.3f} counts, shot noise {:.5f} +- "
                  "{:.5f} counts{}",
                  data.conditions.size(), data.conditions.size() == 1 ? "" : "s", name_of(data.source),
                  fit.noise.read_noise, fit.read_sd, fit.noise.shot_noise, fit.shot_sd,
                  std::isfinite(gain) ? fmt::format(" ({:.4g} e per count)", gain) : "")};
  if (std::isfinite(fit.held_out.value))
    lines.push_back(fmt::format(
        "the distance's noise relative to sigma, {} held out: {:.3f} times{}; single ones differ by {:.1f} %",
        fit.left_out == "condition" ? "one condition" : "one integration time", fit.held_out.value,
        std::isfinite(fit.held_out.low) ? fmt::format(" (95 %: {:.3f} to {:.3f})", fit.held_out.low, fit.held_out.high)
                                        : "",
        100 * fit.error));
  const std::size_t bad = fit.bad.size() - static_cast<std::size_t>(std::ranges::count(fit.bad, std::uint8_t{0}));
  std::vector<std::string> reasons;
  for (const BadPixelReason& reason : bad_pixel_reasons())
    if (count(fit, reason.bit) > 0) reasons.push_back(fmt::format("{} {}", count(fit, reason.bit), reason.name));
  lines.push_back(
      fmt::format("{} of {} pixels are bad{}{}", bad, fit.bad.size(), bad > 0 ? ": " : "", fmt::join(reasons, ", ")));
  return fmt::format("{}", fmt::join(lines, "\n"));
}

void add_notes(const NoiseData& data, const NoiseFit& fit, std::vector<std::string>& notes) {
  if (data.source != NoiseSource::taps)
    notes.push_back(fmt::format(
        "the light of a tap follows from the amplitude and the profile's contrast, as there are no taps ({}): ambient "
        "light is taken for read noise",
        name_of(data.source)));
  const double share = fit.excess * fit.max_level / std::max(fit.noise.shot_noise, 1e-9);
  if (std::abs(fit.excess) > 5 * fit.excess_sd && std::abs(share) > 0.02)
    notes.push_back(fmt::format(
        "at {:.0f} counts the variance is {:.1f} % {} a straight line: the light flickers, or the converter bends",
        fit.max_level, 100 * std::abs(share), share > 0 ? "above" : "below"));
  std::size_t unseen = 0;
  for (std::size_t i = 0; i < fit.ratio.size(); ++i) unseen += std::isnan(fit.ratio[i]) && fit.bad[i] == 0 ? 1 : 0;
  if (unseen > 0)
    notes.push_back(fmt::format("{} of {} pixels were never valid, lit and unsaturated: they could not be evaluated",
                                unseen, fit.ratio.size()));
  if (!fit.response_judged)
    notes.emplace_back(
        "pixels with another response than their neighbours show on flat boards only, in three conditions or more: "
        "they were not searched for");
  if (std::ranges::none_of(data.conditions, &NoiseCondition::flat))
    notes.emplace_back("no condition shows a flat board alone: dead pixels were not searched for");
  if (!std::isfinite(fit.held_out.value))
    notes.emplace_back(
        "no condition could be held out and predicted by the others: sigma was not validated on other data");
  if (fit.noise.read_noise == 0)
    notes.emplace_back("the read noise is too small to be determined beside the shot noise: it is taken as 0");
}

/// Relative errors of sigma in held-out conditions, where ratios above and below 1 do not cancel. If they exceed 5 %,
/// the calibration must predict the noise better than the profile does; below 5 % an equal prediction is acceptable,
/// because the map of bad pixels is new.
std::optional<HeldOutErrors> judged(const NoiseFit& fit) {
  const double before = fit.error_by_profile, after = fit.error;
  if (!(after > 0.05) || !std::isfinite(before)) return std::nullopt;
  return HeldOutErrors{.left_out = fit.left_out == "condition" ? "each condition" : "each integration time",
                       .before = before,
                       .after = after,
                       .unit = "% of sigma",
                       .scale = 1e-2,
                       .causes =
                           "light that flickers or drifts, scenes that move, frames that were averaged, a "
                           "converter that bends"};
}

std::vector<double> as_values(const std::vector<std::uint8_t>& bits) { return {bits.begin(), bits.end()}; }

}  // namespace

Result calibrate_noise(const Request& request) {
  const io::Campaign campaign = read_conditions(request);
  if (campaign.from_table)
    throw config::ConfigurationError(fmt::format(
        "{}: error: a table holds statistics, but the noise is determined from frames\n  give conditions with captures",
        request.campaign.string()));
  refuse_duplicates(campaign);
  const NoiseData data = read_noise(campaign, [&](double share) {
    if (request.progress) request.progress(0.8 * share, "reading the campaign");
  });
  if (request.progress) request.progress(0.8, "fitting");
  NoiseFit fit;
  try {
    fit = fit_noise(data, &campaign);
  } catch (const config::ConfigurationError& error) {
    throw config::ConfigurationError(fmt::format("{}: error: {}", request.campaign.string(), error.what()));
  }
  io::CalibrationWriter writer = writer_for(request, campaign, data.serial, "noise");
  writer.setting("samples", name_of(data.source));
  write_values(fit, writer);
  Result result{.file = writer.text(),
                .page = report::Page(""),
                .summary = summary_of(data, fit),
                .notes = data.notes,
                .maps = {{"bad", "", as_values(fit.bad)}, {"noise_ratio", "", fit.ratio}},
                .map_rows = data.rows,
                .map_columns = data.columns,
                .held_out = judged(fit)};
  add_notes(data, fit, result.notes);
  if (std::ranges::any_of(fit.bad, [](std::uint8_t bits) { return bits != 0; }))
    result.notes.push_back(
        fmt::format("to exclude the bad pixels everywhere, add the calibration to the camera's folder (tofgraph camera "
                    "add), or put this into the profile: bad_pixels: {{file: {}, dataset: bad}}",
                    maps_of(request.output).filename().string()));
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < result.summary.size();) {
    const std::size_t end = std::min(result.summary.find('\n', begin), result.summary.size());
    lines.push_back(result.summary.substr(begin, end - begin));
    begin = end + 1;
  }
  result.page = noise_report(campaign, data, fit, sentence_of(lines));
  return result;
}

}  // namespace tofgraph::calibration
