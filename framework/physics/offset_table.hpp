// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Integration-time and reflectivity offset, interpolated between the conditions in which it was measured: true depth
/// of a board from its measured depth z, reflectivity and integration time. Chapter 6 of the reference.
#pragma once

#include <tofgraph/physics/interpolation.hpp>
#include <tofgraph/physics/nearest_samples.hpp>
#include <tofgraph/physics/to_integer.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph::physics {

/// Measurement of one board.
struct OffsetSample {
  std::size_t target = 0;       ///< 0-based index of the target
  double distance = 0;          ///< m, T: sensor plane to board
  double depth = 0;             ///< m, z = D_avg: mean depth after the non-linearity model, (6.3)
  double integration_time = 0;  ///< s
  double reflectivity = 0;      ///< amplitude D_t^2 / (gain t_int), from this condition; NaN: unknown
};

/// Interpolation of the samples, by their arrangement.
///
/// * grid: the targets were measured at several integration times at each distance. A monotone curve T(z) for each
///   target and time, interpolated in the logarithm of the time. Cells may be empty.
/// * sheet: one integration time at each distance of a target, as in the published tables. A monotone curve T(z) for
///   each target; the time is a function of the depth.
/// * scattered: anything else. Errors T - z of the nearest samples (FLANN), weighted by the inverse square of their
///   distance, with axes normalised to their span. Reflectivity is an axis if all samples state one. For a named
///   target its samples count alone, whatever their reflectivities, as in the other arrangements.
///
/// Between targets, grid and sheet use monotone curves over the logarithm of the reflectivity.
class OffsetTable {
 public:
  enum class Shape { grid, sheet, scattered };
  static constexpr std::size_t nearest_count = 8;  ///< number of scattered samples that are averaged

  /// Depths of all targets at one measured depth and integration time.
  class Across {
   public:
    struct Found {
      double depth;       ///< m, T
      bool extrapolated;  ///< outside the range of the samples
    };
    /// @param reflectivity of the pixel; if there is only one target it does not affect the depth
    Found at(double reflectivity) const {
      const double level = std::log(reflectivity);
      const double inside = std::clamp(level, curve_.first() - level_margin, curve_.last() + level_margin);
      return {table_ != nullptr ? z_ + table_->nearest_error(z_, level, time_) : curve_(inside),
              outside_ || inside != level};
    }

    /// Range of reflectivities that need no extrapolation here; empty range: first > second.
    std::pair<double, double> inside() const {
      if (outside_) return {std::numeric_limits<double>::infinity(), 0};
      return {std::exp(curve_.first() - level_margin), std::exp(curve_.last() + level_margin)};
    }

   private:
    friend class OffsetTable;
    MonotoneCurve curve_;  // T over ln reflectivity
    bool outside_ = false;
    const OffsetTable* table_ = nullptr;  // of scattered samples
    double z_ = 0, time_ = 0;
  };

  /// @param samples at least one; no two of one target, distance and time
  /// @throws std::invalid_argument if the true distance does not increase with the measured depth, naming the range
  explicit OffsetTable(std::vector<OffsetSample> samples) : samples_(std::move(samples)) {
    for (const OffsetSample& s : samples_) targets_ = std::max(targets_, s.target + 1);
    counts_.assign(targets_, 0);
    for (const OffsetSample& s : samples_) ++counts_[s.target];
    knows_reflectivities_ =
        std::ranges::all_of(samples_, [](const OffsetSample& s) { return std::isfinite(s.reflectivity); });
    shape_ = shape_of();
    if (shape_ != Shape::scattered) make_curves();
    levels_.resize(targets_);
    for (std::size_t target = 0; target < targets_; ++target) levels_[target] = mean_level(target);
    set_spans();
    if (shape_ != Shape::scattered) return;
    set_nearest();
    for (std::size_t target = 0; target < targets_; ++target) of_targets_.push_back(OffsetTable(samples_, target));
  }

  Shape shape() const { return shape_; }
  const std::vector<OffsetSample>& samples() const { return samples_; }
  /// Returns true if all reflectivities are known, so that the amplitude identifies the target of a pixel.
  bool knows_reflectivities() const { return knows_reflectivities_; }
  /// Geometric mean of the reflectivities from a target's conditions; NaN: unknown.
  double reflectivity(std::size_t target) const { return std::exp(levels_[target]); }

  /// Units of the coordinates in which the nearest samples are searched: 1/m of z, 1 of ln reflectivity and ln time; 0:
  /// the axis is not used. The depth axis is stretched by 10, because the offset changes ten times over the span of the
  /// distance and slowly along the other axes.
  std::array<double, 3> scale() const {
    std::array<double, 3> result = {10, knows_reflectivities() ? 1.0 : 0.0, 1};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double span = high_[axis] - low_[axis];
      result[axis] = span > 0 && result[axis] > 0 ? result[axis] / span : 0;
    }
    return result;
  }
  /// Place for the search of the nearest samples.
  NearestSamples::Point coordinates(double z, double level, double time) const {
    const std::array<double, 3> units = scale(), at = {z, level, std::log(time)};
    NearestSamples::Point point{};
    for (std::size_t axis = 0; axis < 3; ++axis) point[axis] = units[axis] > 0 ? units[axis] * at[axis] : 0;
    return point;
  }
  /// Samples by their coordinates; empty unless scattered.
  const NearestSamples& nearest_samples() const { return nearest_; }

  /// Requires all reflectivities. @param z m, measured @param time s
  Across across(double z, double time) const {
    Across result;
    result.z_ = z;
    result.time_ = time;
    std::map<double, double> by_level;
    bool any_inside = false;
    for (std::size_t target = 0; target < targets_; ++target) {
      if (counts_[target] == 0) continue;
      const Place place = shape_ == Shape::scattered ? Place{z, levels_[target], false} : along(target, z, time);
      double level = place.level;
      while (by_level.contains(level)) level = std::nextafter(level, 1e9);
      by_level[level] = place.depth;
      any_inside = any_inside || !place.outside;
    }
    result.outside_ = shape_ == Shape::scattered ? outside_of_spans(z, time) : !any_inside;
    if (shape_ == Shape::scattered) result.table_ = this;
    std::vector<double> levels, depths;
    for (const auto& [level, depth] : by_level) {
      levels.push_back(level);
      depths.push_back(depth);
    }
    result.curve_ = MonotoneCurve(std::move(levels), std::move(depths));
    return result;
  }

  /// Table of the scattered samples of one target, without their reflectivities.
  const OffsetTable& scattered_of(std::size_t target) const { return of_targets_[target]; }

  /// The same for one target, independent of its reflectivity.
  Across::Found of_target(std::size_t target, double z, double time) const {
    if (shape_ == Shape::scattered) {
      const OffsetTable& own = of_targets_[target];
      return {z + own.nearest_error(z, 0, time), own.outside_of_spans(z, time)};
    }
    const Place place = along(target, z, time);
    return {place.depth, place.outside};
  }

 private:
  /// Margin beyond the samples that is not yet extrapolation, because the pixels of the outermost boards scatter by
  /// their noise.
  static constexpr double depth_margin = 0.03;  ///< relative to the depth
  static constexpr double level_margin = 0.25;  ///< in ln reflectivity
  static constexpr double time_margin = 0.05;   ///< in ln time
  static constexpr double sheet_margin = 0.41;  ///< in ln time, for a sheet: a factor of 1.5

  /// Scattered samples of one target.
  OffsetTable(const std::vector<OffsetSample>& all, std::size_t target) : shape_(Shape::scattered) {
    for (const OffsetSample& s : all) {
      if (s.target != target) continue;
      samples_.push_back(s);
      samples_.back().reflectivity = std::numeric_limits<double>::quiet_NaN();
    }
    set_spans();
    if (!samples_.empty()) set_nearest();
  }

  /// T and ln reflectivity of a target at a depth and time, and whether these are outside its samples.
  struct Place {
    double depth, level;
    bool outside;
  };
  struct Curve {
    double time;                 ///< s; NaN for a sheet
    MonotoneCurve depth, level;  ///< over z
    MonotoneCurve time_along;    ///< ln time, for a sheet
  };

  Shape shape_of() const {
    std::map<std::pair<std::size_t, double>, std::size_t> times_at;
    std::map<std::size_t, std::map<double, std::size_t>> times, distances;
    for (const OffsetSample& s : samples_) {
      ++times_at[{s.target, s.distance}];
      ++times[s.target][s.integration_time];
      ++distances[s.target][s.distance];
    }
    if (std::ranges::all_of(times_at, [](const auto& one) { return one.second == 1; })) return Shape::sheet;
    std::size_t cells = 0;
    for (const auto& [target, of_target] : times) cells += of_target.size() * distances[target].size();
    return 2 * samples_.size() >= cells ? Shape::grid : Shape::scattered;
  }

  void make_curves() {
    std::map<std::pair<std::size_t, double>, std::map<double, OffsetSample>> groups;
    for (const OffsetSample& s : samples_) {
      auto& group = groups[{s.target, shape_ == Shape::grid ? s.integration_time : 0}];
      if (!group.emplace(s.depth, s).second) refuse(s, s);
    }
    curves_.resize(targets_);
    for (const auto& [key, group] : groups) {
      std::vector<double> z, depth, level, time;
      const OffsetSample* before = nullptr;
      for (const auto& [measured, s] : group) {
        if (before != nullptr && !(s.distance > before->distance)) refuse(*before, s);
        before = &s;
        z.push_back(measured);
        depth.push_back(s.distance);
        level.push_back(std::log(s.reflectivity));
        time.push_back(std::log(s.integration_time));
      }
      const double own = shape_ == Shape::grid ? key.second : std::numeric_limits<double>::quiet_NaN();
      curves_[key.first].push_back({own, {z, depth}, {z, level}, {z, time}});
    }
  }

  [[noreturn]] static void refuse(const OffsetSample& a, const OffsetSample& b) {
    const auto mm = [](double metres) { return std::to_string(to_integer(metres * 1e3, 0L)) + " mm"; };
    throw std::invalid_argument("the board at " + mm(a.distance) + " was measured at " + mm(a.depth) + ", that at " +
                                mm(b.distance) + " at " + mm(b.depth) +
                                ": the true distance must rise with the measured depth, or a depth belongs to two "
                                "distances; is one of these distances wrong?");
  }

  double mean_level(std::size_t target) const {
    double sum = 0, count = 0;
    for (const OffsetSample& s : samples_) {
      if (s.target != target) continue;
      sum += std::log(s.reflectivity);
      ++count;
    }
    return sum / count;
  }

  /// Evaluates one curve; far beyond its ends the error T - z of the end is kept.
  static Place on(const Curve& curve, double z, double time) {
    const double low = curve.depth.first() * (1 - depth_margin), high = curve.depth.last() * (1 + depth_margin);
    const double inside = curve.depth.size() > 1 ? std::clamp(z, low, high) : curve.depth.first();
    const double measured = std::clamp(z, curve.depth.first(), curve.depth.last());
    const bool other_time =
        std::isnan(curve.time) && std::abs(curve.time_along(measured) - std::log(time)) > sheet_margin;
    return {curve.depth(inside) + (z - inside), curve.level(measured), z < low || z > high || other_time};
  }

  /// Interpolates between the two times of the target that bracket this one at this depth.
  Place along(std::size_t target, double z, double time) const {
    const Curve *below = nullptr, *above = nullptr;
    for (const Curve& curve : curves_[target]) {  // in ascending order of time
      if (shape_ == Shape::sheet) return on(curve, z, time);
      if (on(curve, z, time).outside && reaches(target, z)) continue;
      if (curve.time <= time) below = &curve;
      if (curve.time >= time && above == nullptr) above = &curve;
    }
    const bool beyond = below == nullptr || above == nullptr;
    if (below == nullptr) below = above;
    if (above == nullptr) above = below;
    const Place low = on(*below, z, time), high = on(*above, z, time);
    const bool far = beyond && std::abs(std::log(time / below->time)) > time_margin;
    const double span = std::log(above->time / below->time);
    const double share = span > 0 ? std::log(time / below->time) / span : 0;
    return {low.depth + share * (high.depth - low.depth), low.level + share * (high.level - low.level),
            far || low.outside || high.outside};
  }

  /// Returns true if a curve of the target covers this depth.
  bool reaches(std::size_t target, double z) const {
    return std::ranges::any_of(curves_[target], [&](const Curve& curve) { return !on(curve, z, curve.time).outside; });
  }

  /// Minimum and maximum of z, ln reflectivity, ln time.
  void set_spans() {
    for (const OffsetSample& s : samples_) {
      const std::array<double, 3> place = {s.depth, std::log(s.reflectivity), std::log(s.integration_time)};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low_[axis] = std::fmin(low_[axis], place[axis]);
        high_[axis] = std::fmax(high_[axis], place[axis]);
      }
    }
  }

  bool outside_of_spans(double z, double time) const {
    const double log_time = std::log(time);
    return z < low_[0] * (1 - depth_margin) || z > high_[0] * (1 + depth_margin) || log_time < low_[2] - time_margin ||
           log_time > high_[2] + time_margin;
  }

  void set_nearest() {
    std::vector<NearestSamples::Point> points;
    for (const OffsetSample& s : samples_)
      points.push_back(coordinates(s.depth, std::log(s.reflectivity), s.integration_time));
    nearest_ = NearestSamples(std::move(points));
  }

  /// T - z.
  double nearest_error(double z, double level, double time) const {
    double sum = 0, weight = 0;
    nearest_.nearest(coordinates(z, level, time), nearest_count, [&](std::size_t i, double square) {
      const double share = 1 / (square + 1e-18);
      sum += share * (samples_[i].distance - samples_[i].depth);
      weight += share;
    });
    return sum / weight;
  }

  std::vector<OffsetSample> samples_;
  std::size_t targets_ = 0;
  std::vector<std::size_t> counts_;  // number of samples by target; a target may have none
  Shape shape_ = Shape::sheet;
  bool knows_reflectivities_ = false;
  std::vector<std::vector<Curve>> curves_;  // by target, in ascending order of time
  std::vector<double> levels_;              // of the targets, ln reflectivity
  std::array<double, 3> low_{1e9, 1e9, 1e9}, high_{-1e9, -1e9, -1e9};
  NearestSamples nearest_;               // for scattered samples
  std::vector<OffsetTable> of_targets_;  // for scattered samples
};

}  // namespace tofgraph::physics
