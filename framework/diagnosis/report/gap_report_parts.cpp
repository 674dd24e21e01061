// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/report/gap_report_parts.hpp"

#include "config/quantity.hpp"
#include "diagnosis/data/search_settings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

namespace tofgraph::diagnosis {

namespace {

constexpr double skewed = 0.2;  ///< fraction of half an interval

struct Scale {
  std::string_view unit, shown;
  double factor;
};
constexpr std::array<Scale, 4> scales = {
    {{"m", "mm", 1e3}, {"s", "ms", 1e3}, {"rad", "deg", 180 / std::numbers::pi}, {"m/s", "mm/ms", 1}}};

/// Number of decimals that gives an uncertainty two digits; negative: tens, hundreds.
int digits_of(double uncertainty) {
  if (!(uncertainty > 0 && std::isfinite(uncertainty))) return 4;
  const int leading = physics::to_integer(std::floor(std::log10(uncertainty)), 0);
  return 1 - leading;
}

/// Value with this number of significant digits, without an exponent for large numbers.
std::string rounded(double value, int digits) {
  return fmt::format("{}", std::stod(fmt::format("{:.{}e}", value, digits - 1)));
}

std::string number(double value, int digits) {
  constexpr int max_digits = 7;
  if (digits <= max_digits && std::abs(value) < 0.5 * std::pow(10, -digits)) value = 0;  // avoids "-0.00"
  if (digits > max_digits) return fmt::format("{:.{}e}", value, 2);
  if (digits >= 0) return fmt::format("{:.{}f}", value, digits);
  const double unit = std::pow(10, -digits);
  return fmt::format("{:.0f}", std::round(value / unit) * unit);
}

}  // namespace

std::string with_uncertainty(double value, const Interval& interval, std::string_view unit, int digits) {
  const auto found = std::ranges::find(scales, unit, &Scale::unit);
  const double factor = found == scales.end() ? 1 : found->factor;
  const std::string_view shown = found == scales.end() ? unit : found->shown;
  const std::string after = shown.empty() ? "" : " " + std::string(shown);
  if (!std::isfinite(interval.low) || !std::isfinite(interval.high)) return rounded(factor * value, digits) + after;
  const double half = factor * (interval.high - interval.low) / 2;
  const double off_centre = factor * std::abs((interval.low + interval.high) / 2 - value);
  const int decimals = digits_of(half);
  const auto text = [&](double v) { return number(v, decimals) + after; };
  if (off_centre > skewed * half)
    return fmt::format("{} ({} to {})", text(factor * value), text(factor * interval.low),
                       text(factor * interval.high));
  return fmt::format("{} \u00b1 {}", text(factor * value), text(half));
}

std::string text_of(const MeasuredContrast& contrast) {
  constexpr double least = 1e-4, few = 1e-3;  // of an uncertainty; more digits are meaningless for a camera
  const double half = (contrast.high - contrast.low) / 2;
  return (half < few ? fmt::format("{:.4f} \u00b1 {:.4f}", contrast.value, std::max(half, least))
                     : with_uncertainty(contrast.value, {contrast.low, contrast.high}, "")) +
         " (statistical)";
}

std::string shown(double value, std::size_t observable, int digits, bool sign) {
  if (!std::isfinite(value)) return "-";
  return fmt::format("{} {}", report::plain(scaled(value, observable), digits, sign), unit_of(observable));
}
std::string shown_within(double value, double uncertainty, std::size_t observable, bool sign) {
  if (!std::isfinite(value)) return "-";
  constexpr double smallest = 1e-4;  // mm or percent
  const double v = scaled(value, observable), u = scaled(uncertainty, observable);
  // A residual may be smaller than its standard deviation; a gap is always shown with at least its first two digits.
  double least = u >= smallest ? u : std::abs(v);
  if (!sign && std::abs(v) >= smallest) least = std::min(least, std::abs(v));
  if (least < smallest || (!sign && std::abs(v) < smallest)) return "0 " + unit_of(observable);
  int decimals = 1 - physics::to_integer(std::floor(std::log10(least)), 0);
  constexpr int max_digits = 3;  // of a large gap with a narrow interval
  if (!sign)
    decimals = std::min(decimals, max_digits - 1 - physics::to_integer(std::floor(std::log10(std::abs(v))), 0));
  const double step = std::pow(10, -decimals);
  const double rounded = std::round(v / step) * step;
  const int places = std::clamp(decimals, 0, 6);
  return sign && rounded != 0
             ? fmt::format("{:+.{}f} {}", rounded, places, unit_of(observable))
             : fmt::format("{:.{}f} {}", std::abs(rounded) > 0 ? rounded : 0, places, unit_of(observable));
}

std::string shown_gap(double value, const Gap& gap, std::size_t observable) {
  return shown_within(value, (gap.held_out_high - gap.held_out_low) / 2, observable);
}
std::vector<Pattern> by_size(std::vector<Pattern> patterns, const std::array<Gap, observables>& gaps) {
  constexpr double hardly = 1.5;  // of the gap: effects fitted beside a curve compensate part of it
  std::erase_if(patterns, [&](const Pattern& p) { return p.size > hardly * gaps[p.observable].before; });
  std::ranges::stable_sort(patterns, [](const Pattern& one, const Pattern& other) {
    return one.observable != other.observable ? one.observable < other.observable : one.size > other.size;
  });
  return patterns;
}
double scaled(double value, std::size_t observable) { return (observable == distance ? 1e3 : 100) * value; }
std::string unit_of(std::size_t observable) { return observable == distance ? "mm" : "%"; }
std::string label(std::size_t observable) { return observable_labels.at(observable); }

std::string setting_of(const io::Condition& c) {
  std::string text =
      c.is_capped() ? "capture with the lens capped" : fmt::format("board at {:.4g} m", c.board_distance);
  const auto tilted = [&](double tilt, const char* axis) {
    if (std::abs(tilt) > 1e-6)
      text += fmt::format(", tilted by {:.3g} deg about {}", tilt * 180 / std::numbers::pi, axis);
  };
  tilted(c.board_tilt_x, "x");
  tilted(c.board_tilt_y, "y");
  if (!c.target.empty() && !c.is_capped()) text += ", target " + c.target;
  if (std::isfinite(c.integration_time)) text += ", " + config::format_quantity(c.integration_time, "s");
  if (!c.sources.empty()) text += fmt::format(", source {} alone", fmt::join(c.sources, " + "));
  if (c.ambient != "dark") text += ", ambient light: " + c.ambient;
  if (c.rail == "covered") text += ", rail covered";
  if (c.reference == "laser") text += ", distance by a laser";
  if (c.roll != 0) text += fmt::format(", rolled by {:.3g} deg", c.roll * 180 / std::numbers::pi);
  return text;
}

std::string setting_of(const NextCondition& next) {
  const double since = next.condition.time_since_power_on;
  return setting_of(next.condition) +
         (std::isfinite(since) ? fmt::format(", {:.3g} min after power-on", since / 60) : "");
}

std::string asked_of(const std::string& effect, const std::string& value) {
  return (value.empty() ? "whether there is " : "the " + value + " of ") + effect;
}

std::string sigmas(const NextCondition& next) {
  constexpr int beyond_doubt = 100;
  const bool says_nothing_more = next.sigma > beyond_doubt && next.measured_sigma < beyond_doubt;
  return says_nothing_more ? fmt::format("more than {}", beyond_doubt) : fmt::format("{:.1f}", next.sigma);
}

std::string sides_of(const NextCondition& next, const char* between) {
  return fmt::format("{}{}{}", fmt::join(std::span(next.effects).first(next.effects.size() - 1), " with "), between,
                     next.effects.back());
}

std::string sentence(const NextCondition& next) {
  if (next.sigma < settings.min_distinction)
    return fmt::format(
        "None of {} conditions can {}: in the best one the models differ by {:.1f} standard deviations of one "
        "condition.",
        next.candidates,
        next.effects.size() > 1 ? "distinguish " + sides_of(next, " and ")
                                : "determine " + asked_of(next.effects.front(), next.value),
        next.sigma);
  const std::string models =
      next.effects.size() > 1 ? sides_of(next, " and ") + " differ"
      : !next.value.empty()
          ? fmt::format("{} with a small {} and with a large one differ", next.effects.front(), next.value)
          : fmt::format("the model and the one with {} at half its typical size differ", next.effects.front());
  return fmt::format(
      "Measure a {}: there {} by {} standard deviations of one condition ({} of {}, root mean square); in the "
      "conditions measured so far by {:.1f} at most.",
      setting_of(next), models, sigmas(next), shown(next.difference, next.observable, 2), label(next.observable),
      next.measured_sigma);
}

double mean(const std::vector<double>& values) {
  double sum = 0, count = 0;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    sum += v;
    ++count;
  }
  return count > 0 ? sum / count : NAN;
}

double scale_of(const std::vector<double>& values) {
  constexpr double smallest = 1e-3;  // mm or percent: smaller values are rounding errors, not a pattern
  return std::max(report::percentile_98(values), smallest);
}

report::FieldMap sensor_map(const Design& design, const std::vector<double>& values, const std::vector<double>& sd,
                            std::size_t observable, const std::string& title) {
  const simulation::Pixels& pixels = design.pixels();
  report::FieldMap map{.title = title, .unit = unit_of(observable), .rows = pixels.rows, .columns = pixels.columns};
  for (std::size_t s = 0; s < values.size(); ++s)
    map.fields.push_back({scaled(values[s], observable),
                          std::isfinite(values[s])
                              ? fmt::format("row {}, column {} of {} x {}: {}, standard deviation {}",
                                            s / pixels.columns + 1, s % pixels.columns + 1, pixels.rows, pixels.columns,
                                            shown(values[s], observable, 3, true), shown(sd[s], observable))
                              : "nothing was measured here"});
  return map;
}

}  // namespace tofgraph::diagnosis
