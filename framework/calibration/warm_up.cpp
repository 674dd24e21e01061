// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The calibration `warm-up`: the file, the model and the summary.
#include "calibration/warm_up.hpp"

#include "config/quantity.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::calibration {
namespace {

using config::format_quantity;

constexpr double usual_tolerance = 2e-3;  ///< m
constexpr double max_relative_sd = 0.25;  ///< limit for a time constant in the file
constexpr double significant = 3;         ///< standard deviations

std::string minutes(double seconds) { return fmt::format("{:.2f} min", seconds / 60); }

constexpr const char* sd_not_determined = " (standard deviation not determined)";

std::string minutes(const Estimate& e) {
  return minutes(e.value) + (std::isfinite(e.sd) ? " +- " + minutes(e.sd) : sd_not_determined);
}

std::string millimetres(const Estimate& e) {
  return std::isfinite(e.sd) ? fmt::format("{:.2f} +- {:.2f} mm", e.value * 1e3, e.sd * 1e3)
                             : fmt::format("{:.2f} mm{}", e.value * 1e3, sd_not_determined);
}

/// Mean of values, weighted by their inverse variances.
Estimate weighted(const std::vector<Estimate>& all) {
  double weights = 0, sum = 0;
  for (const Estimate& e : all) {
    const double weight = 1 / (e.sd * e.sd);
    weights += weight;
    sum += weight * e.value;
  }
  return all.empty() ? Estimate{} : Estimate{sum / weights, 1 / std::sqrt(weights)};
}

/// Checks that the recordings determine a time constant. @throws config::ConfigurationError with the sufficient length
void check_long_enough(const Request& request, const WarmUpData& data, const std::vector<Drift>& drifts) {
  double longest = 0, earliest = data.series.front().time(0);
  bool determined = false, seen = false;
  std::size_t clearest = 0;
  for (std::size_t i = 0; i < drifts.size(); ++i) {
    const Series& s = data.series[i];
    const Drift& d = drifts[i];
    longest = std::max(longest, s.span());
    earliest = std::min(earliest, s.time(0));
    seen = seen || d.seen;
    determined = determined || (d.seen && d.time_constant.sd < max_relative_sd * d.time_constant.value &&
                                d.time_constant.value < s.span());
    if (d.seen &&
        std::abs(d.drift.value / d.drift.sd) > std::abs(drifts[clearest].drift.value / drifts[clearest].drift.sd))
      clearest = i;
  }
  if (determined) return;
  constexpr double day = 86400;  // s
  const auto refuse = [&](const std::string& what, double length) {
    if (length > day)
      throw config::ConfigurationError(fmt::format(
          "{}: error: {}\n  the noise is too large for that drift: average more frames or pixels at each point in time",
          request.campaign.string(), what));
    throw config::ConfigurationError(fmt::format("{}: error: {}\n  record for {} or more from power-on",
                                                 request.campaign.string(), what,
                                                 minutes(std::ceil(length / 60) * 60)));
  };
  if (!seen && earliest > usual_time_constant)
    refuse(fmt::format("the recording begins {} after power-on and shows no drift: the camera was already warm",
                       minutes(earliest)),
           3 * usual_time_constant);
  if (!seen) {
    if (longest >= 3 * usual_time_constant) return;  // long enough to exclude a drift
    refuse(fmt::format("{} since power-on show no drift, which takes 5 to 20 min: they are too short to exclude one",
                       minutes(longest)),
           3 * usual_time_constant);
  }
  const Series& s = data.series[clearest];
  const double interval = s.span() / static_cast<double>(s.points.size() - 1);
  refuse(fmt::format("{} since power-on are too short for a time constant: {}", minutes(s.span()),
                     minutes(drifts[clearest].time_constant)),
         std::max(sufficient_span(drifts[clearest], interval), 1.5 * s.span()));
}

std::vector<double> times_of(const Series& s) {
  std::vector<double> t;
  for (std::size_t i = 0; i < s.points.size(); ++i) t.push_back(s.time(i));
  return t;
}

/// Fits the error of the distance, whose mean, unlike that of the distance, hardly depends on the pixels excluded at a
/// point in time.
Drift fit(const Series& s) {
  std::vector<double> distance, amplitude;
  for (const Board* b : s.points) {
    distance.push_back(b->measured.mean - b->modelled.mean);
    if (std::isfinite(b->amplitude)) amplitude.push_back(b->amplitude);
  }
  Drift drift = fit_drift(times_of(s), distance);
  if (amplitude.size() == distance.size()) {
    drift.droop = fit_droop(times_of(s), amplitude, drift.seen ? drift.time_constant.value : usual_time_constant);
    drift.droop.sd *= std::sqrt(drift.redundancy);
  }
  return drift;
}

/// Writes the error of a frame at each point in time, all series one after another.
void write_errors(const WarmUpData& data, io::CalibrationWriter& writer) {
  io::Calibrated series, time, rmse, bias, noise;
  for (std::size_t i = 0; i < data.series.size(); ++i) {
    for (std::size_t k = 0; k < data.series[i].points.size(); ++k) {
      const FrameError& e = data.series[i].errors[k];
      series.value.push_back(static_cast<double>(i));
      time.value.push_back(data.series[i].time(k));
      rmse.value.push_back(e.rmse);
      bias.value.push_back(e.bias);
      noise.value.push_back(e.noise);
    }
  }
  writer.column("point_series", series, "", 1);
  writer.column("point_time", time, "s", 1);
  writer.column("point_rmse", rmse, "mm", 1e-3);
  writer.column("point_bias", bias, "mm", 1e-3);
  if (known(noise)) writer.column("point_noise", noise, "mm", 1e-3);
}

void write_values(const WarmUpData& data, const std::vector<Drift>& drifts, const WarmUpModel& model, double tolerance,
                  io::CalibrationWriter& writer) {
  std::vector<std::string> labels;
  for (const std::string& label : data.campaign.boards.targets) labels.push_back(config::yaml_word(label));
  writer.setting("targets", fmt::format("[{}]", fmt::join(labels, ", ")));
  writer.setting("tolerance", format_quantity(tolerance, "m"));
  if (std::isfinite(model.drift.value)) {
    writer.number("model_drift", model.drift.value, model.drift.sd, "mm", 1e-3);
    writer.number("model_time_constant", model.time_constant.value, model.time_constant.sd, "s", 1);
    writer.number("exponent", model.exponent.value, model.exponent.sd, "", 1);
    writer.number("reference_time", model.reference_time, unknown, "ms", 1e-3);
  }
  struct Column {
    const char *name, *unit;
    double scale;
    io::Calibrated values;
  };
  Column columns[] = {{"target", "", 1, {}},         {"distance", "mm", 1e-3, {}}, {"integration_time", "ms", 1e-3, {}},
                      {"mean", "mm", 1e-3, {}},      {"sd", "mm", 1e-3, {}},       {"drift", "mm", 1e-3, {}},
                      {"time_constant", "s", 1, {}}, {"droop", "", 1, {}},         {"settled", "s", 1, {}},
                      {"scatter", "mm", 1e-3, {}}};
  for (std::size_t i = 0; i < drifts.size(); ++i) {
    const Series& s = data.series[i];
    const Drift& d = drifts[i];
    const Moments m = s.window_moments();
    const Estimate row[] = {{static_cast<double>(s.target)},
                            {s.distance},
                            {s.integration_time},
                            {m.mean},
                            {m.sd},
                            d.drift,
                            d.time_constant,
                            d.droop,
                            {settled_after(d, tolerance, s.time(s.points.size() - 1))},
                            {d.scatter}};
    for (std::size_t k = 0; k < std::size(row); ++k) {
      columns[k].values.value.push_back(row[k].value);
      columns[k].values.sd.push_back(row[k].sd);  // the writer omits those of a column if one is unknown
    }
  }
  for (const Column& c : columns) {
    if (known(c.values)) writer.column(c.name, c.values, c.unit, c.scale);
  }
  write_errors(data, writer);
}

std::string model_text(const Request& request, const WarmUpData& data, const WarmUpModel& m) {
  std::string text = model_head(request, data.campaign.conditions, data.campaign.boards.serial);
  if (!std::isfinite(m.drift.value)) return text + "effects: []  # no drift that one effect can describe\n";
  text += fmt::format("effects:\n  - {{effect: warm_up, drift: {}, time_constant: {}",
                      format_quantity(m.drift.value, "m"), format_quantity(m.time_constant.value, "s"));
  if (std::abs(m.droop.value) > significant * m.droop.sd) text += fmt::format(", droop: {:.6g}", m.droop.value);
  if (std::isfinite(m.slow_drift.value))
    text += fmt::format(", slow_drift: {}, slow_time_constant: {}", format_quantity(m.slow_drift.value, "m"),
                        format_quantity(m.slow_time_constant.value, "s"));
  if (m.exponent.value != 0)
    text +=
        fmt::format(", exponent: {:.6g}, reference_time: {}", m.exponent.value, format_quantity(m.reference_time, "s"));
  return text + "}\n";
}

std::vector<std::string> summary_of(const WarmUpData& data, const std::vector<Drift>& drifts, double tolerance) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < drifts.size(); ++i) {
    const Series& s = data.series[i];
    const Drift& d = drifts[i];
    const std::string where =
        fmt::format("{} at {}, {}, over {}", name_of(data.campaign.boards, s.target), format_quantity(s.distance, "m"),
                    format_quantity(s.integration_time, "s"), minutes(s.span()));
    if (!d.seen) {
      lines.push_back(std::isfinite(d.upper_limit)
                          ? fmt::format("{}: no drift, at most {:.2f} mm (95 %) with a time constant of 5 to 20 min",
                                        where, d.upper_limit * 1e3)
                          : fmt::format("{}: too late after power-on to show a drift", where));
      continue;
    }
    std::string slow;
    if (d.has_slow())
      slow = fmt::format(" and {} with {}", millimetres(d.slow_drift), minutes(d.slow_time_constant.value));
    const double settled = settled_after(d, tolerance, s.time(s.points.size() - 1));
    lines.push_back(fmt::format(
        "{}: drift {}, time constant {}{}; {}", where, millimetres(d.drift), minutes(d.time_constant), slow,
        std::isfinite(settled) ? fmt::format("within {} after {}", format_quantity(tolerance, "m"), minutes(settled))
                               : "the settling time is not determined"));
  }
  return lines;
}

/// Fits drift, exponent and reference time over the integration times, for drifts of the same sign.
void fit_power(const std::vector<Series>& series, const std::vector<Drift>& drifts,
               const std::vector<std::size_t>& seen, WarmUpModel& model) {
  // ln drift = ln w + q ln(t / t_ref); t_ref, at the weighted mean, is where w is determined best.
  double weights = 0, x_mean = 0, y_mean = 0, xx = 0, xy = 0;
  const auto each = [&](auto&& use) {
    for (const std::size_t i : seen) {
      const double sd = drifts[i].drift.sd / drifts[i].drift.value;
      use(1 / (sd * sd), std::log(series[i].integration_time), std::log(std::abs(drifts[i].drift.value)));
    }
  };
  each([&](double w, double x, double y) {
    weights += w;
    x_mean += w * x;
    y_mean += w * y;
  });
  x_mean /= weights;
  y_mean /= weights;
  each([&](double w, double x, double y) {
    xx += w * (x - x_mean) * (x - x_mean);
    xy += w * (x - x_mean) * (y - y_mean);
  });
  model.exponent = xx > 0 ? Estimate{xy / xx, 1 / std::sqrt(xx)} : Estimate{0, unknown};
  if (!(std::abs(model.exponent.value) > 2 * model.exponent.sd)) model.exponent.value = 0;
  model.reference_time = std::exp(x_mean);
  model.drift = {(drifts[seen.front()].drift.value > 0 ? 1 : -1) * std::exp(y_mean),
                 std::exp(y_mean) / std::sqrt(weights)};
  for (const std::size_t i : seen) {
    const double told =
        model.drift.value * std::pow(series[i].integration_time / model.reference_time, model.exponent.value);
    model.misfit = std::max(model.misfit, std::abs(told - drifts[i].drift.value));
  }
}

}  // namespace

WarmUpModel combine(const std::vector<Series>& series, const std::vector<Drift>& drifts) {
  WarmUpModel model;
  std::vector<std::size_t> seen;
  std::vector<Estimate> taus, droops, slow_taus;
  const auto undetermined = [](const Estimate& e) { return std::isfinite(e.value) && !std::isfinite(e.sd); };
  for (std::size_t i = 0; i < drifts.size(); ++i) {
    if (undetermined(drifts[i].drift) || undetermined(drifts[i].droop))
      model.notes.push_back(
          fmt::format("the series at {}, {} does not determine its drift or droop: standard deviations are omitted",
                      format_quantity(series[i].distance, "m"), format_quantity(series[i].integration_time, "s")));
    if (!drifts[i].seen || !(drifts[i].time_constant.sd < max_relative_sd * drifts[i].time_constant.value)) continue;
    seen.push_back(i);
    taus.push_back(drifts[i].time_constant);
    if (std::isfinite(drifts[i].droop.value) && std::isfinite(drifts[i].droop.sd)) droops.push_back(drifts[i].droop);
    if (drifts[i].has_slow()) slow_taus.push_back(drifts[i].slow_time_constant);
  }
  if (seen.empty()) return model;
  const bool positive = drifts[seen.front()].drift.value > 0;
  if (std::ranges::any_of(seen, [&](std::size_t i) { return (drifts[i].drift.value > 0) != positive; })) {
    model.notes.emplace_back("the drift changes its sign with the integration time: one effect cannot describe that");
    return model;
  }
  model.time_constant = weighted(taus);
  model.droop = weighted(droops);
  double spread = 0;
  for (const Estimate& t : taus) spread = std::max(spread, std::abs(t.value - model.time_constant.value) / t.sd);
  if (spread > significant)
    model.notes.push_back(
        fmt::format("the time constants differ by more than their uncertainty ({:.1f} standard deviations): the model "
                    "has their mean",
                    spread));
  fit_power(series, drifts, seen, model);
  if (slow_taus.size() == seen.size()) {
    model.slow_time_constant = weighted(slow_taus);
    std::vector<Estimate> slow;
    for (const std::size_t i : seen) {  // at the reference time, like the other drift
      const double power = std::pow(series[i].integration_time / model.reference_time, model.exponent.value);
      slow.push_back({drifts[i].slow_drift.value / power, drifts[i].slow_drift.sd / power});
    }
    model.slow_drift = weighted(slow);
  } else if (!slow_taus.empty()) {
    model.notes.push_back(fmt::format(
        "{} of {} series show a second, slow drift: it is not part of the model, as the others do not show it",
        slow_taus.size(), seen.size()));
  }
  return model;
}

namespace {

/// Adds a note if the time constant is implausible, which indicates a wrong unit of the time.
void note_time_constant(const WarmUpModel& model, std::vector<std::string>& notes) {
  constexpr double shortest = 60, longest = 7200;  // s
  if (!std::isfinite(model.time_constant.value)) return;
  if (model.time_constant.value >= shortest && model.time_constant.value <= longest) return;
  notes.push_back(
      fmt::format("the time constant of {} is not typical of a camera that warms up, which takes 5 to 20 min: is "
                  "time_since_power_on in the right unit?",
                  format_quantity(model.time_constant.value, "s")));
}

/// Held-out errors of the significant drifts: inner parts of the time are predicted from the rest.
std::optional<HeldOutErrors> judged(const std::vector<Drift>& drifts) {
  std::vector<double> before, after;
  for (const Drift& d : drifts) {
    if (!d.seen || !std::isfinite(d.held_out_after.value)) continue;
    before.push_back(d.held_out_before.value);
    after.push_back(d.held_out_after.value);
  }
  if (before.empty()) return std::nullopt;
  return HeldOutErrors{.left_out = "each inner fifth of the time",
                       .before = root_mean_square(before),
                       .after = root_mean_square(after),
                       .causes =
                           "times since power-on in another unit or of another session, a board that was moved, a "
                           "camera that was already warm"};
}

}  // namespace

Result calibrate_warm_up(const Request& request) {
  const WarmUpData data = read_warm_up(request);
  const double tolerance = request.accuracy.value_or(usual_tolerance);
  std::vector<Drift> drifts(data.series.size());
  tbb::parallel_for(std::size_t{0}, drifts.size(), [&](std::size_t i) { drifts[i] = fit(data.series[i]); });
  check_long_enough(request, data, drifts);
  const WarmUpModel model = combine(data.series, drifts);
  io::CalibrationWriter writer = writer_for(request, data.campaign, "warm-up");
  write_values(data, drifts, model, tolerance, writer);
  const std::vector<std::string> lines = summary_of(data, drifts, tolerance);
  Result result{.file = writer.text(),
                .page = warm_up_report(data, drifts, model, tolerance, sentence_of(lines)),
                .summary = fmt::format("{}", fmt::join(lines, "\n")),
                .notes = data.campaign.boards.notes,
                .model = model_text(request, data, model),
                .held_out = judged(drifts)};
  if (result.held_out) result.held_out->used = used_of(data.campaign.boards);
  note_time_constant(model, result.notes);
  result.notes.insert(result.notes.end(), model.notes.begin(), model.notes.end());
  return result;
}

}  // namespace tofgraph::calibration
