// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Report of a lens calibration.
#include "calibration/intrinsics.hpp"

#include "calibration/campaign_inputs.hpp"
#include "calibration/intrinsics_plots.hpp"
#include "config/quantity.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::calibration {
namespace {

using Row = std::vector<std::string>;

class IntrinsicsReport {
 public:
  IntrinsicsReport(const std::string& camera, const Intrinsics& result)
      : result_(result), solution_(result.solution), page_("Lens of " + camera) {}

  report::Page make(const std::string& verdict, const std::string& severity, const std::vector<std::string>& lines) {
    page_.verdict(verdict, severity);
    for (std::size_t i = 2; i < lines.size(); ++i) page_.paragraph(sentence_of({lines[i]}));
    lens();
    uncertainty();
    judgement();
    residuals();
    board();
    preview();
    views();
    return std::move(page_);
  }

 private:
  void lens() {
    page_.heading("The lens");
    std::vector<Row> rows;
    for (const std::size_t p : solution_.layout.lens) {
      Row row = {lens::names[p], fmt::format("{:.6g}", solution_.lens[p]), fmt::format("{:.2g}", solution_.sd(p)),
                 p <= lens::cy ? "px" : ""};
      if (solution_.with_distances) row.insert(row.end() - 1, fmt::format("{:.2g}", result_.alone.sd(p)));
      rows.push_back(row);
    }
    Row header = {"", "value", "sd", "unit"};
    if (solution_.with_distances) header.insert(header.end() - 1, "sd from corners alone");
    page_.table(header, rows);
    page_.paragraph(
        "Pixels count from 0, a pixel's centre is at integers. Distortion is OpenCV's model. Standard deviations are "
        "those "
        "of a least-squares fit of the lens, the poses of the board and its bending together, with the scatter that "
        "the "
        "residuals show.");
  }

  void uncertainty() {
    page_.heading("How exactly it projects");
    const double range = typical_range(solution_);
    report::Series centre{.name = "middle"}, corner{.name = "corners of the image"};
    const ProjectionUncertainty projection(solution_);
    const auto width = static_cast<double>(result_.views.observations.width);
    const auto height = static_cast<double>(result_.views.observations.height);
    for (double r = 0.3 * range; r < 5 * range; r *= 1.15) {
      centre.add(r, projection.at((width - 1) / 2, (height - 1) / 2, r));
      double sum = 0;
      for (const double u : {0.05, 0.95})
        for (const double v : {0.05, 0.95}) sum += projection.at(u * width, v * height, r) / 4;
      corner.add(r, sum);
    }
    const std::vector<std::string> plots = {uncertainty_map(result_, range), report::chart({.title = "over the range",
                                                                                            .x_label = "range / m",
                                                                                            .y_label = "sd / px",
                                                                                            .series = {centre, corner},
                                                                                            .logarithmic_x = true})};
    page_.figures(
        plots, fmt::format("Standard deviation, in the worst direction, of the pixel in which a point at rest is seen; "
                           "left at {}, the boards' mean range. It is smallest where boards were seen.",
                           config::format_quantity(std::round(range * 1e3) / 1e3, "m")));
  }

  void judgement() {
    page_.heading("On views left out");
    std::vector<Row> rows;
    if (result_.held_out.done)
      rows.push_back({fmt::format("views left out, in {} parts", result_.held_out.folds),
                      fmt::format("{:.3f} px (95 %: {:.3f} to {:.3f} px)", result_.held_out.rms, result_.held_out.low,
                                  result_.held_out.high),
                      fmt::format("{:.3f} px where they were fitted", result_.held_out.fitted)});
    if (result_.halves.done)
      rows.push_back({"two halves of the views", fmt::format("lenses differ by {:.3f} px", result_.halves.difference),
                      fmt::format("predicted {:.3f} px: {}", result_.halves.predicted,
                                  result_.halves.agree() ? "they agree" : "they do not agree")});
    rows.push_back(structure_row("terms that the lens does not have", result_.lens));
    rows.push_back(structure_row("a bending that the board does not have", result_.board));
    page_.table(Row{"test", "found", "expected"}, rows);
    if (!result_.next.found) return;
    page_.paragraph(fmt::format(
        "The next view that helps most: the board's middle at pixel ({:.0f}, {:.0f}), {} away, tilted by {:.0f} deg "
        "about x "
        "and {:.0f} deg about y. The mean uncertainty would go from {:.3f} px to {:.3f} px.",
        result_.next.pixel[0], result_.next.pixel[1],
        config::format_quantity(std::round(result_.next.centre[2] * 100) / 100, "m"), result_.next.tilt[0] * 180 / M_PI,
        result_.next.tilt[1] * 180 / M_PI, result_.next.before, result_.next.after));
  }

  static Row structure_row(const std::string& name, const Structure& s) {
    return {name, fmt::format("{:.4f} px rms, p = {:.2g}{}", s.size, s.p_value, s.found ? "; " + s.explanation : ""),
            fmt::format("less than {} px, or p above {}", structure_size, structure_p_value)};
  }

  void residuals() {
    page_.heading("Residuals and coverage");
    const std::vector<std::string> plots = {residual_vectors(result_), residual_cloud(result_), coverage_map(result_)};
    page_.figures(plots,
                  "Left: each corner's residual, seen minus predicted, enlarged. Arrows that point the same way "
                  "in one part of the image, view after view, are the lens'; arrows without order are noise. "
                  "Right: how many corners were seen where.");
    if (!solution_.with_distances) return;
    const std::vector<std::string> ranges = {distance_residuals(result_)};
    page_.figures(
        ranges, fmt::format("Measured minus predicted distance of the board's bright parts, mean of each view "
                            "with its scatter, after the offset of {:.2f} mm and the scale of {:+.3f} %. Views "
                            "as a whole scatter by {:.2f} mm.",
                            solution_.range_offset * 1e3, solution_.range_scale * 100, solution_.range_shift_sd * 1e3));
  }

  void board() {
    page_.heading("Where the board was");
    const std::vector<std::string> plots = {boards_from_above(result_, false), boards_from_above(result_, true)};
    page_.figures(plots, "The board in all views, from above and from the side; the camera looks to the right.");
    if (solution_.layout.warp == 3)
      page_.paragraph(
          fmt::format("The board is bent by {:.2f} mm along its columns and {:.2f} mm along its rows, from the "
                      "middle to the edge, and twisted by {:.2f} mm at its corners; positive away from the "
                      "camera.",
                      solution_.warp[0] * 1e3, solution_.warp[1] * 1e3, solution_.warp[2] * 1e3));
    else if (solution_.layout.warp == 1)
      page_.paragraph(
          fmt::format("The board is bent by {:.2f} mm from the middle to the edges.", solution_.warp[0] * 1e3));
  }

  void preview() {
    page_.heading("Undistorted");
    const auto [seen, straight] = undistorted_preview(result_);
    page_.figures(std::vector<std::string>{seen, straight},
                  fmt::format("The image of {} as it was seen, and without distortion.",
                              result_.views.observations.views[solution_.views.front().view].id));
  }

  void views() {
    page_.heading("Views");
    std::vector<Row> rows;
    for (const SolvedView& v : solution_.views) {
      const View& seen = result_.views.observations.views[v.view];
      const auto [tilt_x, tilt_y] = tilts_of(v.pose);
      const auto& t = v.pose.translation;
      double sd = 0;
      for (const Corner& c : seen.corners)
        sd += std::sqrt((c.covariance[0] + c.covariance[2]) / 2) / static_cast<double>(seen.corners.size());
      rows.push_back(
          {seen.id, fmt::format("{}", std::ranges::count(v.used, true)), fmt::format("{:.3f}", v.rms),
           fmt::format("{:.3f}", sd), fmt::format("{:.1f}, {:.1f}, {:.1f}", t[0] * 1e3, t[1] * 1e3, t[2] * 1e3),
           fmt::format("{:.1f}, {:.1f}", tilt_x * 180 / M_PI, tilt_y * 180 / M_PI),
           seen.distances.empty() || !solution_.with_distances ? "-" : fmt::format("{:.2f}", v.range_shift * 1e3)});
    }
    page_.table(Row{"view", "corners", "residual, px", "corner noise, px", "x, y, z of its middle, mm",
                    "tilt about x, y, deg", "distance shift, mm"},
                rows);
  }

  const Intrinsics& result_;
  const LensSolution& solution_;
  report::Page page_;
};

}  // namespace

report::Page intrinsics_report(const std::string& camera, const Intrinsics& result, const std::string& verdict,
                               const std::string& severity, const std::vector<std::string>& lines) {
  return IntrinsicsReport(camera, result).make(verdict, severity, lines);
}

}  // namespace tofgraph::calibration
