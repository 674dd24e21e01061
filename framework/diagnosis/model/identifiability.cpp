// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/identifiability.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <fmt/format.h>
#include <boost/math/distributions/chi_squared.hpp>

#include <algorithm>
#include <cmath>
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

}  // namespace tofgraph::diagnosis
