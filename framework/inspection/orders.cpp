// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inspection/orders.hpp"

#include "config/quantity.hpp"
#include "io/unknown.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tofgraph::inspection {
namespace {

constexpr std::size_t frames_of_reading = 4;
constexpr double min_order_gain = 25;           ///< difference of chi-square between orders
constexpr double min_order_explained = 0.9;     ///< share of the mean square deviation that another order explains
constexpr double min_order_deviation = 0.0006;  ///< relative to the length: walls are seldom flatter
constexpr double min_order_cover = 0.5;         ///< pixels in planes, relative to the order with the most

/// Recording decoded with one order.
struct Reading {
  physics::Exposures exposures;
  double length = 0;   ///< m, median
  double covered = 0;  ///< number of pixels in planes; the block size depends on the length
  Flatness flatness;

  double count() const { return static_cast<double>(flatness.count); }
  /// Mean chi-square of a block; 1 for planes with the expected noise.
  double misfit() const { return flatness.chi2 / std::max(count(), 1.0); }
};

Reading reading_of(const io::CaptureReader& capture, const Observation& decoded, const physics::Exposures& order) {
  const Observation o = observe(capture, decoded.camera, frames_of_reading, &order);
  std::vector<double> lengths;
  std::ranges::copy_if(o.length, std::back_inserter(lengths), [](double length) { return std::isfinite(length); });
  const FlatnessTest test(o, surfaces_of(o));
  return {order, lengths.empty() ? io::unknown : physics::median(lengths),
          static_cast<double>(test.surfaces().blocks.size() * test.surfaces().side * test.surfaces().side),
          test(test.stated())};
}

/// Readings under which planes are about as flat as under the best one; all readings if there are no planes.
std::vector<Reading> flat_readings(const std::vector<Reading>& readings) {
  double most = 0, least = 1e9;
  for (const Reading& r : readings) most = std::max(most, r.covered);
  if (most == 0) return readings;
  const auto judged = [most](const Reading& r) { return r.covered >= min_order_cover * most; };
  for (const Reading& r : readings)
    if (judged(r)) least = std::min(least, std::max(r.misfit(), 1.0));  // below 1: within the tolerance
  std::vector<Reading> flat;
  std::ranges::copy_if(readings, std::back_inserter(flat), [&](const Reading& r) {
    return judged(r) &&
           ((r.misfit() - least) * r.count() < min_order_gain || r.flatness.rms < min_order_deviation * r.length);
  });
  return flat;
}

bool same(const physics::Exposures& a, const physics::Exposures& b) {
  return io::exposures_yaml(a) == io::exposures_yaml(b);
}

/// Returns true if only two images or the taps were exchanged.
bool is_simple(const physics::Exposures& order, const physics::Exposures& stated) {
  return std::abs(std::sin(order[0].phase - stated[0].phase)) < 1e-6;
}

/// Returns true if the light does not contradict an order.
bool is_possible(const Reading& reading, const Observation& o) {
  return std::ranges::any_of(o.possible_orders, [&](const auto& order) { return same(order, reading.exposures); });
}

std::string lines_of(const std::vector<Reading>& readings, const physics::Exposures& stated) {
  std::vector<std::string> lines;
  for (const Reading& r : readings)
    lines.push_back(fmt::format("exposures: {} ({}{})", io::exposures_yaml(r.exposures),
                                config::format_quantity(std::round(1e3 * r.length) / 1e3, "m"),
                                same(r.exposures, stated) ? ", as stated" : ""));
  return fmt::format("{}", fmt::join(lines, " or "));
}

/// @param doubt observation that contradicts the stated order, or is caused by something else; may be empty
void add_open_order(Inspection& result, const std::vector<Reading>& flat, const std::string& doubt = "") {
  result.undecided.push_back(fmt::format(
      "the order of the raw images: {}; {}the median distance, half of the path of the light, is in brackets. A known "
      "distance decides: measure that of one point, or record the scene again from a known step farther away: lengths "
      "must rise by the step, and the amplitude must fall",
      lines_of(flat, result.observation.stated), doubt.empty() ? "" : "doubt about the stated order: " + doubt + "; "));
}

/// Finding that the stated order is wrong; the caller adds evidence and mend.
Finding wrong_order() {
  return {.kind = "exposures",
          .text = "the raw images are not in the stated order, or have other phases",
          .size = io::unknown,
          .explained = io::unknown};
}

/// Adds a finding whose mend is one of several orders. @returns false
bool add_one_of(Inspection& result, Finding finding, const std::vector<Reading>& flat) {
  finding.mend = "cannot be decided from this scene: " + lines_of(flat, result.observation.stated);
  add_open_order(result, flat);
  result.findings.push_back(std::move(finding));
  return false;
}

/// Adds the finding that samples or light contradict the stated order. @returns true if exactly one order remains
bool add_wrong_order(Inspection& result, const io::CaptureReader& capture, const std::vector<Reading>& flat) {
  const auto& other = *result.observation.other_order;
  Finding f = wrong_order();
  f.evidence = other.why;
  if (flat.size() > 1) return add_one_of(result, f, flat);
  if (flat.empty()) {
    f.text = "the raw images do not fit the profile: their order, their phases or the gain may be wrong";
    f.mend = "no matching order was found: see docs/formats/profile.md, Exposures";
  } else {
    f.mend = "exposures: " + io::exposures_yaml(flat[0].exposures);
    if (flat[0].flatness.count > 0)
      f.evidence += fmt::format("; no other order {}keeps planes flat",
                                is_possible(flat[0], result.observation) ? "agrees with the amplitudes and " : "");
    if (!same(flat[0].exposures, result.observation.exposures))
      result.observation = observe(capture, result.observation.camera, 32, &flat[0].exposures);
  }
  result.findings.push_back(f);
  return flat.size() == 1;
}

/// Adds a finding if the stated order fits the samples but only other orders keep planes flat.
/// @returns false if several do
bool add_flatter_order(Inspection& result, const io::CaptureReader& capture, const std::vector<Reading>& flat,
                       const Reading& stated) {
  const bool stated_fits =
      std::ranges::any_of(flat, [&](const Reading& r) { return same(r.exposures, stated.exposures); });
  if (stated_fits) {
    if (flat.size() > 1) add_open_order(result, flat);
    return true;
  }
  if (flat.empty() || stated.flatness.count == 0) return true;
  const Reading& best = *std::ranges::min_element(flat, {}, [](const Reading& r) { return r.flatness.rms; });
  const double least = best.flatness.rms, now = stated.flatness.rms;
  Finding f = wrong_order();
  f.size = now;
  f.explained = 1 - least * least / (now * now);
  if (now < min_order_deviation * stated.length || f.explained < min_order_explained) return true;
  f.evidence = fmt::format("planes deviate by {:.3g} mm (RMS) as stated, at {}; by {:.3g} mm in {}, at {}", 1e3 * now,
                           config::format_quantity(std::round(1e3 * stated.length) / 1e3, "m"), 1e3 * least,
                           flat.size() > 1 ? "the flattest of the others" : "this order",
                           config::format_quantity(std::round(1e3 * best.length) / 1e3, "m"));
  if (flat.size() > 1) return add_one_of(result, f, flat);
  f.mend = "exposures: " + io::exposures_yaml(best.exposures);
  result.findings.push_back(f);
  result.observation = observe(capture, result.observation.camera, 32, &best.exposures);
  return true;
}

}  // namespace

bool add_order(Inspection& result, const io::CaptureReader& capture) {
  const Observation& o = result.observation;
  if (!o.decoded) return true;
  // Light that no order explains may be due to a wrong gain: it excludes none.
  const bool is_open = o.other_order && o.other_order->exposures.empty();
  std::vector<Reading> readings;
  for (const physics::Exposures& order : is_open ? io::turned_orders(o.stated) : o.possible_orders) {
    if (o.other_order || is_simple(order, o.exposures)) readings.push_back(reading_of(capture, o, order));
  }
  std::vector<Reading> flat = flat_readings(readings);
  const bool planes = std::ranges::any_of(flat, [](const Reading& r) { return r.flatness.count > 0; });
  if (!planes && is_open) flat.clear();
  const auto stated = std::ranges::find_if(flat, [&o](const Reading& r) { return same(r.exposures, o.stated); });
  if (o.other_order && (!planes || stated == flat.end())) {
    if (is_open && std::ranges::any_of(flat, [&o](const Reading& r) { return is_possible(r, o); }))
      std::erase_if(flat, [&o](const Reading& r) { return !is_possible(r, o); });
    return add_wrong_order(result, capture, flat);
  }
  if (is_open) {
    add_open_order(result, flat, o.other_order->why);
    return true;
  }
  if (o.other_order) {  // only the light contradicts it: the lamp may be weaker towards the image corners
    result.observation = observe(capture, o.camera, 32, &stated->exposures);
    return add_flatter_order(result, capture, flat, *stated);
  }
  return readings.empty() || readings[0].flatness.count == 0 || add_flatter_order(result, capture, flat, readings[0]);
}

}  // namespace tofgraph::inspection
