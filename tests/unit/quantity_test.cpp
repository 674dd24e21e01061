// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/quantity.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace tofgraph::graph {
namespace {

struct Right {
  const char* text;
  const char* unit;
  double value;
};

TEST(Quantity, IsReadInSi) {
  const Right cases[] = {{"50 mm", "m", 0.05},
                         {"50mm", "m", 0.05},
                         {"0.5 ms", "s", 0.0005},
                         {"20 MHz", "Hz", 20e6},
                         {"10 deg", "rad", std::numbers::pi / 18},
                         {"12 mm/ms", "m/s", 12},
                         {"25 degC", "K", 298.15},
                         {"3 %", "", 0.03},
                         {"100 ppm", "", 1e-4},
                         {"7.0e6 counts m^2/s", "counts m^2/s", 7e6},
                         {"1500 counts/s", "counts/s", 1500},
                         {"2", "", 2},
                         {"-5 um", "m", -5e-6},
                         {"+1 km", "m", 1000},
                         {"2 h", "s", 7200},
                         {"1 min", "s", 60},
                         {"1.2 px", "px", 1.2},
                         {"20 ns", "s", 20e-9},
                         {"3 klx", "lx", 3000},
                         {"2 mm/K", "m/K", 0.002},
                         {"2 mm/degC", "m/K", 0.002},
                         {"1 1/s", "Hz", 1},
                         {"5 mrad", "rad", 0.005},
                         {"4 e", "e", 4}};
  for (const Right& c : cases) {
    const config::Quantity read = config::parse_quantity(c.text, c.unit);
    EXPECT_TRUE(read.ok()) << c.text << ": " << read.problem;
    EXPECT_NEAR(read.value, c.value, 1e-12 * std::abs(c.value)) << c.text;
  }
}

struct Wrong {
  const char* text;
  const char* unit;
  const char* problem;
};

TEST(Quantity, SaysWhatIsWrong) {
  const Wrong cases[] = {{"50", "m", "has no unit: a value in m is expected"},
                         {"50 ms", "m", "has the wrong dimension: a value in m is expected"},
                         {"50 mm", "", "has a unit: a pure number is expected"},
                         {"50 mn", "m", "has the unknown unit 'mn'"},
                         {"mm", "m", "is not a number"},
                         {"", "m", "is not a number"},
                         {"inf mm", "m", "must be finite"},
                         {"nan", "", "must be finite"},
                         {"1e999 m", "m", "is too large or too small for a number"},
                         {"5 mm/", "m", "has an incomplete unit"},
                         {"5 m^x", "m", "has 'm^x', which is not a power of a unit"},
                         {"5 mm 3", "m", "has the unknown unit '3'"}};
  for (const Wrong& c : cases) EXPECT_EQ(config::parse_quantity(c.text, c.unit).problem, c.problem) << c.text;
}

TEST(Quantity, IsShownAsPeopleWriteIt) {
  EXPECT_EQ(config::format_quantity(0.00391, "m"), "3.91 mm");
  EXPECT_EQ(config::format_quantity(20e6, "Hz"), "20 MHz");
  EXPECT_EQ(config::format_quantity(0.0005, "s"), "500 us");
  EXPECT_EQ(config::format_quantity(298.15, "K"), "25 degC");
  EXPECT_EQ(config::format_quantity(0, "m"), "0 m");
  EXPECT_EQ(config::format_quantity(0, "Hz"), "0 Hz");
  EXPECT_EQ(config::format_quantity(0.001, "Hz"), "0.001 Hz");
  EXPECT_EQ(config::format_quantity(-2e-8, "m"), "-0.02 um");
  EXPECT_EQ(config::format_quantity(3, "counts"), "3 counts");
  EXPECT_EQ(config::format_quantity(0.25, ""), "0.25");
}

}  // namespace
}  // namespace tofgraph::graph
