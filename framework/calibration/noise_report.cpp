// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/noise.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tofgraph::calibration {
namespace {

using Row = std::vector<std::string>;

std::string photon_transfer(const NoiseFit& fit) {
  report::Chart plot{.title = "variance of a tap", .x_label = "counts", .y_label = "variance, counts^2"};
  report::Series measured{.name = "measured", .style = report::Series::Style::points}, model{.name = "fitted"};
  for (std::size_t i = 0; i < fit.bin_level.size(); ++i) {
    measured.add(fit.bin_level[i], fit.bin_variance[i]);
    model.add(fit.bin_level[i], fit.bin_model[i]);
  }
  plot.series = {model, measured};
  return report::chart(plot, 560, 340);
}

std::string sigma_by_amplitude(const NoiseFit& fit) {
  report::Chart plot{.title = "noise of the distance",
                     .x_label = "amplitude, counts",
                     .y_label = "sigma of a frame, mm",
                     .logarithmic_x = true};
  report::Series measured{.name = "measured", .style = report::Series::Style::points},
      predicted{.name = "predicted, level held out"};
  for (const SigmaRatio& bin : fit.amplitudes) {
    measured.add(bin.amplitude, bin.measured * 1e3);
    predicted.add(bin.amplitude, bin.predicted * 1e3);
  }
  plot.series = {predicted, measured};
  return report::chart(plot, 560, 340);
}

std::string map_of(const std::string& title, const NoiseData& data, std::vector<double> values, double limit) {
  report::FieldMap map = report::pixel_map(title, "", data.rows, data.columns, values, false);
  map.limit = limit;
  return report::field_map(map, 480, 400);
}

void add_sigma_table(report::Page& page, const NoiseFit& fit) {
  std::vector<Row> rows;
  for (const SigmaRatio& c : fit.conditions)
    rows.push_back({c.name, std::isfinite(c.integration_time) ? fmt::format("{:.3g}", c.integration_time * 1e3) : "-",
                    fmt::format("{:.0f}", c.amplitude), fmt::format("{:.3f}", c.measured * 1e3),
                    fmt::format("{:.3f}", c.predicted * 1e3), fmt::format("{:.3f}", c.measured / c.predicted),
                    fmt::format("{:.2f}", std::numbers::sqrt2 * c.measured * 1e3)});
  page.table(Row{"condition", "integration time, ms", "amplitude, counts", "sigma measured, mm", "predicted, mm",
                 "ratio", "strength, mm"},
             rows);
  page.paragraph(
      "Root mean square over the pixels of a frame's distance noise. Predicted by a fit without this condition's "
      "level. Strength: h = sqrt(2) sigma (7.9), for a denoiser of this scene; strength: auto takes it from each "
      "frame.");
}

void add_reasons(report::Page& page, const NoiseFit& fit) {
  std::vector<Row> rows;
  for (const BadPixelReason& reason : bad_pixel_reasons()) {
    const auto has = [bit = reason.bit](std::uint8_t bits) { return (bits & bit) != 0; };
    rows.push_back({fmt::format("{}", static_cast<int>(reason.bit)), reason.name,
                    fmt::format("{}", std::ranges::count_if(fit.bad, has)), reason.criterion});
  }
  page.table(Row{"bit", "reason", "pixels", "criterion"}, rows);
  page.paragraph(
      "Every limit is also at least 6 standard deviations of good pixels, so that each criterion rejects less than one "
      "of 1e9 good pixels with normal noise by chance.");
}

}  // namespace

report::Page noise_report(const io::Campaign& campaign, const NoiseData& data, const NoiseFit& fit,
                          const std::string& verdict) {
  report::Page page("Noise");
  const bool right = fit.error < 0.05;
  page.verdict(verdict, !std::isfinite(fit.held_out.value) ? "plain" : right ? "good" : "warn");
  page.paragraph(fmt::format("Camera '{}'{}{}, {} conditions.", campaign.camera->view().name,
                             data.serial.empty() ? "" : ", serial ", data.serial, data.conditions.size()));
  page.heading("Photon transfer");
  page.figures(
      std::vector<std::string>{photon_transfer(fit), sigma_by_amplitude(fit)},
      "Left: half the mean square of a tap's change from frame to frame, as a function of its level; the straight "
      "line is read_noise^2 + shot_noise counts. Right: the resulting noise of the distance, sigma = c / (4 pi f) "
      "s / (sqrt(2) amplitude), s^2 the variance of A - B.");
  page.heading("Each condition");
  if (fit.conditions.empty())
    page.paragraph("There is a single condition: nothing can be held out and predicted.");
  else
    add_sigma_table(page, fit);
  page.heading("Pixels");
  std::vector<double> ratio = fit.ratio, bad(fit.bad.begin(), fit.bad.end());
  page.figures(std::vector<std::string>{map_of("noise over the fitted one", data, std::move(ratio), 2),
                                        map_of("bad pixels (sum of the reasons)", data, std::move(bad), 64)},
               "Left: the noise of each pixel over the fitted one. Right: bad pixels. A profile that names the map "
               "(bad_pixels) excludes them from all calibrations and pipelines.");
  add_reasons(page, fit);
  return page;
}

}  // namespace tofgraph::calibration
