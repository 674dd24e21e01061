// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/cross_approximation.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace tofgraph::simulation {
namespace {

/// Fills missing values with that of the nearest distance of the same amplitude, or, if the whole amplitude is missing,
/// from the next stronger amplitude, else the next weaker one.
void fill(const CorrectionTables& shape, std::vector<double>& row) {
  const std::size_t n = shape.distances;
  const auto fill_line = [](auto first, auto last) {
    double value = std::numeric_limits<double>::quiet_NaN();
    for (auto i = first; i != last; ++i) value = std::isnan(*i) ? (*i = value) : *i;
  };
  for (std::size_t line = 0; line < row.size(); line += n) {
    const auto begin = row.begin() + static_cast<std::ptrdiff_t>(line), end = begin + static_cast<std::ptrdiff_t>(n);
    fill_line(begin, end);
    fill_line(std::make_reverse_iterator(end), std::make_reverse_iterator(begin));
  }
  for (std::size_t corner = 0; corner < row.size(); corner += shape.amplitudes * n) {
    for (std::size_t d = 0; d < n; ++d) {
      std::vector<double> column;
      for (std::size_t a = 0; a < shape.amplitudes; ++a) column.push_back(row[corner + a * n + d]);
      fill_line(column.rbegin(), column.rend());
      fill_line(column.begin(), column.end());
      for (std::size_t a = 0; a < shape.amplitudes; ++a) row[corner + a * n + d] = column[a];
    }
  }
}

constexpr double no_solution = 100 * steep_factor;

std::size_t greatest(const std::vector<double>& values) {
  const auto is_less = [](double a, double b) { return std::abs(a) < std::abs(b); };
  return static_cast<std::size_t>(std::ranges::max_element(values, is_less) - values.begin());
}

}  // namespace

double Nodes::allowed(std::size_t node, double correction) const {
  const tofgraph_camera& camera = inverse_.camera();
  const double tap =
      camera.read_noise * camera.read_noise + camera.shot_noise * amplitude(node) / (2 * camera.contrast);
  const double noise = shape_.range / physics::two_pi * std::sqrt(tap) / amplitude(node);
  return 3e-6 + 1e-3 * std::abs(correction) + (noise > 0 ? 0.005 * noise : 0);
}

std::vector<double> Nodes::solve(const std::vector<Place>& places) const {
  std::vector<double> result(places.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t c = 0; c < corners_.size(); ++c) {
    std::vector<Measured> measured;
    std::vector<std::size_t> which;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto& [pixel, node, near, lifted] = places[i];
      if (node / per_corner() != c) continue;
      which.push_back(i);
      const double guess = distance(node) + lifted + near;
      measured.push_back({pixel, this->measured(node) + lifted, amplitude(node), guess});
    }
    const std::vector<Undone> undone = inverse_.solve(corners_[c], measured);
    for (std::size_t j = 0; j < which.size(); ++j) {
      if (!undone[j].found) continue;
      // The solution is unique only modulo the range.
      const Place& place = places[which[j]];
      const double near = place.near, correction = undone[j].distance - distance(place.node);
      result[which[j]] = near + std::remainder(correction - near, shape_.range);
    }
  }
  return result;
}

double CrossApproximation::run(std::size_t max_products) {
  std::vector<double> first = row(middle_);
  std::vector<bool> unsolved;
  for (const double value : first) unsolved.push_back(std::isnan(value));
  if (std::ranges::all_of(first, [](double v) { return std::isnan(v); }))
    throw std::invalid_argument("cannot be undone: not one measured distance has a true one");
  fill(shape_, first);
  find_factors(first);
  for (std::size_t node = 0; node < first.size(); ++node)
    if (unsolved[node]) factors_[node] = no_solution;
  find_doubtful(first);
  add(std::vector<double>(count_, 1), std::move(first));
  choose_tests();
  for (std::size_t before = count_;;) {
    std::vector<double> rest = tested_;
    for (std::size_t p = 0; p < count_; ++p) rest[p] -= std::isnan(rest[p]) ? rest[p] : products_(p, tests_[p].node);
    std::ranges::replace_if(
        rest, [](double value) { return std::isnan(value); }, 0.0);
    std::vector<double> relative = rest;
    for (std::size_t p = 0; p < count_; ++p) relative[p] /= nodes_.allowed(tests_[p].node, tests_[p].near);
    const std::size_t pixel = greatest(relative);
    if (std::abs(relative[pixel]) < 1) return 0;
    if (pixel == before) {  // no improvement: two solutions at the end of the range
      tested_[pixel] = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    before = pixel;
    if (products_.nodes.size() == max_products || !add_cross(static_cast<std::uint32_t>(pixel)))
      return std::abs(rest[pixel]);
  }
}

/// Computes sigma factors from the slopes of the corrections along distance and amplitude. The noise of the amplitude
/// is that of the phase times the amplitude, and independent of it.
void CrossApproximation::find_factors(const std::vector<double>& first) {
  const std::size_t n = shape_.distances, lines = shape_.amplitudes;
  if (n == 0 || lines == 0) throw std::logic_error("a table without nodes");
  for (std::size_t node = 0; node < first.size(); ++node) {
    const std::size_t d = node % n, a = node % (n * lines) / n;
    const std::size_t near = node - (d > 0 ? 1 : 0), far = node + (d + 1 < n ? 1 : 0);
    const std::size_t weak = node - (a > 0 ? n : 0), strong = node + (a + 1 < lines ? n : 0);
    const double along = (first[far] - first[near]) / (nodes_.distance(far) - nodes_.distance(near));
    const double factor = std::log(nodes_.amplitude(strong) / nodes_.amplitude(weak));
    const auto of = [&](std::size_t i) { return first[i] - shape_.shifts[i % (n * lines) / n]; };
    const double across = factor > 0 ? (of(strong) - of(weak)) / factor : 0;
    factors_.push_back(std::hypot(1 + along, across / metres_per_radian_));
  }
}

/// Finds ambiguous nodes: if effects increase for weak light, a measured distance can belong to a near surface as well
/// as to one at the end of the range.
void CrossApproximation::find_doubtful(const std::vector<double>& first) {
  std::vector<Nodes::Place> places;
  const std::size_t n = shape_.distances, quarter = n / 4;
  for (std::size_t node = 0; node < first.size(); ++node) {
    const std::size_t d = node % n, line = node - d;
    if (d < quarter) places.push_back({middle_, node, first[line + n - 1], shape_.range});
    if (d + quarter >= n) places.push_back({middle_, node, first[line], -shape_.range});
  }
  const std::vector<double> others = nodes_.solve(places);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& [pixel, node, near, lifted] = places[i];
    const double one = nodes_.distance(node) + first[node], other = nodes_.distance(node) + lifted + others[i];
    if (nodes_.is_in_range(one) && nodes_.is_in_range(other)) factors_[node] = no_solution;
  }
}

void CrossApproximation::add(std::vector<double> pixels, std::vector<double> nodes) {
  products_.pixels.push_back(std::move(pixels));
  products_.nodes.push_back(std::move(nodes));
}

std::vector<double> CrossApproximation::row(std::uint32_t pixel) const {
  std::vector<Nodes::Place> places;
  for (std::size_t node = 0; node < nodes_.size(); ++node) places.push_back({pixel, node, products_(pixel, node)});
  return nodes_.solve(places);
}

/// Chooses a test node per pixel, preferably at small distances, where pixels differ most.
void CrossApproximation::choose_tests() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform;
  const std::size_t lines = nodes_.size() / shape_.distances;
  for (std::size_t p = 0; p < count_; ++p) {
    const double along = uniform(random);
    const auto d = static_cast<std::size_t>(along * along * static_cast<double>(shape_.distances));
    const auto line = static_cast<std::size_t>(uniform(random) * static_cast<double>(lines));
    const std::size_t node = line * shape_.distances + d;
    tests_.push_back({static_cast<std::uint32_t>(p), node, products_(p, node)});
  }
  tested_ = nodes_.solve(tests_);
  for (std::size_t p = 0; p < count_; ++p)
    if (is_doubtful(tests_[p].node) || !nodes_.is_in_range(nodes_.distance(tests_[p].node) + tested_[p]))
      tested_[p] = std::numeric_limits<double>::quiet_NaN();
}

bool CrossApproximation::add_cross(std::uint32_t pixel) {
  std::vector<double> rest_row = row(pixel);
  for (std::size_t node = 0; node < rest_row.size(); ++node)
    rest_row[node] = factors_[node] == no_solution ? std::numeric_limits<double>::quiet_NaN()
                                                   : rest_row[node] - products_(pixel, node);
  fill(shape_, rest_row);
  std::vector<double> trusted = rest_row;
  for (std::size_t node = 0; node < trusted.size(); ++node)
    trusted[node] = is_doubtful(node) || std::isnan(trusted[node])
                        ? 0
                        : trusted[node] / nodes_.allowed(node, products_(pixel, node));
  const std::size_t pivot = greatest(trusted);
  if (!(std::abs(trusted[pivot]) > 0)) return false;
  std::vector<Nodes::Place> places;
  for (std::size_t p = 0; p < count_; ++p)
    places.push_back({static_cast<std::uint32_t>(p), pivot, products_(p, pivot)});
  std::vector<double> column = nodes_.solve(places);
  for (std::size_t p = 0; p < count_; ++p)
    column[p] = std::isnan(column[p]) ? 0 : (column[p] - places[p].near) / rest_row[pivot];
  add(std::move(column), std::move(rest_row));
  return true;
}

}  // namespace tofgraph::simulation
