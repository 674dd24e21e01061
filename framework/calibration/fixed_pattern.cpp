// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The calibration `fixed-pattern`: the file, the maps, the model and the summary.
#include "calibration/fixed_pattern_priors.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::calibration {
namespace {

double rms_of(const std::vector<double>& values, const std::vector<double>& sd) {
  std::vector<double> used;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(sd[i])) used.push_back(values[i]);
  }
  return used.empty() ? 0 : root_mean_square(used);
}

std::size_t unknown_pixels(const PatternFit& fit) {
  return static_cast<std::size_t>(std::ranges::count_if(fit.map_sd, [](double sd) { return std::isnan(sd); }));
}

/// Range of the board's height over its visible part.
double warp_of(const PatternData& data, const PatternFit& fit) {
  double low = 0, high = 0;
  constexpr std::size_t step = 7;  // pixels: the shape is smooth, so a subset is sufficient
  for (const PatternView& view : data.views) {
    for (std::size_t i = 0; i < view.place.size(); i += step) {
      if (!std::isfinite(view.residual[i])) continue;
      const double height = shape_at(fit.shape, view.place[i][0] / data.extent, view.place[i][1] / data.extent);
      low = std::min(low, height);
      high = std::max(high, height);
    }
  }
  return high - low;
}

/// True if the pattern improves held-out distances; otherwise it is not corrected.
bool helps(const PatternFit& fit) { return !(fit.after.value >= fit.before.value); }

bool is_flat(const PatternFit& fit) {
  constexpr double significant = 4;  // limit for the largest of twelve coefficients
  for (std::size_t k = 0; k < fit.shape.size(); ++k) {
    if (std::abs(fit.shape[k]) > significant * fit.shape_sd[k]) return false;
  }
  return true;
}

std::string file_text(const Request& request, const PatternData& data, const PatternFit& fit) {
  io::CalibrationWriter writer = writer_for(request, data.campaign, "fixed-pattern");
  writer.setting("maps", maps_of(request.output).filename().string());
  writer.number("pattern", rms_of(fit.map, fit.map_sd), unknown, "mm", 1e-3);
  writer.number("pattern_sd", rms_of(fit.map_sd, fit.map_sd), unknown, "mm", 1e-3);
  writer.number("board_warp", warp_of(data, fit), unknown, "mm", 1e-3);
  writer.column("board_shape", {fit.shape, fit.shape_sd}, "mm", 1e-3);
  writer.number("board_extent", data.extent, unknown, "mm", 1e-3);
  writer.number("misfit", fit.misfit, unknown, "", 1);
  if (std::isfinite(fit.slope_evidence)) writer.number("slope_evidence", fit.slope_evidence, unknown, "", 1);
  if (std::isfinite(fit.after.value)) {
    writer.column("held_out_before", {{fit.before.value, fit.before.low, fit.before.high}, {}}, "mm", 1e-3);
    writer.column("held_out_distance", {{fit.after.value, fit.after.low, fit.after.high}, {}}, "mm", 1e-3);
    writer.number("noise_floor", fit.noise_floor, unknown, "mm", 1e-3);
  }
  io::Calibrated offset, z, tilt_x, tilt_y;
  for (const ViewPose& p : fit.poses) {
    offset.value.push_back(p.offset);
    z.value.push_back(p.z);
    tilt_x.value.push_back(p.tilt_x);
    tilt_y.value.push_back(p.tilt_y);
  }
  writer.column("waves", {fit.waves, {}}, "mm", 1e-3);
  writer.number("input_spread", fit.input_spread, unknown, "mm", 1e-3);
  writer.number("restart_difference", fit.restart_difference, unknown, "mm", 1e-3);
  writer.column("offset", offset, "mm", 1e-3);
  writer.column("displacement", z, "mm", 1e-3);
  writer.column("tilt_x", tilt_x, "mrad", 1e-3);
  writer.column("tilt_y", tilt_y, "mrad", 1e-3);
  return writer.text();
}

std::string model_text(const Request& request, const PatternData& data, const PatternFit& fit) {
  const std::string file = maps_of(request.output).filename().string();
  std::string text = model_head(request, data.campaign.conditions, data.campaign.boards.serial);
  if (!helps(fit)) return text + "effects: []  # no pattern that helps at a distance that was left out\n";
  text += "effects:\n  - effect: fixed_pattern\n    scale: 1\n";
  text += fmt::format("    map: {{file: {}, dataset: map}}\n", config::yaml_word(file));
  if (fit.has_slope) text += fmt::format("    slope_map: {{file: {}, dataset: slope_map}}\n", config::yaml_word(file));
  return text;
}

std::vector<std::string> summary_of(const PatternData& data, const PatternFit& fit) {
  std::vector<std::string> lines = {
      fmt::format("fixed pattern from {} boards: {:.2f} mm rms, each pixel +- {:.2f} mm", data.views.size(),
                  rms_of(fit.map, fit.map_sd) * 1e3, rms_of(fit.map_sd, fit.map_sd) * 1e3),
      fit.has_slope ? fmt::format("it grows with the distance: {:.2f} mm/m rms, each pixel +- {:.2f} mm/m",
                                  rms_of(fit.slope, fit.slope_sd) * 1e3, rms_of(fit.slope_sd, fit.slope_sd) * 1e3)
      : std::isfinite(fit.slope_evidence) ? "it does not grow with the distance, as far as these boards tell"
                                          : "whether it grows with the distance is not known",
      fmt::format("the board: {}{:.2f} mm between its highest and its lowest point",
                  is_flat(fit) ? "flat, as far as these views tell; " : "", warp_of(data, fit) * 1e3)};
  if (std::isfinite(fit.after.value))
    lines.push_back(
        fmt::format("one distance left out: {:.2f} mm rms remain of {:.2f} mm (95 %: {:.2f} to {:.2f} mm), of which "
                    "noise is {:.2f} mm",
                    fit.after.value * 1e3, fit.before.value * 1e3, fit.after.low * 1e3, fit.after.high * 1e3,
                    fit.noise_floor * 1e3));
  return lines;
}

std::vector<std::string> notes_of(const PatternData& data, const PatternFit& fit) {
  std::vector<std::string> notes = data.campaign.boards.notes;
  if (const std::size_t n = unknown_pixels(fit); n > 0)
    notes.push_back(fmt::format("{} pixel{} seen too seldom: in the maps 0, with a standard deviation of NaN", n,
                                n == 1 ? " was" : "s were"));
  if (!helps(fit)) notes.emplace_back("the model has no effect, the maps are what was found");
  if (!std::isfinite(fit.after.value))
    notes.emplace_back("with fewer than three distances none can be left out: the pattern was not judged");
  if (rms_of(fit.map_sd, fit.map_sd) > rms_of(fit.map, fit.map_sd) / 2)
    notes.emplace_back(
        "the pattern is hardly larger than its own uncertainty: record more frames, distances and rolls");
  constexpr double much = 1.2;
  if (data.noise_known && fit.misfit > much)
    notes.push_back(
        fmt::format("what is left is {:.2f} times the noise: something else than a pattern of the pixels is in these "
                    "distances; the "
                    "standard deviations allow for it",
                    fit.misfit));
  if (!data.noise_known)
    notes.emplace_back("single frames do not tell the noise: the standard deviations are from what the fit leaves");
  return notes;
}

}  // namespace

std::string divergence_of(const PatternData& data, const PatternFit& fit) {
  constexpr double max_spreads = 5, max_restart = 0.1;  // relative to the spread of the input; to the rms of the map
  const double rms = rms_of(fit.map, fit.map_sd), known_to = rms_of(fit.map_sd, fit.map_sd);
  if (!(rms <= max_spreads * fit.input_spread))
    return fmt::format(
        "the fit diverged: a pattern of {:.2f} mm rms from images whose pixels differ by {:.2f} mm (robust standard "
        "deviation); are distances and rolls those of the captures?",
        rms * 1e3, fit.input_spread * 1e3);
  if (!fit.settled || fit.restart_difference > std::max(max_restart * rms, known_to))
    return fmt::format(
        "the fit did not converge: two starts give maps that differ by {:.2f} mm rms (pattern {:.2f} mm rms), the "
        "gradient is {:.2g}; record more distances and rolls",
        fit.restart_difference * 1e3, rms * 1e3, fit.gradient);
  for (std::size_t v = 0; v < fit.poses.size(); ++v) {
    if (std::abs(fit.poses[v].z) > pattern::max_deviations * pattern::max_jitter.z)
      return fmt::format(
          "the board of the condition '{}' seems to be displaced by {:.0f} mm against the others, more than {:.0f} mm: "
          "is "
          "its distance right?",
          data.campaign.conditions.conditions[data.views[v].condition].id, fit.poses[v].z * 1e3,
          pattern::max_deviations * pattern::max_jitter.z * 1e3);
  }
  return {};
}

Result calibrate_fixed_pattern(const Request& request) {
  const PatternData data = read_pattern(request);
  const PatternFit fit = fit_pattern(data, [&](double share) {
    if (request.progress) request.progress(0.5 + 0.5 * share, "fitting");
  });
  if (const std::string problem = divergence_of(data, fit); !problem.empty())
    throw std::runtime_error(
        fmt::format("calibrate fixed-pattern: {}; nothing was written{}", problem, used_of(data.campaign.boards)));
  const std::vector<std::string> lines = summary_of(data, fit);
  Result result{.file = file_text(request, data, fit),
                .page = fixed_pattern_report(data, fit, sentence_of(lines)),
                .summary = fmt::format("{}", fmt::join(lines, "\n")),
                .notes = notes_of(data, fit),
                .model = model_text(request, data, fit),
                .maps = {{"map", "m", fit.map}, {"map_sd", "m", fit.map_sd}},
                .map_rows = data.rows,
                .map_columns = data.columns};
  result.held_out = {.left_out = "each distance",
                     .before = fit.before.value,
                     .after = fit.after.value,
                     .causes =
                         "a pattern that is smaller than the noise of the means (record more frames), boards that "
                         "were corrected already, a board that moved or was changed between the distances",
                     .used = used_of(data.campaign.boards)};
  if (fit.has_slope) {
    result.maps.push_back({"slope_map", "", fit.slope});
    result.maps.push_back({"slope_map_sd", "", fit.slope_sd});
  }
  return result;
}

}  // namespace tofgraph::calibration
