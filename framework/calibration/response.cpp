// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The calibration `response`: the file, its maps and its summary.
#include "calibration/response.hpp"

#include "calibration/campaign_inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace tofgraph::calibration {
namespace {

void write_response(const ResponseFit& fit, const ResponseData& data, io::CalibrationWriter& writer) {
  const auto write = [&](const std::string& key, const ResponseValue& v, const char* unit) {
    if (!std::isfinite(v.value)) return;
    writer.number(key, v.value, v.sd, unit, 1);
    if (std::isfinite(v.low)) writer.column(key + "_interval", {{v.low, v.high}, {}}, unit, 1);
  };
  write("contrast", fit.contrast, "");
  write("gain", fit.gain, "counts m^2/s");
  write("dark", fit.dark, "counts");
  if (std::isfinite(fit.dark_rate)) writer.number("dark_rate", fit.dark_rate, unknown, "counts/s", 1);
  if (std::isfinite(fit.after)) writer.column("held_out", {{fit.before, fit.after}, {}}, "", 1);
  if (std::isfinite(fit.gain_after)) writer.column("held_out_gain", {{fit.gain_before, fit.gain_after}, {}}, "", 1);
  io::Calibrated time, amplitude, intensity;
  for (const ResponseCondition& c : data.conditions) {
    const auto mean = [](const std::vector<float>& values) {
      double sum = 0, count = 0;
      for (const float v : values) {
        if (!std::isfinite(v)) continue;
        sum += static_cast<double>(v);
        count += 1;
      }
      return sum / count;
    };
    time.value.push_back(c.integration_time);
    amplitude.value.push_back(mean(c.amplitude));
    intensity.value.push_back(mean(c.intensity));
  }
  if (!known(time) || !known(amplitude)) return;
  writer.column("integration_time", time, "ms", 1e-3);
  writer.column("amplitude", amplitude, "counts", 1);
  writer.column("intensity", intensity, "counts", 1);
}

std::string interval_text(const ResponseValue& v, int digits) {
  return std::isfinite(v.low) ? fmt::format(" (95 %: {:.{}f} to {:.{}f})", v.low, digits, v.high, digits) : "";
}

std::vector<std::string> lines_of(const ResponseData& data, const ResponseFit& fit, const tofgraph_camera& camera) {
  const std::string profile = camera.contrast > 0 ? fmt::format("; the profile says {:.4g}", camera.contrast) : "";
  std::vector<std::string> lines = {fmt::format("contrast {:.4f}{} from {} conditions{}", fit.contrast.value,
                                                interval_text(fit.contrast, 4), data.conditions.size(), profile)};
  if (std::isfinite(fit.dark.value))
    lines.push_back(
        fmt::format("a tap without light: {:.2f} counts{}", fit.dark.value,
                    std::isfinite(fit.dark_rate) ? fmt::format(" and {:.0f} counts/s", fit.dark_rate) : ""));
  if (std::isfinite(fit.gain.value)) {
    std::string line = fmt::format("gain {:.4g} counts m^2/s on the axis", fit.gain.value);
    if (std::isfinite(fit.gain.low)) line += fmt::format(" (95 %: {:.4g} to {:.4g})", fit.gain.low, fit.gain.high);
    lines.push_back(line + fmt::format("; the profile says {:.4g}", camera.gain));
  }
  if (std::isfinite(fit.after))
    lines.push_back(fmt::format(
        "each {} held out: the light of a tap is predicted to {:.2f} %, by the profile's contrast to {:.2f} %",
        data.axis, 100 * fit.after, 100 * fit.before));
  return lines;
}

void add_response_notes(const ResponseData& data, const ResponseFit& fit, std::vector<std::string>& notes) {
  const std::size_t pixels = data.rows * data.columns;
  if (fit.unknown_pixels > 0)
    notes.push_back(fmt::format("{} of {} pixels were bad, saturated, dark or seen too rarely: in the maps NaN",
                                fit.unknown_pixels, pixels));
  if (fit.outlying_pixels > 0)
    notes.push_back(fmt::format("the contrast of {} of {} pixels differs strongly from that of the others",
                                fit.outlying_pixels, pixels));
  if (data.saturated > 0)
    notes.push_back(fmt::format("{} pixels of single conditions were saturated and excluded there", data.saturated));
  if (!std::isfinite(fit.dark.value))
    notes.emplace_back(
        "the amplitudes vary too little to determine a dark level: it is taken as 0; record other distances, or a "
        "capped lens");
  if (!std::isfinite(fit.gain.value))
    notes.emplace_back("the gain is not known: no condition shows a board of a stated reflectivity");
  else if (fit.gain_after >= fit.gain_before)
    notes.emplace_back("the gain does not predict held-out amplitudes better than the profile's");
  if (!std::isfinite(fit.contrast.low))
    notes.emplace_back("with fewer than three levels none can be held out: the intervals are unknown");
}

}  // namespace

Result calibrate_response(const Request& request) {
  const io::Campaign campaign = read_conditions(request);
  if (campaign.from_table)
    throw config::ConfigurationError(
        fmt::format("{}: error: a table has no taps\n  give conditions with captures", request.campaign.string()));
  refuse_duplicates(campaign);
  const ResponseData data = read_response(campaign, [&](double share) {
    if (request.progress) request.progress(0.8 * share, "reading the campaign");
  });
  const tofgraph_camera& camera = campaign.camera->view();
  ResponseFit fit;
  try {
    fit = fit_response(data, camera);
  } catch (const std::invalid_argument& problem) {
    throw config::ConfigurationError(fmt::format("{}: error: {}\n  record a board at three distances or more",
                                                 request.campaign.string(), problem.what()));
  }
  io::CalibrationWriter writer = writer_for(request, campaign, data.serial, "response");
  writer.setting("maps", maps_of(request.output).filename().string());
  write_response(fit, data, writer);
  const std::vector<std::string> lines = lines_of(data, fit, camera);
  Result result{.file = writer.text(),
                .page = response_report(campaign, data, fit, sentence_of(lines)),
                .summary = fmt::format("{}", fmt::join(lines, "\n")),
                .notes = data.notes,
                .maps = {{"contrast", "", fit.contrast.map},
                         {"contrast_sd", "", fit.contrast.map_sd},
                         {"dark", "counts", fit.dark.map},
                         {"dark_sd", "counts", fit.dark.map_sd},
                         {"gain", "counts m^2/s", fit.gain.map},
                         {"gain_sd", "counts m^2/s", fit.gain.map_sd}},
                .map_rows = data.rows,
                .map_columns = data.columns,
                .held_out = HeldOutErrors{.left_out = "each " + data.axis,
                                          .before = fit.before,
                                          .after = fit.after,
                                          .unit = "% of the light",
                                          .scale = 1e-2,
                                          .causes = "a profile whose contrast is already right, ambient light, taps "
                                                    "near saturation, a warming lamp"}};
  add_response_notes(data, fit, result.notes);
  return result;
}

}  // namespace tofgraph::calibration
