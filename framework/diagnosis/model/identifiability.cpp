// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/identifiability.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <fmt/format.h>
#include <boost/math/distributions/chi_squared.hpp>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph::diagnosis {

namespace {

/// True if the confidence region of some parameters, whatever the others are, holds the values at which they are off.
/// The conditions may tell their differences alone, as those of the gains of four samples where light is not known:
/// then each for itself may be anything.
/// @param from where they are off, in units of their typical values @param at their places in the covariance
bool consistent_with_off(const ModelFit& fit, const std::vector<double>& from, const std::vector<Eigen::Index>& at,
                         double lack_of_fit) {
  const auto n = static_cast<Eigen::Index>(at.size());
  const Eigen::MatrixXd covariance = fit.covariance(at, at);
  const Eigen::VectorXd distance = Eigen::Map<const Eigen::VectorXd>(from.data(), n);
  const double square = distance.dot(covariance.ldlt().solve(distance)) / std::max(lack_of_fit, 1.0);
  return square < boost::math::quantile(boost::math::chi_squared(static_cast<double>(n)), settings.joint_confidence);
}

}  // namespace

std::string limit_of(const FreeParameter& p, double value) {
  const double typical = std::abs(p.typical);
  const bool open = p.nonlinear && !p.is_angle() && p.maximum - p.minimum > settings.max_interval_width * typical;
  if (!open || value - p.minimum >= settings.near_limit * typical) return "";
  const std::string unit = p.unit.empty() ? "" : " " + p.unit;
  return fmt::format("its {} went to its limit ({:.3g}{}, of {:.3g}{} at least)", p.name, value, unit, p.minimum, unit);
}

Unidentified identifiability_of(const ModelFit& fit, std::size_t term, std::span<const Interval> all,
                                double lack_of_fit) {
  const Term& one = fit.state.terms[term];
  if (one.maps) return {};
  const std::size_t first = first_parameter(fit.state, term);
  bool off = true;
  std::vector<double> from;
  std::vector<Eigen::Index> at;
  for (std::size_t k = 0; k < one.values.size(); ++k) {
    const FreeParameter& p = one.candidate->free()[k];
    const Interval& interval = all[first + k];
    const double width = interval.high - interval.low;
    if (!p.nonlinear) {
      off = off && interval.low <= p.off && p.off <= interval.high;
      from.push_back((one.values[k] - p.off) / p.typical);
      at.push_back(static_cast<Eigen::Index>(first + k));
    } else if (!p.is_angle() && width > settings.max_interval_width * std::abs(p.typical)) {
      return {fmt::format("these conditions do not tell its {}", p.name), k};
    } else if (std::string limit = limit_of(p, one.values[k]);
               !limit.empty() && width > settings.max_width_at_limit * std::abs(p.typical)) {
      return {std::move(limit), k, true};
    }
  }
  if (!off || !consistent_with_off(fit, from, at, lack_of_fit)) return {};
  return {"all of its sizes may as well be off", std::nullopt};
}

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
