// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Orientation of the recorded amplitude relative to the lengths: edges in depth are also edges in amplitude.
#include "inspection/inspection.hpp"

#include "io/unknown.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tofgraph::inspection {
namespace {

constexpr std::size_t min_edges = 100;  ///< pixels
constexpr std::size_t min_pixels_per_edge = 5;
constexpr double min_jump = 0.03;  ///< relative change of the length from one side of a pixel to the other
constexpr double min_score = 0.8;  ///< mean rank of the amplitude's steps at edges of depth; by chance 0.5
constexpr double max_stated_score = 0.65;

/// Difference of `value` between both neighbours of a pixel, along the row or the column, whichever is larger.
template <class Value> double step_at(const Observation& o, std::size_t i, const Value& value) {
  const double along = std::abs(value(i + 1) - value(i - 1)),
               across = std::abs(value(i + o.width) - value(i - o.width));
  return std::isfinite(along) && std::isfinite(across) ? std::max(along, across) : io::unknown;
}

/// Pixels not at the image border.
std::vector<std::size_t> inner_pixels(const Observation& o) {
  std::vector<std::size_t> inner;
  for (std::size_t row = 1; row + 1 < o.height; ++row)
    for (std::size_t column = 1; column + 1 < o.width; ++column) inner.push_back(row * o.width + column);
  return inner;
}

/// Rank of the relative amplitude step of each pixel, 0 to 1; NaN: unknown.
std::vector<double> ranks_of(const Observation& o) {
  std::vector<double> steps(o.pixels(), io::unknown), ranks = steps;
  std::vector<std::size_t> order;
  for (const std::size_t i : inner_pixels(o)) {
    steps[i] =
        step_at(o, i, [&](std::size_t k) { return o.amplitude[k] > 0 ? std::log(o.amplitude[k]) : io::unknown; });
    if (std::isfinite(steps[i])) order.push_back(i);
  }
  std::ranges::sort(order, {}, [&](std::size_t i) { return steps[i]; });
  for (std::size_t k = 0; k < order.size(); ++k)
    ranks[order[k]] = static_cast<double>(k) / static_cast<double>(order.size());
  return ranks;
}

std::vector<std::size_t> edges_of(const Observation& o, double noise) {
  std::vector<std::size_t> edges;
  for (const std::size_t i : inner_pixels(o)) {
    const double step = step_at(o, i, [&](std::size_t k) { return o.length[k]; });
    if (step > min_jump * o.length[i] + 8 * noise) edges.push_back(i);
  }
  return edges;
}

/// Mean rank of the amplitude steps at the depth edges if the amplitude image is reoriented this way.
double score_of(const Observation& o, const std::vector<std::size_t>& edges, const std::vector<double>& ranks,
                const Orientation& orientation) {
  const double middle_x = static_cast<double>(o.width - 1) / 2, middle_y = static_cast<double>(o.height - 1) / 2;
  const std::array<int, 4>& m = orientation.matrix;
  double sum = 0, count = 0;
  for (const std::size_t i : edges) {
    const std::size_t own_column = i % o.width, own_row = i / o.width;
    const double x = static_cast<double>(own_column) - middle_x, y = static_cast<double>(own_row) - middle_y;
    const auto column = static_cast<std::size_t>(std::lround(m[0] * x + m[1] * y + middle_x));
    const auto row = static_cast<std::size_t>(std::lround(m[2] * x + m[3] * y + middle_y));
    const double rank = ranks[row * o.width + column];
    if (!std::isfinite(rank)) continue;
    sum += rank;
    ++count;
  }
  return count >= static_cast<double>(min_edges) ? sum / count : 0;
}

/// Change of a layout that reorients the amplitude image, whatever the layout states already.
std::string layout_advice(const Orientation& orientation) {
  const std::array<int, 4>& m = orientation.matrix;
  const bool exchanged = m[0] == 0;
  const bool columns = exchanged ? m[2] < 0 : m[0] < 0, rows = exchanged ? m[1] < 0 : m[3] < 0;
  std::string text = "in the layout, channel amplitude: ";
  if (exchanged) text += "exchange row and column in axes and in reversed";
  if (exchanged && (columns || rows)) text += ", then ";
  if (columns || rows)
    text += fmt::format("reversed: {} (an axis already listed is taken out instead)", !rows      ? "column"
                                                                                      : !columns ? "row"
                                                                                                 : "row column");
  return text;
}

}  // namespace

void add_amplitude_orientation(Inspection& result) {
  const Observation& o = result.observation;
  if (o.decoded || o.amplitude.empty() || o.width < 3 || o.height < 3) return;
  const double noise = std::isfinite(result.surfaces.pixel_noise) ? result.surfaces.pixel_noise : 0;
  const std::vector<std::size_t> edges = edges_of(o, noise);
  const bool few = edges.size() < min_edges;
  if (few || min_pixels_per_edge * edges.size() > o.pixels()) {
    result.undecided.push_back(fmt::format(
        "the orientation of the amplitude relative to the lengths: {}",
        few ? "there are too few edges in the depth" : "more than a fifth of the pixels are edges in the depth"));
    return;
  }
  const std::vector<double> ranks = ranks_of(o);
  const double stated = score_of(o, edges, ranks, {});
  Orientation best;
  double score = 0;
  for (const Orientation& orientation : other_orientations(o.width == o.height)) {
    const double found = score_of(o, edges, ranks, orientation);
    if (found <= score) continue;
    best = orientation;
    score = found;
  }
  if (stated > max_stated_score || score < min_score) return;
  result.findings.push_back(
      {"amplitude_orientation",
       fmt::format("the amplitude is {} relative to the lengths",
                   std::string_view(best.mirror) == "none"
                       ? fmt::format("turned by {} deg", 360 - best.turn)
                       : fmt::format("mirrored{}", best.turn != 0 ? " and turned" : "")),
       fmt::format(
           "at the {} pixels of edges in the depth the steps of the amplitude have a mean rank of {:.2f} as stated, "
           "{:.2f} with this correction; 0.5 is expected by chance",
           edges.size(), stated, score),
       layout_advice(best), io::unknown, io::unknown});
}

}  // namespace tofgraph::inspection
