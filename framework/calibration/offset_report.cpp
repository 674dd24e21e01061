// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/offset_report.hpp"

#include "calibration/report_text.hpp"
#include "config/quantity.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace tofgraph::calibration {
namespace {

using Row = std::vector<std::string>;
using config::format_quantity;

constexpr double per_mm = 1e3;

std::string shape_text(physics::OffsetTable::Shape shape) {
  switch (shape) {
    case physics::OffsetTable::Shape::grid:
      return "Shape of the data: a grid. A monotone curve over the distance for each target and integration time, "
             "linear in the logarithm of the time between them.";
    case physics::OffsetTable::Shape::sheet:
      return "Shape of the data: one integration time at each distance of a target. A monotone curve over the distance "
             "for each target; any other integration time is an extrapolation.";
    default:
      return "Shape of the data: scattered. Errors are interpolated between the nearest samples.";
  }
}

class OffsetReport {
 public:
  OffsetReport(const Campaign& campaign, const physics::OffsetTable& table, const std::vector<HeldOut>& axes)
      : boards_(campaign.boards), camera_(campaign.conditions.camera->view()), table_(table), axes_(axes) {}

  report::Page make(const std::string& verdict) {
    const bool helps = !axes_.empty() && std::ranges::all_of(axes_, [](const HeldOut& a) {
      return !(a.after.high >= a.before.value) && a.after.value < a.before.value;
    });
    page_.verdict(verdict, helps ? "good" : "warn");
    page_.paragraph(fmt::format("Camera '{}'{}{}. {}. {}", camera_.name, boards_.serial.empty() ? "" : ", serial ",
                                boards_.serial, described(boards_), shape_text(table_.shape())));
    before_and_after();
    errors();
    reflectivities();
    conditions();
    return std::move(page_);
  }

 private:
  void before_and_after() {
    page_.heading("Before and after, on held-out levels");
    if (axes_.empty()) return page_.paragraph("No axis has three levels: nothing can be held out and predicted.");
    std::vector<Row> rows;
    std::vector<std::string> plots;
    for (const HeldOut& axis : axes_) {
      std::string name = axis.axis;
      std::ranges::replace(name, '_', ' ');
      rows.push_back({name, fmt::format("{}", axis.levels), fmt::format("{}", axis.predictions.size()),
                      interval_mm(axis.before), interval_mm(axis.after)});
      plots.push_back(left_out_plot(axis, name));
    }
    page_.table(Row{"held out, one at a time", "levels", "conditions", "before, mm (95 % interval)",
                    "after, mm (95 % interval)"},
                rows);
    page_.paragraph(
        "Root mean square of measured minus true depth of the boards' means. Each board is corrected by a table that "
        "was made without its level; the first and the last level are not predicted, as that would be extrapolation. "
        "Intervals: by resampling whole levels.");
    page_.figures(plots, "Measured minus true depth before and after the correction, each level held out in turn.");
  }

  std::string left_out_plot(const HeldOut& axis, const std::string& name) const {
    report::Chart plot{.title = "one " + name + " held out", .x_label = "true depth, m", .y_label = "error, mm"};
    report::Series before{.name = "before", .style = report::Series::Style::points},
        after{.name = "after", .style = report::Series::Style::points};
    for (const Prediction& p : axis.predictions) {
      before.add(boards_.boards[p.board].distance, p.before * per_mm);
      after.add(boards_.boards[p.board].distance, p.after * per_mm);
    }
    plot.series = {before, after};
    return report::chart(plot, 380, 280);
  }

  /// Error of each target over the distance, with the table's interpolation between the boards.
  void errors() {
    page_.heading("The offset");
    report::Chart plot{.title = "measured minus true depth", .x_label = "measured depth, m", .y_label = "error, mm"};
    for (std::size_t target = 0; target < boards_.targets.size(); ++target) {
      const std::string name = name_of(boards_, target);
      std::map<double, std::vector<const Board*>> by_time;
      for (const Board& b : boards_.boards) {
        const bool sheet = table_.shape() != physics::OffsetTable::Shape::grid;
        if (boards_.target_of(b) == target) by_time[sheet ? 0 : b.condition.integration_time].push_back(&b);
      }
      // Only the middle one of several times: curves of all times would overlap.
      const auto& shown = std::next(by_time.begin(), static_cast<std::ptrdiff_t>(by_time.size() / 2))->second;
      report::Series curve{
          .name = by_time.size() > 1
                      ? fmt::format("{}, {}", name, format_quantity(shown.front()->condition.integration_time, "s"))
                      : name};
      add_between(target, shown, curve);
      plot.series.push_back(curve);
    }
    page_.figures(std::vector<std::string>{report::chart(plot, 760, 380)},
                  "One line per target, through its boards; values between them are interpolated.");
    if (table_.shape() == physics::OffsetTable::Shape::grid) page_.figures(maps(), "The error of each board, mm.");
  }

  void add_between(std::size_t target, std::vector<const Board*> boards, report::Series& curve) const {
    std::ranges::sort(boards, {}, [](const Board* b) { return b->corrected.mean; });
    constexpr std::size_t steps = 12;
    for (std::size_t i = 0; i + 1 < boards.size(); ++i) {
      const auto between = [&](double a, double b, double share) { return a + share * (b - a); };
      for (std::size_t k = 0; k <= steps; ++k) {
        const double share = static_cast<double>(k) / steps;
        const double z = between(boards[i]->corrected.mean, boards[i + 1]->corrected.mean, share);
        const double time =
            between(boards[i]->condition.integration_time, boards[i + 1]->condition.integration_time, share);
        curve.add(z, (z - table_.of_target(target, z, time).depth) * per_mm);
      }
    }
  }

  /// Maps with distances as rows and integration times as columns, one per target.
  std::vector<std::string> maps() const {
    std::set<double> distances, times;
    for (const Board& b : boards_.boards) {
      distances.insert(b.distance);
      times.insert(b.condition.integration_time);
    }
    double limit = 0;
    for (const Board& b : boards_.boards) limit = std::max(limit, std::abs(b.error()) * per_mm);
    std::vector<std::string> result;
    for (std::size_t target = 0; target < boards_.targets.size(); ++target) {
      report::FieldMap map{.title = name_of(boards_, target),
                           .unit = "mm",
                           .rows = distances.size(),
                           .columns = times.size(),
                           .fields = std::vector<report::Field>(distances.size() * times.size(), {.value = unknown}),
                           .x_label = "integration time, ms",
                           .limit = limit};
      for (const double t : times) map.x_names.push_back(fmt::format("{:.3g}", t * 1e3));
      for (const double z : distances) map.y_names.push_back(fmt::format("{:.3g} m", z));
      for (const Board& b : boards_.boards) {
        if (boards_.target_of(b) != target) continue;
        const auto row = std::distance(distances.begin(), distances.find(b.distance));
        const auto column = std::distance(times.begin(), times.find(b.condition.integration_time));
        map.fields[static_cast<std::size_t>(row) * map.columns + static_cast<std::size_t>(column)].value =
            -b.error() * per_mm;
      }
      result.push_back(report::field_map(map, 380, 300));
    }
    return result;
  }

  void reflectivities() {
    page_.heading("Reflectivities");
    std::vector<Row> rows;
    for (std::size_t target = 0; target < boards_.targets.size(); ++target) {
      std::vector<double> all;
      for (const Board& b : boards_.boards) {
        if (boards_.target_of(b) == target) all.push_back(b.reflectivity);
      }
      const auto [low, high] = std::ranges::minmax(all);
      const bool is_known = std::isfinite(table_.reflectivity(target));
      rows.push_back({name_of(boards_, target), fmt::format("{}", all.size()),
                      is_known ? fmt::format("{:.3g}", table_.reflectivity(target)) : "not known",
                      is_known ? fmt::format("{:.3g} to {:.3g}", low, high) : "-"});
    }
    page_.table(Row{"target", "conditions", "reflectivity", "over its conditions"}, rows);
    page_.paragraph(fmt::format(
        "Amplitude times D_t^2 / (gain t_int) with the profile's gain of {:.3g} counts m^2/s; falloff over the image: "
        "exp({:.3f} q {:+.3f} q^2), q the squared tangent of the angle to the axis. It only has to be the same for the "
        "same surface.",
        camera_.gain, boards_.falloff[0], boards_.falloff[1]));
  }

  void conditions() {
    page_.heading("Each condition");
    std::vector<Row> rows;
    for (const Board& b : boards_.boards) {
      const auto both = [](const Moments& m) {
        return std::isfinite(m.sd) ? fmt::format("{}\u00a0/\u00a0{}", mm(m.mean), mm(m.sd)) : mm(m.mean);
      };
      rows.push_back({name_of(boards_, boards_.target_of(b)), mm(b.distance, 0),
                      fmt::format("{:.4g}", b.condition.integration_time * 1e3), both(b.modelled), both(b.measured),
                      both(b.corrected), both(b.remodelled), both(b.offset), both(b.final), mm(b.rmse)});
    }
    page_.table(Row{"target", "true depth, mm", "time, ms", "modelled", "measured", "corrected for non-linearity",
                    "re-modelled", "offset", "corrected for both", "RMSE"},
                rows);
    page_.paragraph(
        "Mean / standard deviation over the window's pixels, mm: D_model (6.1), D_mes, D_avg (6.3), D_model1 (6.4), "
        "the offset matrix (6.5), the final depth, and the RMSE (6.7). The last two use the condition's own offset.");
  }

  const Boards& boards_;
  const tofgraph_camera& camera_;
  const physics::OffsetTable& table_;
  const std::vector<HeldOut>& axes_;
  report::Page page_{"Offset by integration time and reflectivity"};
};

}  // namespace

report::Page offset_report(const Campaign& campaign, const physics::OffsetTable& table,
                           const std::vector<HeldOut>& axes, const std::string& verdict) {
  return OffsetReport(campaign, table, axes).make(verdict);
}

}  // namespace tofgraph::calibration
