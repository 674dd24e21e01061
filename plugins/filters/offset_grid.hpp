// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Dense grid of an offset table, for looking up the error of every pixel of a frame.
#pragma once

#include <tofgraph/physics/offset_table.hpp>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <vector>

#include "plugins/filters/offset_range.hpp"
#include "plugins/filters/offset_rows.hpp"

namespace tofgraph {

/// Grid of T - z over integration time, depth and reflectivity, linear between its nodes. Depths are evenly spaced;
/// reflectivities are spaced 128 per octave and located by the bits of the number, whose exponent and leading digits
/// grow like a logarithm; times are those of the calibration, linear in the logarithm between them. For scattered
/// samples, each of which may have its own time, it only holds the range without extrapolation.
class OffsetGrid {
 public:
  OffsetGrid() = default;
  /// @param target the only one, whatever the reflectivity of a pixel; none: found by the reflectivity
  OffsetGrid(const physics::OffsetTable& table, std::optional<std::size_t> target) : id_(next_id()), target_(target) {
    const OffsetRange range(table, target);
    first_ = static_cast<float>(range.first);
    per_metre_ = static_cast<float>((depths - 1) / (range.last - range.first));
    if (!target) {
      base_ = bits_of(static_cast<float>(range.dark)) >> step_bits << step_bits;
      levels_ = static_cast<std::size_t>((bits_of(static_cast<float>(range.bright)) - base_) >> step_bits) + 2;
    }
    std::set<double> times;
    for (const physics::OffsetSample& s : table.samples()) {
      if (!target || s.target == *target) times.insert(s.integration_time);
    }
    const bool scattered = table.shape() == physics::OffsetTable::Shape::scattered;
    if (scattered) times = {*times.begin(), *times.rbegin()};
    const bool one_plane = table.shape() != physics::OffsetTable::Shape::grid;  // the same for all times
    for (const double time : times) {
      times_.push_back(std::log(time));
      fill(table, time, !scattered && (!one_plane || times_.size() == 1), nodes_);
    }
    planes_ = one_plane ? 1 : times_.size();
    nodes_.errors.push_back(0);  // read with weight 0 next to the last node
  }

  /// @param time s @returns a plane that is valid until this thread requests another time or grid
  OffsetPlane at(double time) const {
    const double log_time = std::log(time);
    const auto above = std::ranges::lower_bound(times_, log_time);
    const auto after = static_cast<std::size_t>(std::min(above, times_.end() - 1) - times_.begin());
    const std::size_t before = after > 0 && above != times_.end() ? after - 1 : after;
    const double span = times_[after] - times_[before];
    const double share = span > 0 ? (log_time - times_[before]) / span : 0;
    const bool outside = log_time < times_.front() - beyond || log_time > times_.back() + beyond;
    const std::size_t row = (share < 0.5 ? before : after) * depths;
    OffsetPlane plane = frame();
    plane.least = outside ? never_least_.data() : nodes_.least.data() + row;
    plane.most = outside ? never_most_.data() : nodes_.most.data() + row;
    if (planes_ == 1 || share == 0)
      plane.errors = errors_of(before);
    else if (share == 1)
      plane.errors = errors_of(after);
    else
      plane.errors = between(before, after, static_cast<float>(share), log_time);
    return plane;
  }

 private:
  static constexpr std::int32_t depths = 1024;
  static constexpr int step_bits = OffsetPlane::step_bits;
  static constexpr double beyond = OffsetRange::beyond;

  /// Nodes of one or more times.
  struct Nodes {
    std::vector<float> errors;       // m, planes x depths x levels
    std::vector<float> least, most;  // limits of the reflectivity without extrapolation, times x depths
  };
  OffsetPlane frame() const {
    return {.depths = depths,
            .levels = static_cast<std::int32_t>(levels_),
            .first = first_,
            .per_metre = per_metre_,
            .base = base_,
            .last_bits = static_cast<std::int32_t>(((levels_ - 1) << step_bits)) - (levels_ > 1 ? 1 : 0),
            .errors = nullptr,
            .least = nullptr,
            .most = nullptr};
  }

  double depth_of(std::int32_t row) const { return double{first_} + row / double{per_metre_}; }
  double reflectivity_of(std::int32_t level) const {
    return double{std::bit_cast<float>(base_ + (level << step_bits))};
  }

  static std::uint64_t next_id() {
    static std::atomic<std::uint64_t> last = 0;
    return ++last;
  }

  const float* errors_of(std::size_t plane) const {
    return nodes_.errors.data() + (planes_ == 1 ? 0 : plane) * depths * levels_;
  }

  /// Interpolates between two times. Each thread keeps the result, since most frames have the previous frame's time.
  const float* between(std::size_t before, std::size_t after, float share, double log_time) const {
    struct Kept {
      std::uint64_t id = 0;
      double log_time = 0;
      std::vector<float> errors;
    };
    thread_local Kept kept;
    if (kept.id == id_ && kept.log_time == log_time) return kept.errors.data();
    kept.errors.resize(depths * levels_ + 1);
    const float *low = errors_of(before), *high = errors_of(after);
    for (std::size_t i = 0; i < depths * levels_; ++i) kept.errors[i] = low[i] + share * (high[i] - low[i]);
    kept.id = id_;
    kept.log_time = log_time;
    return kept.errors.data();
  }

  void fill(const physics::OffsetTable& table, double time, bool with_errors, Nodes& nodes) const {
    constexpr float all = std::numeric_limits<float>::infinity();
    for (std::int32_t row = 0; row < depths; ++row) {
      const double z = depth_of(row);
      if (target_) {
        const auto found = table.of_target(*target_, z, time);
        nodes.least.push_back(found.extrapolated ? all : -all);
        nodes.most.push_back(found.extrapolated ? -all : all);
        if (with_errors) nodes.errors.push_back(static_cast<float>(found.depth - z));
        continue;
      }
      const physics::OffsetTable::Across across = table.across(z, time);
      const auto [low, high] = across.inside();
      nodes.least.push_back(static_cast<float>(low));
      nodes.most.push_back(static_cast<float>(high));
      for (std::int32_t level = 0; with_errors && level < static_cast<std::int32_t>(levels_); ++level)
        nodes.errors.push_back(static_cast<float>(across.at(reflectivity_of(level)).depth - z));
    }
  }

  std::uint64_t id_ = 0;
  std::optional<std::size_t> target_;
  std::vector<double> times_;  // ln s
  std::size_t planes_ = 1, levels_ = 1;
  Nodes nodes_;
  // Outside the calibrated times every reflectivity is extrapolated.
  std::vector<float> never_least_ = std::vector<float>(depths, std::numeric_limits<float>::infinity());
  std::vector<float> never_most_ = std::vector<float>(depths, -std::numeric_limits<float>::infinity());
  float first_ = 0, per_metre_ = 1;  // m, 1/m
  std::int32_t base_ = 0;            // bits of the lowest reflectivity
};

}  // namespace tofgraph
