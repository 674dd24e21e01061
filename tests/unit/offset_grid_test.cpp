// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: physics plugins/filters
// The grid of scattered offset samples, whose nodes are computed when a pixel first needs them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>

#include "plugins/filters/offset_grid.hpp"

namespace tofgraph {
namespace {

constexpr std::size_t columns = 204, rows = 204;

physics::OffsetTable scattered_table() {
  std::vector<physics::OffsetSample> samples;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(0, 1);
  for (int i = 0; i < 5000; ++i) {
    const double z = 0.5 + 3 * any(random), time = 1e-3 * std::pow(8, any(random)),
                 rho = 0.1 * std::pow(8, any(random)), distance = z + 0.01 * std::sin(5 * z) + 0.002 * std::log(rho);
    samples.push_back({0, distance, z, time, rho});
    if (i == 0) samples.push_back({0, distance, z + 1e-4, time * 1.1, rho});
  }
  return physics::OffsetTable(std::move(samples));
}

/// Depths and reflectivities of a frame.
struct Pixels {
  std::vector<float> depth = std::vector<float>(columns * rows), reflectivity = depth;

  OffsetRow row(std::size_t v) {
    OffsetRow row{};
    row.columns = columns;
    row.depth = &depth[v * columns];
    row.reflectivity = &reflectivity[v * columns];
    return row;
  }
};

Pixels slanted_wall() {
  Pixels pixels;
  std::mt19937 random(8);
  std::normal_distribution<double> noise;
  for (std::size_t i = 0; i < columns * rows; ++i) {
    const double across = static_cast<double>(i % columns) / columns;
    pixels.depth[i] = static_cast<float>(1.2 + 0.9 * across + 0.003 * noise(random));
    pixels.reflectivity[i] = static_cast<float>((i / columns < 90 ? 0.6 : 0.3) * (1 + 0.01 * noise(random)));
  }
  return pixels;
}

/// Offset of a pixel from the four nodes around it, as in the correction; z and node from the definition of the grid.
double interpolated(const OffsetPlane& plane, double depth, float reflectivity) {
  const double place = (depth - plane.first) * plane.per_metre;
  const auto z = static_cast<std::int32_t>(place);
  const std::int32_t bits = std::bit_cast<std::int32_t>(reflectivity) - plane.base;
  const double part = (bits & 0xffff) / 65536.0, along = place - z;
  const float* node = plane.errors + z * plane.levels + (bits >> OffsetPlane::step_bits);
  const double low = node[0] + part * (node[1] - node[0]),
               high = node[plane.levels] + part * (node[plane.levels + 1] - node[plane.levels]);
  return low + along * (high - low);
}

std::size_t computed_nodes(const OffsetPlane& plane) {
  return static_cast<std::size_t>(
      std::count_if(plane.errors, plane.errors + plane.depths * plane.levels, [](float e) { return !std::isnan(e); }));
}

TEST(OffsetGrid, OfScatteredSamplesComputesTheNodesThatPixelsNeed) {
  const physics::OffsetTable table = scattered_table();
  ASSERT_EQ(table.shape(), physics::OffsetTable::Shape::scattered);
  const OffsetGrid grid(table, std::nullopt);
  const double time = 2e-3;
  const OffsetPlane plane = grid.at(time);
  EXPECT_EQ(computed_nodes(plane), 0U);
  Pixels wall = slanted_wall();
  for (std::size_t v = 0; v < rows; ++v) grid.complete(wall.row(v), plane);
  const std::size_t computed = computed_nodes(plane), all = static_cast<std::size_t>(plane.depths * plane.levels);
  std::printf("%zu of %zu nodes computed\n", computed, all);
  EXPECT_GT(computed, 100U);
  EXPECT_LT(computed, all / 10);
  double squares = 0, largest = 0;
  for (std::size_t i = 0; i < columns * rows; ++i) {
    const double expected = table.across(wall.depth[i], time).at(wall.reflectivity[i]).depth - double{wall.depth[i]};
    const double error = interpolated(plane, wall.depth[i], wall.reflectivity[i]) - expected;
    ASSERT_TRUE(std::isfinite(error)) << i << ": a node is missing";
    squares += error * error;
    largest = std::max(largest, std::abs(error));
  }
  std::printf("between nodes: %.2g m RMS, at most %.2g m from the table\n", std::sqrt(squares / (columns * rows)),
              largest);
  // Between nodes the interpolation is linear, but the table has a peak at each sample.
  EXPECT_LT(std::sqrt(squares / (columns * rows)), 5e-5);
}

TEST(OffsetGrid, NodesAreThoseOfTheTableAndTheSameForAllThreads) {
  const physics::OffsetTable table = scattered_table();
  const OffsetGrid grid(table, std::nullopt);
  const double time = 3e-3;
  const auto work = [&] {
    const OffsetPlane plane = grid.at(time);
    Pixels wall = slanted_wall();
    wall.depth[0] = NAN;
    wall.depth[1] = -1;
    wall.depth[2] = 100;
    wall.reflectivity[3] = 0;
    wall.reflectivity[4] = 1e6F;
    for (std::size_t v = 0; v < rows; ++v) grid.complete(wall.row(v), plane);
  };
  const OffsetPlane plane = grid.at(time);
  std::thread other(work);
  work();
  other.join();
  for (std::int32_t node = 0; node < plane.depths * plane.levels; ++node) {
    if (std::isnan(plane.errors[node])) continue;
    const double z = double{plane.first} + node / plane.levels / double{plane.per_metre};
    const float reflectivity = std::bit_cast<float>(plane.base + (node % plane.levels << OffsetPlane::step_bits));
    ASSERT_EQ(plane.errors[node], static_cast<float>(table.across(z, time).at(double{reflectivity}).depth - z));
  }
  for (const std::int32_t row : {0, plane.depths - 1})
    EXPECT_TRUE(std::any_of(plane.errors + row * plane.levels, plane.errors + (row + 1) * plane.levels, [](float e) {
      return !std::isnan(e);
    })) << row;
}

}  // namespace
}  // namespace tofgraph
