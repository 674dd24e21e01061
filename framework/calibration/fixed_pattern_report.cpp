// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/fixed_pattern_priors.hpp"
#include "calibration/report_text.hpp"
#include "config/quantity.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace tofgraph::calibration {
namespace {

using Row = std::vector<std::string>;

std::vector<double> in_mm(const std::vector<double>& values, const std::vector<double>& sd) {
  std::vector<double> result;
  for (std::size_t i = 0; i < values.size(); ++i) result.push_back(std::isfinite(sd[i]) ? values[i] * 1e3 : unknown);
  return result;
}

class FixedPatternReport {
 public:
  FixedPatternReport(const PatternData& data, const PatternFit& fit) : data_(data), fit_(fit) {}

  report::Page make(const std::string& verdict) {
    page_.verdict(verdict, fit_.after.high < fit_.before.value ? "good" : "warn");
    page_.paragraph(fmt::format("Camera '{}'. {}.", data_.campaign.conditions.camera->view().name,
                                described(data_.campaign.boards)));
    page_.heading("The pattern");
    std::vector<std::string> plots = {map("offset of each pixel", "mm", fit_.map, fit_.map_sd, true),
                                      map("its standard deviation", "mm", fit_.map_sd, fit_.map_sd, false)};
    if (fit_.has_slope) plots.push_back(map("growth with the distance", "mm/m", fit_.slope, fit_.slope_sd, true));
    page_.figures(plots,
                  "Added to the half path at 2 m; the mean over the pixels is 0, as it cannot be distinguished from an "
                  "offset of the whole camera. Grey: seen too rarely.");
    parts();
    left_out();
    boards();
    return std::move(page_);
  }

 private:
  std::string map(const std::string& title, const char* unit, const std::vector<double>& values,
                  const std::vector<double>& sd, bool is_signed) const {
    return report::field_map(report::pixel_map(title, unit, data_.rows, data_.columns, in_mm(values, sd), is_signed),
                             380, 320);
  }

  /// Means of rows or columns. @param along 0: of each column, 1: of each row
  report::Series means(const char* name, int along) const {
    const std::size_t n = along == 0 ? data_.columns : data_.rows;
    std::vector<double> sum(n), count(n);
    for (std::size_t i = 0; i < fit_.map.size(); ++i) {
      if (!std::isfinite(fit_.map_sd[i])) continue;
      const std::size_t at = along == 0 ? i % data_.columns : i / data_.columns;
      sum[at] += fit_.map[i] * 1e3;
      count[at] += 1;
    }
    report::Series curve{.name = name};
    for (std::size_t k = 0; k < n; ++k) {
      if (count[k] == 0) continue;
      curve.add(static_cast<double>(k), sum[k] / count[k]);
    }
    return curve;
  }

  void parts() {
    report::Chart plot{.title = "mean offset of columns and rows", .x_label = "column or row, px", .y_label = "mm"};
    plot.series = {means("columns", 0), means("rows", 1)};
    page_.figures(std::vector<std::string>{report::chart(plot, 640, 300)},
                  "Sensors are addressed by rows and read by columns, which causes steps here.");
  }

  void left_out() {
    page_.heading("Held-out boards");
    if (!std::isfinite(fit_.after.value))
      return page_.paragraph("With fewer than three distances none can be held out and predicted.");
    page_.table(
        Row{"one distance held out", "before, mm (95 % interval)", "after, mm (95 % interval)", "noise alone, mm"},
        std::vector<Row>{{"root mean square over the pixels", interval_mm(fit_.before), interval_mm(fit_.after),
                          mm(fit_.noise_floor)}});
    page_.paragraph(
        "Measured distance minus the model of the board, without its own offset, place and tilt, the board's shape and "
        "the error that depends on the distance: before and after subtracting the pattern, which was estimated without "
        "this distance. Frames were averaged: noise alone is the noise of the average.");
  }

  void boards() {
    page_.heading("The board");
    constexpr std::size_t side = 61;
    std::vector<double> heights;
    for (std::size_t r = 0; r < side; ++r) {
      for (std::size_t c = 0; c < side; ++c)
        heights.push_back(1e3 * shape_at(fit_.shape, 2.0 * static_cast<double>(c) / (side - 1) - 1,
                                         2.0 * static_cast<double>(r) / (side - 1) - 1));
    }
    page_.figures(std::vector<std::string>{report::field_map(
                      {.title = "shape of the board",
                       .unit = "mm",
                       .rows = side,
                       .columns = side,
                       .fields = report::fields_of(heights),
                       .x_label = fmt::format("x, {:.0f} mm a step", 2e3 * data_.extent / (side - 1)),
                       .y_label = "y"},
                      360, 320)},
                  "Depth of the surface behind its plane, in the board's own axes.");
    std::vector<Row> rows;
    for (std::size_t v = 0; v < data_.views.size(); ++v) {
      const io::Condition& c = data_.campaign.conditions.conditions[data_.views[v].condition];
      const ViewPose& p = fit_.poses[v];
      rows.push_back({c.id, fmt::format("{:.0f}", c.board_distance * 1e3), fmt::format("{:.0f}", c.roll * 180 / M_PI),
                      mm(p.offset), mm(p.z), mm(p.tilt_x), mm(p.tilt_y)});
    }
    page_.table(Row{"condition", "distance, mm", "roll, deg", "offset of all pixels, mm", "displacement, mm",
                    "tilt_x, mrad", "tilt_y, mrad"},
                rows);
    page_.paragraph(
        fmt::format("Positions of the boards relative to the campaign: displacements scatter by {} mm and tilts "
                    "by {} mrad. A displacement of all boards cannot be distinguished from the pattern: the mean of "
                    "the displacements is 0. The offset of all pixels is determined by the calibration offset.",
                    mm(fit_.jitter.z), mm(fit_.jitter.tilt_x)));
    page_.paragraph(fmt::format(
        "Priors, standard deviations: displacements at most {:.0f} mm, tilts at most {:.0f} mrad, bending at most "
        "{:.2f} 1/m, offsets at most {:.0f} m, the board's shape at most {:.0f} mm, all estimated from the data; an "
        "error that depends on the distance, as wiggling does, {}. It was estimated as {}. Two starts of the estimate "
        "gave maps that differ by {} mm; the pixels of a view differ "
        "by {} mm (robust standard deviation).",
        pattern::max_jitter.z * 1e3, pattern::max_jitter.tilt_x * 1e3, pattern::max_jitter.bend,
        pattern::max_jitter.offset, pattern::max_shape * 1e3, wave_priors(), waves(), mm(fit_.restart_difference, 4),
        mm(fit_.input_spread)));
  }

  std::string wave_priors() const {
    std::vector<std::string> parts;
    for (const pattern::Harmonic& h : pattern::harmonics)
      parts.push_back(fmt::format("{:.1f} mm in harmonic {:.0f} of the phase{}",
                                  h.amplitude * data_.metres_per_radian * 1e3, h.order,
                                  h.grows_with_faintness ? " at the mean faintness" : ""));
    return fmt::format("{}", fmt::join(parts, ", "));
  }
  std::string waves() const {
    std::vector<std::string> parts;
    for (std::size_t h = 0; h < pattern::harmonics.size(); ++h)
      parts.push_back(fmt::format("{} mm in harmonic {:.0f}", mm(std::hypot(fit_.waves[2 * h], fit_.waves[2 * h + 1])),
                                  pattern::harmonics[h].order));
    return fmt::format("{}", fmt::join(parts, ", "));
  }

  const PatternData& data_;
  const PatternFit& fit_;
  report::Page page_{"Fixed pattern"};
};

}  // namespace

report::Page fixed_pattern_report(const PatternData& data, const PatternFit& fit, const std::string& verdict) {
  return FixedPatternReport(data, fit).make(verdict);
}

}  // namespace tofgraph::calibration
