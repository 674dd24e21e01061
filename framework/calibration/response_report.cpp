// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/response.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace tofgraph::calibration {
namespace {

using Row = std::vector<std::string>;

std::string response_map(const ResponseData& data, const std::string& title, const char* unit,
                         const std::vector<double>& values) {
  return report::field_map(report::pixel_map(title, unit, data.rows, data.columns, values, false), 380, 320);
}

Row value_row(const std::string& name, const ResponseValue& v, const std::string& profile) {
  const auto text = [](double value) { return std::isfinite(value) ? fmt::format("{:.5g}", value) : std::string("-"); };
  return {name, text(v.value), text(v.sd), text(v.low), text(v.high), profile};
}

bool any_known(const std::vector<double>& values) {
  return std::ranges::any_of(values, [](double v) { return std::isfinite(v); });
}

}  // namespace

report::Page response_report(const io::Campaign& campaign, const ResponseData& data, const ResponseFit& fit,
                             const std::string& verdict) {
  const tofgraph_camera& camera = campaign.camera->view();
  report::Page page("Response");
  page.verdict(verdict, fit.after < fit.before ? "good" : "warn");
  page.paragraph(fmt::format("Camera '{}'{}{}, {} conditions.", camera.name, data.serial.empty() ? "" : ", serial ",
                             data.serial, data.conditions.size()));
  page.heading("The camera");
  page.table(Row{"quantity", "value", "standard deviation", "95 % from", "to", "profile"},
             std::vector<Row>{value_row("contrast", fit.contrast, fmt::format("{:.5g}", camera.contrast)),
                              value_row("gain on the axis, counts m^2/s", fit.gain, fmt::format("{:.5g}", camera.gain)),
                              value_row("dark level of a tap, counts", fit.dark, "-")});
  page.paragraph(
      "The mean of a pixel's taps is I = dark + a / (2 contrast), its amplitude a = gain reflectivity t_int / D_t^2. "
      "Each pixel is fitted over the conditions; the numbers are medians over the pixels, the gain is that of the "
      "axis. Intervals: Student's, from leaving out whole levels (jackknife).");
  page.heading("Held-out conditions");
  const auto percent = [](double share) { return std::isfinite(share) ? fmt::format("{:.3f}", 100 * share) : "-"; };
  page.table(Row{fmt::format("each {} held out", data.axis), "by the profile, %", "by the calibration, %"},
             std::vector<Row>{{"light of a tap", percent(fit.before), percent(fit.after)},
                              {"amplitude", percent(fit.gain_before), percent(fit.gain_after)}});
  page.paragraph("Robust standard deviations over the pixels of the relative error.");
  page.heading("Pixels");
  std::vector<std::string> maps;
  for (const auto& [title, unit, value] :
       {std::tuple{"contrast", "", &fit.contrast}, std::tuple{"gain", "counts m^2/s", &fit.gain},
        std::tuple{"dark level", "counts", &fit.dark}}) {
    if (any_known(value->map)) maps.push_back(response_map(data, title, unit, value->map));
    if (any_known(value->map_sd))
      maps.push_back(response_map(data, fmt::format("{}, standard deviation", title), unit, value->map_sd));
  }
  page.figures(maps, "Grey: not known.");
  return page;
}

}  // namespace tofgraph::calibration
