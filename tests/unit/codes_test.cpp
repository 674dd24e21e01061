// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Repeated values that are codes, and measurements that happen to be equal.
#include "io/codes.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>

namespace tofgraph::io {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr double real = std::numeric_limits<double>::infinity(), uint16 = 65535, int16 = 32767;

MATCHER_P2(IsCode, value, count, "") { return arg.value == value && arg.count == static_cast<std::size_t>(count); }

/// Appends each value from `begin` to `end` in steps of `step`, `count` times.
std::vector<double> steps(double begin, double end, double step, int count, std::vector<double> values = {}) {
  for (double value = begin; value <= end; value += step)
    values.insert(values.end(), static_cast<unsigned>(count), value);
  return values;
}
std::vector<double> with(std::vector<double> values, double value, int count) {
  return steps(value, value, 1, count, std::move(values));
}

std::vector<CountedValue> codes_among(const std::vector<double>& values, double largest) {
  std::vector<CountedValue> once;
  for (const double value : values) once.push_back({value});
  return suspected_codes(once, largest);
}

/// 255 and 511 are 2^n - 1 as well.
TEST(Codes, OfDenseIntegersAreNone) {
  EXPECT_THAT(codes_among(steps(200, 600, 1, 20), uint16), IsEmpty());
  EXPECT_THAT(codes_among(steps(1, 900, 1, 56), int16), IsEmpty());
  EXPECT_THAT(codes_among(with(steps(200, 600, 1, 20), 4095, 20), uint16), ElementsAre(IsCode(4095, 20)));
  EXPECT_THAT(codes_among(with(steps(300, 500, 1, 20), 255, 20), uint16), ElementsAre(IsCode(255, 20)));
}

/// Words that are multiples of five, or bits shifted to the left: no value has a neighbour.
TEST(Codes, OfCoarseStepsAreNone) {
  EXPECT_THAT(codes_among(steps(200, 5000, 5, 20), uint16), IsEmpty()) << "255 and 4095 are among them";
  EXPECT_THAT(codes_among(with(steps(200, 5000, 5, 20), 8191, 20), uint16), ElementsAre(IsCode(8191, 20)));
  std::vector<double> centimetres = steps(1, 1.4, 0.01, 200);
  EXPECT_THAT(codes_among(steps(3, 3.2, 0.01, 12, centimetres), real), IsEmpty()) << "a wall behind a board";
  EXPECT_THAT(codes_among(with(centimetres, 60, 100), real), ElementsAre(IsCode(60, 100)));
  EXPECT_THAT(codes_among(with(steps(1, 1.2, 0.01, 200), 3, 5000), real), IsEmpty()) << "a plain wall behind it";
}

TEST(Codes, FarAboveTheOtherValuesAreFoundInAnyNumber) {
  std::mt19937 random(4);
  std::normal_distribution<double> wall(2, 0.1);
  std::vector<double> lengths;
  for (int i = 0; i < 10000; ++i) lengths.push_back(wall(random));
  for (const int count : {10, 100, 500, 5000, 20000}) {
    EXPECT_THAT(codes_among(with(lengths, 60, count), real), ElementsAre(IsCode(60, count)));
    EXPECT_THAT(codes_among(with(with(lengths, 60, count), 65, count), real),
                ElementsAre(IsCode(60, count), IsCode(65, count)));
    EXPECT_THAT(codes_among(with(steps(1500, 2500, 1, 20), 60000, count), uint16), ElementsAre(IsCode(60000, count)));
  }
  EXPECT_THAT(codes_among(with(lengths, 60, 9), real), IsEmpty()) << "too few";
  EXPECT_THAT(codes_among(with(lengths, 2.8, 500), real), IsEmpty()) << "not far above";
}

TEST(Codes, TheLargestWordNeedsNoRepetition) {
  EXPECT_THAT(codes_among(with(steps(1500, 2500, 1, 20), uint16, 1), uint16), ElementsAre(IsCode(uint16, 1)));
  EXPECT_THAT(codes_among(std::vector<double>(100, uint16), uint16), ElementsAre(IsCode(uint16, 100)));
  EXPECT_THAT(codes_among({}, uint16), IsEmpty());
  EXPECT_THAT(codes_among({-1, 0, std::nan(""), real}, real), IsEmpty());
  EXPECT_THAT(codes_among(std::vector<double>(100, 4095), uint16), IsEmpty()) << "no other values";
}

TEST(Codes, TheSmallestWordIsOneIfItIsRepeatedAndAlone) {
  constexpr double smallest = -32768;
  const auto codes_with = [](double next, std::size_t count) {
    return suspected_codes({{smallest, count}, {next, 50}, {0, 50}, {100, 50}, {101, 50}}, int16, smallest);
  };
  EXPECT_THAT(codes_with(-700, 10), ElementsAre(IsCode(smallest, 10)));
  EXPECT_THAT(codes_with(-700, 9), IsEmpty()) << "too few";
  EXPECT_THAT(codes_with(-32760, 10), IsEmpty()) << "the tail of a distribution";
  EXPECT_THAT(suspected_codes({{-128, 20}, {-127, 20}, {4, 50}}, 127, -128), IsEmpty());
  EXPECT_THAT(suspected_codes({{smallest, 20}, {100, 50}, {101, 50}}, int16), IsEmpty()) << "not examined";
}

TEST(Codes, CountsOfEqualValuesAreAdded) {
  const std::vector<CountedValue> counted = {{4095, 6}, {300, 50}, {4095, 5}, {301, 50}, {302, 50}, {-1, 70}};
  EXPECT_THAT(suspected_codes(counted, uint16), ElementsAre(IsCode(4095, 11)));
  EXPECT_THAT(suspected_codes({{4095, 4}, {300, 50}, {4095, 5}, {301, 50}}, uint16), IsEmpty()) << "too few";
}

}  // namespace
}  // namespace tofgraph::io
