// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Settings in the wrong unit, lengths in the wrong unit, impossible clocks.
#include "io/plausibility.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/unit/cameras.hpp"

namespace tofgraph::io {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const tofgraph_camera& camera() {
  static const test::Camera made(8, 6, 2e-3, 45e-6, {{"lamp", {0, 0, 0}, 1}});  // 20 MHz, 0.5 to 50 ms, 80 Hz
  return made.view;
}

TEST(Frequency, IsDoubtedWhereAnotherUnitWouldFit) {
  EXPECT_THAT(frequency_doubt(20, &camera()),
              AllOf(HasSubstr("is 20 Hz"), HasSubstr("is 20 MHz"), HasSubstr("in MHz")));
  EXPECT_THAT(frequency_doubt(20e3, &camera()), AllOf(HasSubstr("20 kHz"), HasSubstr("in kHz")));
  EXPECT_THAT(frequency_doubt(20e12, &camera()), HasSubstr("the modulation frequency is 20000 GHz"));
  EXPECT_THAT(frequency_doubt(80, nullptr), AllOf(HasSubstr("expected 100 kHz to 1 GHz"), HasSubstr("in MHz")));
  EXPECT_THAT(frequency_doubt(20e-6, &camera()), HasSubstr("in THz"));
  EXPECT_THAT(frequency_doubt(0, &camera()), HasSubstr("is 0 Hz"));
  for (const double good : {1e6, 20e6, 60e6, std::nan("")}) EXPECT_EQ(frequency_doubt(good, &camera()), "") << good;
  EXPECT_EQ(frequency_doubt(80e6, nullptr), "");
}

TEST(IntegrationTime, IsDoubtedWhereAnotherUnitWouldFit) {
  EXPECT_THAT(integration_time_doubt(1000, &camera()),
              AllOf(HasSubstr("is 1000 s"), HasSubstr("allows 500 us to 50 ms"), HasSubstr("in us (1000 us = 1 ms)")));
  EXPECT_THAT(integration_time_doubt(2, nullptr), HasSubstr("in ms (2 ms = 2 ms)"));
  EXPECT_THAT(integration_time_doubt(1e-6, &camera()), HasSubstr("is 1 us"));
  EXPECT_THAT(integration_time_doubt(-1, &camera()), HasSubstr("is -1 s"));
  for (const double good : {0.1e-3, 1e-3, 50e-3, std::nan("")})
    EXPECT_EQ(integration_time_doubt(good, &camera()), "") << good;
}

TEST(Temperature, InKelvinIsDoubted) {
  EXPECT_THAT(temperature_doubt(298.15 + 273.15), AllOf(HasSubstr("298.15 degC"), HasSubstr("in K, not in degC")));
  EXPECT_EQ(temperature_doubt(298.15), "");
  EXPECT_EQ(temperature_doubt(std::nan("")), "");
}

TEST(Length, InMillimetresIsDoubted) {
  const double range = 299792458.0 / 40e6;
  EXPECT_THAT(length_doubt("range", {1000}, range), AllOf(HasSubstr("median of range is 1000 m"),
                                                          HasSubstr("7.49481 m"), HasSubstr("in mm (1000 mm = 1 m)")));
  EXPECT_THAT(length_doubt("depth", {250}, range),
              AllOf(HasSubstr("in cm"), HasSubstr("or in mm"), HasSubstr("or in inches (250 inches = 6.35 m)")));
  EXPECT_THAT(length_doubt("depth", {0.002F}, range), HasSubstr("in km (0.002 km = 2 m)"));
  EXPECT_THAT(length_doubt("depth", {0, -1, std::nanf(""), 900, 1000, 1100}, range),
              HasSubstr("median of depth is 1000 m"));
  EXPECT_THAT(length_doubt("depth", {0.001F}, range), HasSubstr("is 1 mm"));
  EXPECT_THAT(length_doubt("distance", {5000}, std::nan("")), HasSubstr("in mm"));
  for (const float good : {0.05F, 1.0F, 7.4F, 40.0F, std::nanf("")})
    EXPECT_EQ(length_doubt("range", {good}, range), "") << good;
}

TEST(Length, BeyondTheRangeOfTheCameraIsDoubted) {
  std::vector<float> lengths(100, 2.0F);
  std::fill_n(lengths.begin(), 10, 9.0F);
  EXPECT_THAT(range_doubt("range", lengths, 4, 7.5),
              AllOf(HasSubstr("10 % of the lengths of range are beyond 7.5 m, the unambiguous range of the camera"),
                    HasSubstr("up to 9 m"), HasSubstr("factor of 1.2 or more")));
  for (const double unambiguous : {7.5, 3.0, std::nan("")})
    EXPECT_THAT(range_doubt("range", lengths, 3.5, unambiguous),
                AllOf(HasSubstr("beyond 7 m, twice the measuring_range of the camera"), HasSubstr("factor of 1.3 or")));
  EXPECT_THAT(range_doubt("range", lengths, std::nan(""), 3), HasSubstr("beyond 6 m, twice its unambiguous range"));
  EXPECT_EQ(range_doubt("range", lengths, std::nan(""), 5), "") << "several frequencies";
  EXPECT_EQ(range_doubt("range", lengths, std::nan(""), std::nan("")), "");
  EXPECT_EQ(range_doubt("range", std::vector<float>(100, 2.0F), 4, 7.5), "");
}

/// The range of a data sheet is that of the stated accuracy; a wall beyond it is measured as well.
TEST(Length, SlightlyBeyondADataSheetIsNotDoubted) {
  std::vector<float> lengths(100, 2.0F);
  std::fill_n(lengths.begin(), 30, 4.3F);
  EXPECT_EQ(range_doubt("depth", lengths, 3.9, 7.5), "");
  EXPECT_EQ(range_doubt("depth", lengths, 3.9, 4.2), "") << "an offset of 0.1 m";
  EXPECT_EQ(range_doubt("depth", lengths, 2.2, std::nan("")), "");
  EXPECT_EQ(range_doubt("depth", lengths, 3.9, 1.9), "") << "several frequencies";
}

std::vector<tofgraph_metadata> frames(const std::vector<std::int64_t>& stamps,
                                      const std::vector<double>& power_on = {}) {
  std::vector<tofgraph_metadata> all;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    tofgraph_metadata& frame = all.emplace_back();
    frame.timestamp_ns = stamps[i];
    frame.integration_time = 1e-3;
    frame.modulation_frequency = 20e6;
    frame.temperature = std::nan("");
    frame.time_since_power_on = power_on.empty() ? std::nan("") : power_on[i];
  }
  return all;
}

constexpr std::int64_t s = 1'000'000'000, ms = 1'000'000;

TEST(Clock, ThatRunsBackStandsStillOrIsTooFastIsDoubted) {
  EXPECT_THAT(clock_doubts(frames({2 * s, s}), &camera()),
              ElementsAre(AllOf(HasSubstr("runs back"), HasSubstr("2000000000 ns at frame 0"),
                                HasSubstr("1000000000 ns at frame 1"))));
  EXPECT_THAT(clock_doubts(frames({s, 3 * s, 2 * s, 4 * s}), nullptr), ElementsAre(HasSubstr("at frame 2")));
  EXPECT_THAT(clock_doubts(frames({s, s, s}), &camera()), ElementsAre(HasSubstr("does not advance")));
  // 10 frames per second, in microseconds instead of nanoseconds.
  EXPECT_THAT(
      clock_doubts(frames({5'000'000, 5'100'000, 5'200'000}), &camera()),
      ElementsAre(AllOf(HasSubstr("100 us between frames"), HasSubstr("exposed for 1 ms"), HasSubstr("in us"))));
  EXPECT_THAT(clock_doubts(frames({0, 100'000, 200'000}), &camera()), ElementsAre(HasSubstr("in us")))
      << "a clock that begins with 0";
  EXPECT_THAT(clock_doubts(frames({s, s + 12 * ms, s + 25 * ms}), &camera()), IsEmpty());
  EXPECT_THAT(clock_doubts(frames({0, 0}), &camera()), IsEmpty()) << "unknown";
  EXPECT_THAT(clock_doubts(frames({s}), &camera()), IsEmpty());
}

TEST(PowerOn, ThatRunsBackOrIsInAnotherUnitIsDoubted) {
  EXPECT_THAT(clock_doubts(frames({s, 2 * s, 3 * s}, {10, 11, 5}), nullptr),
              ElementsAre(AllOf(HasSubstr("time since power on runs back"), HasSubstr("11 s"), HasSubstr("5 s"))));
  EXPECT_THAT(clock_doubts(frames({s, 2 * s, 3 * s}, {10000, 11000, 12000}), nullptr),
              ElementsAre(AllOf(HasSubstr("grows by 2000 s"), HasSubstr("by 2 s"), HasSubstr("in ms"))));
  EXPECT_THAT(clock_doubts(frames({s, 2 * s}, {-1, 0}), nullptr), ElementsAre(HasSubstr("is -1 s at frame 0")));
  EXPECT_THAT(clock_doubts(frames({s, 2 * s, 3 * s}, {10, 11, 12}), nullptr), IsEmpty());
}

TEST(Metadata, GivesOneDoubtForEachQuantity) {
  std::vector<tofgraph_metadata> all = frames({s, 2 * s, 3 * s});
  for (tofgraph_metadata& frame : all) frame.modulation_frequency = 20, frame.integration_time = 1000;
  EXPECT_THAT(metadata_doubts(all, &camera()),
              ElementsAre(HasSubstr("modulation frequency"), HasSubstr("integration time")));
}

}  // namespace
}  // namespace tofgraph::io
