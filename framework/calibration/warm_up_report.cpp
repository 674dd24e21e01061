// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/report_text.hpp"
#include "calibration/warm_up.hpp"
#include "config/quantity.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::calibration {
namespace {

using Row = std::vector<std::string>;
using config::format_quantity;

/// Text with the number of digits justified by the uncertainty.
std::string estimate(const Estimate& e, double scale) {
  if (!std::isfinite(e.value)) return "-";
  if (!std::isfinite(e.sd)) return fmt::format("{:.3g} (sd not determined)", e.value * scale);
  const int leading = physics::to_integer(std::floor(std::log10(std::max(e.sd * scale, 1e-9))), 0);
  const int digits = std::clamp(1 - std::clamp(leading, -9, 9), 0, 5);
  return fmt::format("{:.{}f} +- {:.{}f}", e.value * scale, digits, e.sd * scale, digits);
}

class WarmUpReport {
 public:
  WarmUpReport(const WarmUpData& data, const std::vector<Drift>& drifts) : data_(data), drifts_(drifts) {}

  report::Page make(const WarmUpModel& model, double tolerance, const std::string& verdict) {
    page_.verdict(verdict);
    page_.paragraph(fmt::format("Camera '{}'. {}.", data_.campaign.conditions.camera->view().name,
                                described(data_.campaign.boards)));
    page_.heading("Drift since power-on");
    page_.figures(drift_curves(),
                  "Mean of the measured distance in the reported window (of the conditions or --roi; default: the four "
                  "centre pixels) and the drift that was fitted to all pixels, as in figure 3.2 of the reference.");
    table();
    held_out();
    page_.heading("Settling time");
    settling(tolerance);
    frame_errors();
    add_model(model);
    return std::move(page_);
  }

 private:
  std::string name(const Series& s) const {
    return fmt::format("{}, {}, {}", name_of(data_.campaign.boards, s.target), format_quantity(s.distance, "m"),
                       format_quantity(s.integration_time, "s"));
  }

  static report::Chart plot_of(const std::string& title, const std::string& y_label) {
    return {.title = title, .x_label = "time since power-on, min", .y_label = y_label};
  }

  std::vector<std::string> drift_curves() const {
    std::vector<std::string> plots;
    for (std::size_t i = 0; i < drifts_.size(); ++i) {
      const Series& s = data_.series[i];
      report::Series measured{.name = "measured", .style = report::Series::Style::points}, fit{.name = "fitted"};
      std::vector<double> shifts;  // from the fit to the window
      for (std::size_t k = 0; k < s.points.size(); ++k) {
        if (!std::isfinite(s.window_means[k])) continue;
        measured.add(s.time(k) / 60, s.window_means[k] * 1e3);
        shifts.push_back(s.window_means[k] - drifts_[i].at(s.time(k)));
      }
      if (shifts.empty()) continue;
      constexpr int steps = 300;
      const double end = s.time(s.points.size() - 1), shift = moments_of(shifts).mean;
      for (int k = 0; k <= steps; ++k) {
        fit.add(end * k / steps / 60, (drifts_[i].at(end * k / steps) + shift) * 1e3);
      }
      report::Chart plot = plot_of(name(s), "measured distance, mm");
      plot.series = {measured, fit};
      plots.push_back(report::chart(plot, 540, 320));
    }
    return plots;
  }

  void frame_errors() {
    page_.heading("Error of a frame");
    std::vector<std::string> plots;
    std::vector<Row> rows;
    for (const Series& s : data_.series) {
      report::Series rmse{.name = "RMSE"}, bias{.name = "|bias|"}, noise{.name = "noise"};
      for (std::size_t k = 0; k < s.points.size(); ++k) {
        for (auto [curve, value] :
             {std::pair{&rmse, s.errors[k].rmse}, {&bias, std::abs(s.errors[k].bias)}, {&noise, s.errors[k].noise}}) {
          if (!std::isfinite(value)) continue;
          curve->add(s.time(k) / 60, value * 1e3);
        }
      }
      report::Chart plot = plot_of(name(s), "error of a frame, mm");
      for (const report::Series& curve : {rmse, bias, noise}) {
        if (!curve.marks.empty()) plot.series.push_back(curve);
      }
      plots.push_back(report::chart(plot, 540, 320));
      for (const double hours : {0.0, 0.5, 1.0, 2.0, 4.0, 8.0}) {
        const auto k = static_cast<std::size_t>(
            std::ranges::min_element(
                s.points, {},
                [&](const Board* b) { return std::abs(b->condition.time_since_power_on - hours * 3600); }) -
            s.points.begin());
        if (!rows.empty() && rows.back()[0] == name(s) && rows.back()[1] == fmt::format("{:.0f}", s.time(k) / 60))
          continue;
        const FrameError& e = s.errors[k];
        rows.push_back(
            {name(s), fmt::format("{:.0f}", s.time(k) / 60), mm(e.rmse), mm(e.bias), mm(e.noise), mm(e.pattern)});
      }
    }
    page_.figures(plots,
                  "Root mean square over the pixels of the offset-corrected against the modelled distance (3.1) of a "
                  "single frame, as in figure 3.3 of the reference. One offset corrects the whole series.");
    page_.table(
        Row{"series", "time since power-on, min", "RMSE, mm", "bias, mm", "noise, mm", "pattern of the pixels, mm"},
        rows);
    page_.paragraph(fmt::format(
        "RMSE^2 = bias^2 + noise^2 + pattern^2. The offset is that measured {} after power-on (--corrected-at).",
        minutes_of_correction()));
  }

  std::string minutes_of_correction() const {
    std::vector<std::string> times;
    for (const Series& s : data_.series) {
      std::string text = fmt::format("{:.0f} min", s.corrected_at / 60);
      if (std::ranges::find(times, text) == times.end()) times.push_back(text);
    }
    return fmt::format("{}", fmt::join(times, ", "));
  }

  void table() {
    std::vector<Row> rows;
    for (std::size_t i = 0; i < drifts_.size(); ++i) {
      const Series& s = data_.series[i];
      const Drift& d = drifts_[i];
      const Moments m = s.window_moments();
      rows.push_back({name(s), fmt::format("{}", s.points.size()), fmt::format("{:.0f}", s.span() / 60), mm(m.mean, 1),
                      mm(m.sd, 1), d.seen ? estimate(d.drift, 1e3) : no_drift(d),
                      d.seen ? estimate(d.time_constant, 1.0 / 60) : "-", estimate(d.slow_drift, 1e3),
                      estimate(d.slow_time_constant, 1.0 / 60), estimate(d.droop, 100), mm(d.scatter)});
    }
    page_.table(Row{"series", "points", "over, min", "mean, mm", "sd over time, mm", "drift, mm", "time constant, min",
                    "slow drift, mm", "its time constant, min", "droop of the light, %", "scatter left, mm"},
                rows);
    page_.paragraph(
        "D(t) = start + drift (1 - exp(-t / time constant)), with a second, slow term if the data require it. "
        "Uncertainties are standard deviations; they allow for correlated errors of successive points. "
        "Mean and standard deviation are over the time of the whole recording, of the reported window, as in table 3.1 "
        "of the reference: the weights are those of the trapezoidal rule, so that dense points do not count more.");
  }

  static std::string no_drift(const Drift& d) {
    return std::isfinite(d.upper_limit) ? fmt::format("none, at most {}", mm(d.upper_limit)) : "undetermined";
  }

  void held_out() {
    std::vector<Row> rows;
    for (std::size_t i = 0; i < drifts_.size(); ++i) {
      const Drift& d = drifts_[i];
      if (std::isfinite(d.held_out_after.value))
        rows.push_back({name(data_.series[i]), interval_mm(d.held_out_before), interval_mm(d.held_out_after)});
    }
    if (rows.empty()) return;
    page_.table(Row{"held out: inner fifths of the time", "a constant distance, mm (95 %)", "the fit, mm (95 %)"},
                rows);
    page_.paragraph("Root mean square of measured minus predicted values in the held-out fifth.");
  }

  void settling(double tolerance) {
    std::vector<double> all(tolerances.begin(), tolerances.end());
    if (std::ranges::find(all, tolerance) == all.end()) all.push_back(tolerance);
    Row header = {"series"};
    for (const double t : all) header.push_back(fmt::format("within {}, min", format_quantity(t, "m")));
    std::vector<Row> rows;
    for (std::size_t i = 0; i < drifts_.size(); ++i) {
      const Series& s = data_.series[i];
      Row row = {name(s)};
      for (const double t : all) {
        const double settled = settled_after(drifts_[i], t, s.time(s.points.size() - 1));
        row.push_back(std::isfinite(settled) ? fmt::format("{:.1f}", settled / 60) : "-");
      }
      rows.push_back(row);
    }
    page_.table(header, rows);
    page_.paragraph(
        "Time from which the fitted distance stays that close to its final value, which may be reached after the "
        "recording; '-': the drift is not significant, or its time constant is not determined.");
  }

  void add_model(const WarmUpModel& m) {
    page_.heading("As one effect");
    if (!std::isfinite(m.drift.value))
      return page_.paragraph("No effect was written: there is no drift that one effect can describe.");
    page_.paragraph(
        fmt::format("warm_up with a drift of {} mm at an integration time of {}, growing as its power {:.2f}; time "
                    "constant {} min. The drift of a single series differs by at most {} mm from it. model_correction "
                    "undoes it if frames state their time since power-on.",
                    estimate(m.drift, 1e3), format_quantity(m.reference_time, "s"), m.exponent.value,
                    estimate(m.time_constant, 1.0 / 60), mm(m.misfit)));
  }

  const WarmUpData& data_;
  const std::vector<Drift>& drifts_;
  report::Page page_{"Warm-up"};
};

}  // namespace

report::Page warm_up_report(const WarmUpData& data, const std::vector<Drift>& drifts, const WarmUpModel& model,
                            double tolerance, const std::string& verdict) {
  return WarmUpReport(data, drifts).make(model, tolerance, verdict);
}

}  // namespace tofgraph::calibration
