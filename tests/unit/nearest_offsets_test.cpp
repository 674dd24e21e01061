// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: physics plugins/filters
// Errors of a frame's pixels from scattered offset samples, compared with an exhaustive search in double precision.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>

#include "plugins/filters/nearest_offsets.hpp"
#include "plugins/filters/offset_vector.hpp"
#include "tests/unit/exhaustive_offset.hpp"

namespace tofgraph {
namespace {

constexpr std::size_t columns = 204, rows = 204;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

std::vector<physics::OffsetSample> scattered_samples(std::size_t count, double reflectivity = 0.1) {
  std::vector<physics::OffsetSample> samples;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(0, 1);
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 0.5 + 3 * any(random), time = 1e-3 * std::pow(8, any(random)),
                 rho = reflectivity * std::pow(8, any(random)),
                 distance = z + 0.01 * std::sin(5 * z) + 0.002 * std::log(time) + 0.003 * any(random);
    samples.push_back({i % 2, distance, z, time, rho});
    if (i < 2) samples.push_back({i % 2, distance, z + 1e-4, time * 1.1, rho});
  }
  return samples;
}

/// Depths and reflectivities of a frame, and their errors.
struct Pixels {
  std::vector<float> depth = std::vector<float>(columns * rows), reflectivity = depth, error = depth;

  void look_up(const NearestOffsets& offsets, double time) {
    std::vector<OffsetRow> of;
    for (std::size_t v = 0; v < rows; ++v) {
      of.push_back({});
      of.back().columns = columns;
      of.back().depth = &depth[v * columns];
      of.back().reflectivity = &reflectivity[v * columns];
      of.back().error = &error[v * columns];
    }
    offsets.look_up(time, of, [](const NearestGroup& group) { HWY_STATIC_DISPATCH(Weigh)(group); });
  }
};

/// A wall with two grey levels.
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

/// Pixels anywhere within the samples, also between their margin and the outermost of them.
Pixels anything() {
  Pixels pixels;
  std::mt19937 random(9);
  std::uniform_real_distribution<double> any(0, 1);
  for (std::size_t i = 0; i < columns * rows; ++i) {
    pixels.depth[i] = static_cast<float>(0.48 + 3.1 * any(random));
    pixels.reflectivity[i] = static_cast<float>(0.08 * std::pow(12, any(random)));
  }
  return pixels;
}

/// Largest deviation of every n-th pixel from the exhaustive search.
double largest_deviation(const Pixels& pixels, const std::vector<physics::OffsetSample>& samples, double time,
                         std::size_t every) {
  double largest = 0;
  std::size_t undecided = 0, seen = 0;
  for (std::size_t i = 0; i < columns * rows; i += every, ++seen) {
    const auto [one, other] =
        tests::exhaustive_errors(samples, double{pixels.depth[i]}, double{pixels.reflectivity[i]}, time);
    const double error = double{pixels.error[i]};
    if (one != other) ++undecided;
    const double deviation = std::min(std::abs(error - one), std::abs(error - other));
    if (!(deviation <= largest)) largest = deviation;
  }
  EXPECT_LT(undecided, seen / 100);
  return largest;
}

TEST(NearestOffsets, AreThoseOfAnExhaustiveSearch) {
  const std::vector<physics::OffsetSample> samples = scattered_samples(5000);
  const physics::OffsetTable table(samples);
  ASSERT_EQ(table.shape(), physics::OffsetTable::Shape::scattered);
  const NearestOffsets offsets(table);
  Pixels wall = slanted_wall(), all = anything();
  for (const double time : {1.02e-3, 2e-3}) {
    wall.look_up(offsets, time);
    EXPECT_LT(largest_deviation(wall, samples, time, 151), 1e-6) << time;
    all.look_up(offsets, time);
    EXPECT_LT(largest_deviation(all, samples, time, 151), 1e-6) << time;
  }
}

TEST(NearestOffsets, AreThoseOfFewAndUnevenSamples) {
  std::vector<physics::OffsetSample> samples = scattered_samples(12);
  for (const physics::OffsetSample& s : scattered_samples(400)) {
    samples.push_back(s);
    samples.back().depth = 1.5 + 0.01 * s.depth;  // 400 of 412 within 3 cm
    samples.back().distance = samples.back().depth + 0.001 * s.distance;
  }
  const physics::OffsetTable table(samples);
  ASSERT_EQ(table.shape(), physics::OffsetTable::Shape::scattered);
  const NearestOffsets offsets(table);
  Pixels all = anything();
  const auto depths = std::ranges::minmax(samples, {}, &physics::OffsetSample::depth);
  const auto levels = std::ranges::minmax(samples, {}, &physics::OffsetSample::reflectivity);
  for (float& z : all.depth)
    z = std::clamp(z, static_cast<float>(depths.min.depth), static_cast<float>(depths.max.depth));
  for (float& rho : all.reflectivity)
    rho = std::clamp(rho, static_cast<float>(levels.min.reflectivity), static_cast<float>(levels.max.reflectivity));
  all.look_up(offsets, 3e-3);
  EXPECT_LT(largest_deviation(all, samples, 3e-3, 31), 1e-6);
}

TEST(NearestOffsets, OfOneTargetAreThoseOfItsSamplesWhateverTheReflectivity) {
  std::vector<physics::OffsetSample> samples = scattered_samples(1000), first;
  for (physics::OffsetSample& s : samples) s.distance += s.target == 0 ? 5e-3 : -5e-3;
  std::ranges::copy_if(samples, std::back_inserter(first), [](const auto& s) { return s.target == 0; });
  for (physics::OffsetSample& s : first) s.reflectivity = std::numeric_limits<double>::quiet_NaN();
  Pixels wall = slanted_wall();
  for (const bool known : {true, false}) {
    for (physics::OffsetSample& s : samples) s.reflectivity = known ? s.reflectivity : first.front().reflectivity;
    const physics::OffsetTable table(samples);
    ASSERT_EQ(table.knows_reflectivities(), known);
    const NearestOffsets of_first(table.scattered_of(0));
    wall.look_up(of_first, 2e-3);
    EXPECT_LT(largest_deviation(wall, first, 2e-3, 97), 1e-6) << known;
    EXPECT_NEAR(table.of_target(0, 1.5, 2e-3).depth, 1.5 + tests::exhaustive_errors(first, 1.5, 1, 2e-3).first, 1e-9);
  }
}

TEST(NearestOffsets, HoldTheEdgeBeyondTheSamplesInAllThreads) {
  const physics::OffsetTable table(scattered_samples(5000));
  const NearestOffsets offsets(table);
  Pixels wall = slanted_wall();
  wall.depth[0] = nan;
  wall.depth[1] = -1;
  wall.depth[2] = 100;
  wall.reflectivity[3] = nan;
  wall.reflectivity[4] = 0;
  wall.reflectivity[5] = 1e6F;
  Pixels beside = wall, last = wall;
  last.depth[2] = static_cast<float>(1.05 * std::ranges::max(table.samples(), {}, &physics::OffsetSample::depth).depth);
  std::thread other([&] {
    for (const double time : {1e-3, 3e-3, 8e-3, 3e-3}) beside.look_up(offsets, time);
  });
  for (const double time : {8e-3, 1e-3, 3e-3}) wall.look_up(offsets, time);
  other.join();
  last.look_up(offsets, 3e-3);
  EXPECT_EQ(wall.error, beside.error);
  EXPECT_EQ(wall.error, last.error) << "100 m and the end of the margin";
  for (const float error : wall.error) ASSERT_TRUE(std::isfinite(error));
}

}  // namespace
}  // namespace tofgraph
