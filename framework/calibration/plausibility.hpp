// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conditions that contradict the rest of their campaign because of a wrong entry: reported before a search or a
/// calibration attributes them to the camera. Header-only: calibration and diagnosis compile it into
/// themselves.
#pragma once

#include "calibration/robust_camera.hpp"
#include "config/quantity.hpp"
#include "io/captures/campaign_captures.hpp"

#include <tofgraph/physics/constants.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph::calibration {

/// Wrong entry of a condition, and the value that fits its data.
struct Contradiction {
  enum class Kind { distance, target, integration_time, swapped, saturated };
  Kind kind = Kind::distance;
  std::size_t condition = 0;  ///< condition to which the data belong
  std::string text;           ///< "you wrote 'distance: 10 m', the data say 1 m"

  const char* key() const {  ///< key of the entry in the campaign
    constexpr std::array keys = {"distance", "target", "integration_time", "capture", "capture"};
    return keys[static_cast<std::size_t>(kind)];
  }
};

class PlausibilityJudge {
 public:
  explicit PlausibilityJudge(const BoardPhasors& data) : data_(data), camera_(data) {}

  std::vector<Contradiction> all() {
    const std::size_t n = data_.size();
    found_.resize(n);
    rest_.resize(n);
    std::vector<double> written(n);
    for (std::size_t i = 0; i < n; ++i) {
      if (camera_.knows(i)) rest_[i] = camera_.rest(i);
      written[i] = data_.conditions[i].integration_time;
    }
    other_time_ = io::other_integration_times(written, data_.recorded_times);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) swapped(i, j);
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (!found_[i] && is_suspect(i)) found_[i] = best_of(i);
    }
    std::vector<Contradiction> result;
    for (auto& one : found_) {
      if (one) result.push_back(std::move(*one));
    }
    return result;
  }

 private:
  using Kind = Contradiction::Kind;
  /// Changed entry with which a condition would fit the others.
  struct Explanation {
    Kind kind;
    double misfit;
    std::string written, seen;
  };

  // Effects may change a correctly described condition by some centimetres and a third of the light.
  static constexpr double usual_length = 50e-3, usual_light = 0.3;  // m, of ln amplitude
  static constexpr double usual_spreads = 10;  // robust standard deviations of the other conditions
  // An explanation must fit better.
  static constexpr double explained_length = 25e-3, explained_light = 0.1, explained_spreads = 5;
  static constexpr double distance_share = 0.08;  // smaller errors of the distance are left to the search
  static constexpr double slip_tolerance =
      0.03;  // relative, of a distance that differs from the written one by a factor of ten

  bool within(std::size_t i, const Deviation& rest, double length, double light, double spreads) const {
    const Deviation& spread = camera_.spread();
    return std::abs(rest.length) < std::max(length, spreads * spread.length) &&
           (!camera_.tells_light(i) || std::abs(rest.light) < std::max(light, spreads * spread.light));
  }
  bool explains(std::size_t i, const Deviation& rest) const {
    return within(i, rest, explained_length, explained_light, explained_spreads);
  }
  bool is_far_off(std::size_t i) const {
    return camera_.knows(i) && !within(i, rest_[i], usual_length, usual_light, usual_spreads);
  }
  bool is_suspect(std::size_t i) const {
    if (!camera_.knows(i)) return false;
    // The data are trusted more than the recorded integration time.
    return is_far_off(i) || (other_time_[i] && !(camera_.tells_light(i) && explains(i, rest_[i])));
  }
  double misfit(std::size_t i, const Deviation& rest) const {
    const Deviation& spread = camera_.spread();
    const double light = camera_.tells_light(i) ? rest.light / spread.light : 0;
    return std::pow(rest.length / spread.length, 2) + light * light;
  }

  void swapped(std::size_t i, std::size_t j) {
    if (found_[i] || found_[j] || !(is_far_off(i) || is_far_off(j))) return;
    if (!camera_.knows(i) || !camera_.knows(j)) return;
    if (explains(i, rest_[i]) || explains(j, rest_[j])) return;
    if (!explains(j, camera_.rest_as(i, j)) || !explains(i, camera_.rest_as(j, i))) return;
    const auto text = [&](std::size_t a, std::size_t b) {
      const auto& conditions = data_.conditions;
      return fmt::format("you wrote 'capture: {}', the data say that this is the capture of {}, and its own is {}",
                         conditions[a].capture.filename().string(), conditions[b].id,
                         conditions[b].capture.filename().string());
    };
    found_[i] = Contradiction{Kind::swapped, i, text(i, j)};
    found_[j] = Contradiction{Kind::swapped, j, text(j, i)};
  }

  std::optional<Contradiction> best_of(std::size_t i) const {
    if (looks_saturated(i))
      return Contradiction{
          Kind::saturated, i,
          fmt::format("the capture looks saturated: an amplitude of {:.0f} counts is expected, more than "
                      "the {:.0f} counts that the full well allows, and {:.0f} counts were measured",
                      std::exp(camera_.expected_light(i)), data_.max_amplitude,
                      std::exp(camera_.expected_light(i) + rest_[i].light))};
    std::vector<Explanation> all;
    add_distance(i, all);
    add_targets(i, all);
    add_times(i, all);
    if (all.empty()) return std::nullopt;
    std::ranges::stable_sort(all, {}, &Explanation::misfit);
    const Explanation& best = all.front();
    std::string seen = best.seen;
    for (const Explanation& other : all) {
      if (other.kind != best.kind)
        seen += fmt::format(", or else '{}' is not {} but {}", Contradiction{.kind = other.kind}.key(), other.written,
                            other.seen);
    }
    return Contradiction{
        best.kind, i,
        fmt::format("you wrote '{}: {}', {}", Contradiction{.kind = best.kind}.key(), best.written, seen)};
  }

  void add(std::size_t i, Kind kind, const Deviation& rest, std::string written, std::string seen,
           std::vector<Explanation>& all) const {
    if (explains(i, rest)) all.push_back({kind, misfit(i, rest), std::move(written), std::move(seen)});
  }

  bool looks_saturated(std::size_t i) const {
    return camera_.tells_light(i) && rest_[i].light < 0 && std::exp(camera_.expected_light(i)) > data_.max_amplitude;
  }

  void add_distance(std::size_t i, std::vector<Explanation>& all) const {
    const double written = data_.conditions[i].board_distance;
    // Without light, factors of ten are tried first, because the phase is periodic.
    const std::vector<double> starts = camera_.tells_light(i)
                                           ? std::vector<double>{camera_.distance_by_light(i)}
                                           : std::vector<double>{written / 10, 10 * written, written};
    for (const double start : starts) {
      const auto [distance, rest] = camera_.at_distance(i, start);
      if (!camera_.tells_light(i) && start != written && std::abs(distance / start - 1) > slip_tolerance) continue;
      if (!(std::abs(distance - written) > distance_share * std::min(distance, written))) continue;
      if (distance > physics::unambiguous_range(data_.modulation_frequency)) continue;
      add(i, Kind::distance, rest, config::format_quantity(written, "m"),
          "the data say " + config::format_quantity(std::stod(fmt::format("{:.3g}", distance)), "m"), all);
      return;
    }
  }

  void add_targets(std::size_t i, std::vector<Explanation>& all) const {
    const std::string& written = data_.conditions[i].target;
    if (!camera_.tells_light(i) || std::isfinite(data_.conditions[i].reflectivity)) return;
    for (std::size_t t = 0; t < camera_.targets().size(); ++t) {
      const std::string& other = camera_.targets()[t];
      if (other.empty() || other == written || !camera_.knows_target(t)) continue;
      add(i, Kind::target, camera_.rest_on(i, t), written, "the data say " + other, all);
    }
  }

  void add_times(std::size_t i, std::vector<Explanation>& all) const {
    const double written = data_.conditions[i].integration_time;
    const std::string text = config::format_quantity(written, "s");
    if (other_time_[i]) {
      all.push_back({Kind::integration_time, 0, text,
                     "the capture says " + config::format_quantity(data_.recorded_times[i], "s")});
      return;
    }
    if (!camera_.tells_light(i)) return;
    std::set<double> times;
    for (const io::Condition& condition : data_.conditions) times.insert(condition.integration_time);
    for (const double time : times) {
      if (io::is_other_integration_time(time, written))
        add(i, Kind::integration_time, camera_.rest_with(i, time), text,
            "the data say " + config::format_quantity(time, "s"), all);
    }
  }

  const BoardPhasors& data_;
  RobustCamera camera_;
  std::vector<Deviation> rest_;   ///< per condition as written
  std::vector<bool> other_time_;  ///< differs from that of the capture
  std::vector<std::optional<Contradiction>> found_;
};

/// Compares the median distance and amplitude of each condition with the expectation from a robust fit of all others:
/// an offset, terms of ln amplitude and ln integration time, a constant phasor added to the light, and one reflectivity
/// per target. A condition is reported if it deviates strongly and if changing one entry explains both its distance and
/// its amplitude. In the order of the conditions.
inline std::vector<Contradiction> contradictions(const BoardPhasors& data) { return PlausibilityJudge(data).all(); }

}  // namespace tofgraph::calibration
