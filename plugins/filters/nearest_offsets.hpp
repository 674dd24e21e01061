// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Errors from the nearest samples of a scattered offset table, for all pixels of a frame.
#pragma once

#include <tofgraph/physics/offset_table.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "plugins/filters/offset_range.hpp"
#include "plugins/filters/offset_rows.hpp"

namespace tofgraph {

/// Errors T - z from the nearest samples, those of OffsetTable for each pixel within the samples and their margin;
/// beyond it those of its edge. Samples as far as the last of the nearest count as well. The space of depth,
/// reflectivity and time is divided into cells, and pixels of one cell are computed together, because the nearest
/// samples of all its points are among a few: if the n-th nearest sample of the centre is at the distance r, and no
/// point of the cell is further from the centre than h, the n nearest samples of each point are within r + 2 h of the
/// centre.
class NearestOffsets {
 public:
  /// @param table scattered, must outlive this object; without reflectivities those of the pixels are not used
  explicit NearestOffsets(const physics::OffsetTable& table) : table_(table) {
    OffsetRange range(table);
    if (!table.knows_reflectivities()) range.dark = range.bright = 1;
    first_ = static_cast<float>(range.first);
    last_ = static_cast<float>(range.last);
    dark_ = static_cast<float>(range.dark);
    bright_ = static_cast<float>(range.bright);
    set_cells();
  }

  /// Computes `error` of all pixels from their `depth` and `reflectivity`. Several threads may call it at the same
  /// time.
  /// @param time s @param weigh computes one NearestGroup
  template <class Weigh> void look_up(double time, std::span<const OffsetRow> rows, Weigh&& weigh) const {
    thread_local Sorted sorted;
    sort(rows, sorted);
    std::vector<float> squares;
    for (const auto& [number, cell] : candidates(sorted, time)) {
      const double along = scale_[2] * std::log(time / cell->time);
      squares.clear();
      for (const float step : cell->time_step) squares.push_back(static_cast<float>(std::pow(step - along, 2) + 1e-18));
      const std::size_t from = sorted.begin[number];
      weigh(NearestGroup{.pixels = sorted.begin[number + 1] - from,
                         .samples = squares.size(),
                         .depth = &sorted.depth[from],
                         .reflectivity = &sorted.reflectivity[from],
                         .error = &sorted.error[from],
                         .centre = cell->depth,
                         .per_metre = static_cast<float>(scale_[0]),
                         .inverse_reflectivity = 1 / cell->reflectivity,
                         .per_level = static_cast<float>(scale_[1]),
                         .depth_step = cell->depth_step.data(),
                         .level_step = cell->level_step.data(),
                         .time_square = squares.data(),
                         .sample_error = cell->error.data()});
    }
    const std::uint32_t* place = sorted.place.data();
    for (const OffsetRow& row : rows) {
      for (std::size_t u = 0; u < row.columns; ++u) row.error[u] = sorted.error[*place++];
    }
  }

 private:
  static constexpr double max_cells = 1 << 17;        ///< of one time
  static constexpr std::size_t max_kept = 1 << 22;    ///< number of candidates that are kept, 16 bytes each
  static constexpr std::size_t cell_candidates = 16;  ///< whose memory the rest of a cell needs

  /// Candidates of a cell as differences from its centre, in the units of the search.
  struct Cell {
    float depth, reflectivity;                                    // of the centre; depth: m
    double time;                                                  // s
    std::vector<float> depth_step, level_step, time_step, error;  // error: m
  };
  using Cells = std::vector<std::pair<std::size_t, std::shared_ptr<const Cell>>>;

  /// Pixels of a frame in the order of their cells.
  struct Sorted {
    std::vector<std::uint32_t> begin;  // first pixel of each cell, and the end
    std::vector<std::uint32_t> place;  // of each pixel
    std::vector<float> depth, reflectivity, error;
  };

  /// Makes cells a quarter as wide as the last of the nearest samples is far away.
  void set_cells() {
    scale_ = table_.scale();
    const std::vector<physics::OffsetSample>& samples = table_.samples();
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < samples.size(); i += 1 + samples.size() / 100, ++count)
      sum +=
          reach(table_.coordinates(samples[i].depth, std::log(samples[i].reflectivity), samples[i].integration_time));
    double side = std::max(sum / count / 4, 1e-6);
    while (!set_cell_size(side)) side *= 1.5;
  }

  /// Divides the space into cells of a side, in the units of the search. @returns false: these are too many
  bool set_cell_size(double side) {
    const double range = double{last_} - double{first_};
    per_metre_ = static_cast<float>(std::max(scale_[0] / side, 1 / range));
    per_time_ = std::max(scale_[2] / side, 1e-3);
    cell_bits_ = fraction_bits;
    while (cell_bits_ > min_cell_bits && std::ldexp(scale_[1], cell_bits_ - fraction_bits) > side) --cell_bits_;
    levels_ = level_of(bright_) + 1;
    const double depths = std::ceil(range * double{per_metre_});
    depths_ = static_cast<std::uint32_t>(std::min(depths, max_cells));
    return depths * levels_ <= max_cells;
  }

  /// Distance of the last of the nearest samples.
  double reach(const physics::NearestSamples::Point& place) const {
    double last = 0;
    table_.nearest_samples().nearest(place, physics::OffsetTable::nearest_count,
                                     [&](std::size_t, double square) { last = square; });
    return std::sqrt(last);
  }

  /// Depth and reflectivity within the margin; those that are unknown are at its lower end.
  std::pair<float, float> inside(const OffsetRow& row, std::size_t u) const {
    const float z = row.depth[u], rho = row.reflectivity[u];
    return {z > first_ ? std::min(z, last_) : first_, rho > dark_ ? std::min(rho, bright_) : dark_};
  }

  std::size_t cell_of(float z, float rho) const {
    const auto row = std::min(static_cast<std::uint32_t>((z - first_) * per_metre_), depths_ - 1);
    return std::size_t{row} * levels_ + level_of(rho);
  }

  std::uint32_t level_of(float rho) const {
    return static_cast<std::uint32_t>((bits_of(rho) >> cell_bits_) - (bits_of(dark_) >> cell_bits_));
  }

  /// Counting sort.
  void sort(std::span<const OffsetRow> rows, Sorted& sorted) const {
    constexpr std::uint32_t padding = NearestGroup::padding;
    sorted.place.clear();
    sorted.begin.assign(std::size_t{depths_} * levels_ + 1, 0);
    for (const OffsetRow& row : rows) {
      for (std::size_t u = 0; u < row.columns; ++u) {
        const auto [z, rho] = inside(row, u);
        std::uint32_t& count = sorted.begin[cell_of(z, rho)];
        sorted.place.push_back(count++);
      }
    }
    std::uint32_t end = 0;
    for (std::uint32_t& begin : sorted.begin) {
      const std::uint32_t count = begin;
      begin = end;
      end += (count + padding - 1) / padding * padding;
    }
    for (std::vector<float>* image : {&sorted.depth, &sorted.reflectivity, &sorted.error}) image->resize(end);
    std::uint32_t* place = sorted.place.data();
    for (const OffsetRow& row : rows) {
      for (std::size_t u = 0; u < row.columns; ++u, ++place) {
        const auto [z, rho] = inside(row, u);
        *place += sorted.begin[cell_of(z, rho)];
        sorted.depth[*place] = z;
        sorted.reflectivity[*place] = rho;
      }
    }
  }

  /// Returns the cells that have pixels; those that no frame needed before are made.
  Cells candidates(const Sorted& sorted, double time) const {
    const auto time_cell = static_cast<std::int64_t>(std::floor(std::log(time) * per_time_));
    Cells result;
    const std::scoped_lock lock(turn_);
    if (kept_candidates_ > max_kept) {
      kept_.clear();
      kept_candidates_ = 0;
    }
    for (std::size_t number = 0; number + 1 < sorted.begin.size(); ++number) {
      if (sorted.begin[number] == sorted.begin[number + 1]) continue;
      std::shared_ptr<const Cell>& cell = kept_[time_cell][number];
      if (!cell) {
        cell = std::make_shared<const Cell>(cell_at(number, time_cell));
        kept_candidates_ += cell->error.size() + cell_candidates;
      }
      result.emplace_back(number, cell);
    }
    return result;
  }

  Cell cell_at(std::size_t number, std::int64_t time_cell) const {
    const auto row = static_cast<double>(number / levels_);
    const auto bits = static_cast<std::int32_t>(number % levels_) + (bits_of(dark_) >> cell_bits_);
    const double darkest = std::bit_cast<float>(bits << cell_bits_),
                 brightest = std::bit_cast<float>((bits + 1) << cell_bits_);
    Cell cell{.depth = static_cast<float>(double{first_} + (row + 0.5) / double{per_metre_}),
              .reflectivity = static_cast<float>(std::sqrt(darkest * brightest)),
              .time = std::exp((static_cast<double>(time_cell) + 0.5) / per_time_)};
    const auto centre = table_.coordinates(double{cell.depth}, std::log(double{cell.reflectivity}), cell.time);
    // Slightly more than half, because the float by which a pixel is assigned errs by up to 0.012 cells.
    const double half = 0.512 * std::hypot(scale_[0] / double{per_metre_}, scale_[1] * std::log(brightest / darkest),
                                           scale_[2] / per_time_);
    constexpr double rounding = 1 + 1e-4;
    for (const std::size_t i : table_.nearest_samples().within(centre, (reach(centre) + 2 * half) * rounding)) {
      const physics::OffsetSample& s = table_.samples()[i];
      const auto place = table_.coordinates(s.depth, std::log(s.reflectivity), s.integration_time);
      cell.depth_step.push_back(static_cast<float>(place[0] - centre[0]));
      cell.level_step.push_back(static_cast<float>(place[1] - centre[1]));
      cell.time_step.push_back(static_cast<float>(place[2] - centre[2]));
      cell.error.push_back(static_cast<float>(s.distance - s.depth));
    }
    return cell;
  }

  static constexpr int fraction_bits = 23;  ///< of a float: a cell of as many is an octave
  static constexpr int min_cell_bits = 16;

  const physics::OffsetTable& table_;
  std::array<double, 3> scale_{};                       // units per metre, per 1 of ln reflectivity and of ln time
  float first_ = 0, last_ = 0, dark_ = 0, bright_ = 0;  // range of depths (m) and reflectivities
  float per_metre_ = 1;                                 // cells per metre of depth
  double per_time_ = 1;                                 // cells per 1 of ln time
  int cell_bits_ = fraction_bits;                       // binary digits of a reflectivity within a cell
  std::uint32_t depths_ = 1, levels_ = 1;               // numbers of cells
  mutable std::mutex turn_;                             // of the cells that are kept
  mutable std::size_t kept_candidates_ = 0;
  mutable std::unordered_map<std::int64_t, std::unordered_map<std::size_t, std::shared_ptr<const Cell>>> kept_;
};

}  // namespace tofgraph
