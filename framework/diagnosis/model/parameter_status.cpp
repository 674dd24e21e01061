// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/parameter_status.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace tofgraph::diagnosis {
namespace {

constexpr double skewed = 0.2;  ///< of half an interval

struct Scale {
  std::string_view unit, shown;
  double factor;
};
constexpr std::array<Scale, 4> scales = {
    {{"m", "mm", 1e3}, {"s", "ms", 1e3}, {"rad", "deg", 180 / std::numbers::pi}, {"m/s", "mm/ms", 1}}};

/// Digits behind the point with which an uncertainty has two digits; below 0: of whole tens.
int digits_of(double uncertainty) {
  if (!(uncertainty > 0 && std::isfinite(uncertainty))) return 4;
  const int leading = physics::to_integer(std::floor(std::log10(uncertainty)), 0);
  return 1 - leading;
}

/// So many significant digits, without the exponent that large numbers would get.
std::string rounded(double value, int digits) {
  return fmt::format("{}", std::stod(fmt::format("{:.{}e}", value, digits - 1)));
}

std::string number(double value, int digits) {
  constexpr int max_digits = 7;
  if (digits <= max_digits && std::abs(value) < 0.5 * std::pow(10, -digits)) value = 0;  // never "-0.00"
  if (digits > max_digits) return fmt::format("{:.{}e}", value, 2);
  if (digits >= 0) return fmt::format("{:.{}f}", value, digits);
  const double unit = std::pow(10, -digits);
  return fmt::format("{:.0f}", std::round(value / unit) * unit);
}

}  // namespace

ParameterStatus parameter_status(const FreeParameter& p, const Interval& interval, double variance) {
  const double width = interval.high - interval.low;
  const bool any_angle = p.is_angle() && width >= 2 * std::numbers::pi;
  const bool any_value = interval.low <= p.minimum && interval.high >= p.maximum;
  if (variance >= settings.prior_width * settings.prior_width / 2 || any_angle || any_value)
    return ParameterStatus::not_determined;
  if (!p.nonlinear && interval.low <= p.off && p.off <= interval.high) return ParameterStatus::consistent_with_zero;
  return ParameterStatus::determined;
}

std::string_view parameter_status_name(ParameterStatus status) {
  constexpr std::array<std::string_view, 3> names = {"determined", "holds_zero", "not_determined"};
  return names.at(static_cast<std::size_t>(status));
}

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

}  // namespace tofgraph::diagnosis
