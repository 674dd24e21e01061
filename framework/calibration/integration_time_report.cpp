// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/integration_time.hpp"

#include "calibration/report_text.hpp"
#include "config/quantity.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tofgraph::calibration {
namespace {

using Row = std::vector<std::string>;
using config::format_quantity;

std::string ms(double seconds) { return std::isfinite(seconds) ? fmt::format("{:.3g}", seconds * 1e3) : "-"; }

/// Plot of the best times of each target over the distance.
std::string best_times(const Boards& boards, const IntegrationTimes& times) {
  report::Chart plot{.title = "best integration time", .x_label = "distance, m", .y_label = "integration time, ms"};
  for (std::size_t target = 0; target < boards.targets.size(); ++target) {
    report::Series curve{.name = name_of(boards, target)};
    for (const Place& place : times.places) {
      if (place.target != target || place.best == nullptr) continue;
      curve.add(place.distance, place.best->condition.integration_time * 1e3);
    }
    if (!curve.marks.empty()) plot.series.push_back(curve);
  }
  return report::chart(plot, 560, 340);
}

std::string smallest_errors(const Boards& boards, const IntegrationTimes& times) {
  report::Chart plot{.title = "RMSE at the best time", .x_label = "distance, m", .y_label = "RMSE, mm"};
  for (std::size_t target = 0; target < boards.targets.size(); ++target) {
    report::Series curve{.name = name_of(boards, target)};
    for (const Place& place : times.places) {
      if (place.target != target || place.best == nullptr) continue;
      curve.add(place.distance, place.best->rmse * 1e3);
    }
    if (!curve.marks.empty()) plot.series.push_back(curve);
  }
  return report::chart(plot, 560, 340);
}

/// RMSE over distance and time, one map per target; unmeasured or saturated fields are grey.
std::vector<std::string> maps(const Boards& boards, const IntegrationTimes& times) {
  std::set<double> distances, all_times;
  for (const Board& b : boards.boards) {
    distances.insert(b.distance);
    all_times.insert(b.condition.integration_time);
  }
  std::vector<std::string> result;
  for (std::size_t target = 0; target < boards.targets.size(); ++target) {
    report::FieldMap map{.title = name_of(boards, target) + ": RMSE",
                         .unit = "mm",
                         .rows = distances.size(),
                         .columns = all_times.size(),
                         .fields = std::vector<report::Field>(distances.size() * all_times.size(), {.value = unknown}),
                         .x_label = "integration time, ms",
                         .signed_values = false,
                         .logarithmic = true};
    for (const double t : all_times) map.x_names.push_back(fmt::format("{:.3g}", t * 1e3));
    for (const double z : distances) map.y_names.push_back(fmt::format("{:.3g} m", z));
    for (const Place& place : times.places) {
      if (place.target != target) continue;
      const auto row = static_cast<std::size_t>(std::distance(distances.begin(), distances.find(place.distance)));
      for (const Board* b : place.times) {
        const auto column = std::distance(all_times.begin(), all_times.find(b->condition.integration_time));
        if (usable(*b, place)) map.fields[row * map.columns + static_cast<std::size_t>(column)].value = b->rmse * 1e3;
      }
    }
    result.push_back(report::field_map(map, 380, 300));
  }
  return result;
}

void add_places(report::Page& page, const Boards& boards, const IntegrationTimes& times, const Request& request) {
  std::vector<Row> rows;
  for (const Place& place : times.places) {
    const Board* best = place.best;
    std::string near = "-";
    if (best != nullptr)
      near = place.shortest < place.longest ? fmt::format("{} to {}", ms(place.shortest), ms(place.longest))
                                            : ms(place.shortest);
    rows.push_back({name_of(boards, place.target), fmt::format("{:.0f}", place.distance * 1e3),
                    fmt::format("{}", place.times.size()),
                    best != nullptr ? ms(best->condition.integration_time) : "all saturated",
                    best != nullptr ? mm(best->rmse) : "-", near, best != nullptr ? mm(best->noise) : "-",
                    ms(place.signal), ms(place.saturates)});
  }
  page.table(Row{"target", "distance, mm", "times", "best, ms", "RMSE, mm", "within 5 %, ms", "noise of a frame, mm",
                 request.accuracy ? fmt::format("{} from, ms", format_quantity(*request.accuracy, "m")) : "signal, ms",
                 "saturates at, ms"},
             rows);
  page.paragraph(
      "RMSE: of the offset-corrected against the modelled distance (6.7), over the pixels of the averaged frames. "
      "Noise: of a pixel's distance in one frame. The last two columns are limits by the camera's profile, for a "
      "surface of the target's reflectivity; '-' if they do not follow from the profile and the campaign.");
}

}  // namespace

report::Page integration_time_report(const Campaign& campaign, const IntegrationTimes& times, const Request& request,
                                     const std::string& verdict) {
  const Boards& boards = campaign.boards;
  report::Page page("Integration times");
  page.verdict(verdict);
  page.paragraph(fmt::format("Camera '{}'. {}.", campaign.conditions.camera->view().name, described(boards)));
  page.heading("The best time");
  page.figures(std::vector<std::string>{best_times(boards, times), smallest_errors(boards, times)},
               "The time with the least RMSE among those with at most 1 % of the pixels saturated.");
  if (times.compares)
    page.figures(maps(boards, times),
                 "Colours by the logarithm. Grey: not measured, too little light, or saturated: a tap was full, or "
                 "would be by the profile's full well if the captures do not show it (phases, distances).");
  else
    page.paragraph(
        "Each target and distance has one integration time here, as in a table of published optima: it is taken as the "
        "optimum, and there are no other times to compare with.");
  if (!times.several.empty()) {
    page.heading("Several integration times");
    std::vector<Row> rows;
    for (const Suggestion& s : times.several) {
      std::string list;
      for (const Place* p : s.places)
        list += fmt::format("{}{} at {}", list.empty() ? "" : ", ", name_of(boards, p->target),
                            format_quantity(p->distance, "m"));
      rows.push_back({ms(s.time), mm(s.worst), list});
    }
    page.table(Row{"time, ms", "error at most, mm", "serves"}, rows);
  }
  page.heading("Each target and distance");
  add_places(page, boards, times, request);
  return page;
}

}  // namespace tofgraph::calibration
