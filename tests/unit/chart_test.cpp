// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Numbers in pictures: short, whole, and none that reads as another.
#include "report/chart.hpp"

#include <gmock/gmock.h>

#include <limits>

namespace tofgraph::report {
namespace {

TEST(Plain, HasTheDigitsThatWereAskedForAndNoExponent) {
  EXPECT_EQ(plain(10.36), "10.4");
  EXPECT_EQ(plain(1821000.4), "1820000");
  EXPECT_EQ(plain(9.999), "10.0");
  EXPECT_EQ(plain(0.0083, 2, true), "+0.0083");
  EXPECT_EQ(plain(-0.0083, 2, true), "-0.0083");
}

TEST(Plain, HasNoNegativeZero) {
  EXPECT_EQ(plain(-1.48e-14, 3, true), "0");
  EXPECT_EQ(plain(0), "0");
  EXPECT_EQ(plain(std::numeric_limits<double>::quiet_NaN()), "-");
}

TEST(FieldMap, HasRoomForTheNumbersOfItsScale) {
  FieldMap map{.title = "t", .unit = "%", .rows = 1, .columns = 1, .fields = {{0.001, ""}}, .limit = 0.0083};
  const std::string narrow = field_map(map);
  EXPECT_THAT(narrow, testing::HasSubstr(">+0.0083</text>"));
  EXPECT_THAT(narrow, testing::HasSubstr(">-0.0083</text>"));
  map.limit = 1;
  const auto width_of_field = [](const std::string& svg) {
    const auto field = svg.find("<rect x=");
    return std::stod(svg.substr(svg.find("width=\"", field) + 7));
  };
  EXPECT_LT(width_of_field(narrow), width_of_field(field_map(map)));
}

}  // namespace
}  // namespace tofgraph::report
