// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Numbers in charts: short, complete, and none that can be misread.
#include "report/chart.hpp"
#include "report/page.hpp"

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

/// Values that differ between conditions at one distance are not joined by a line.
TEST(Chart, TicksStandForThemselves) {
  Chart c{
      .title = "t", .x_label = "x", .y_label = "y", .series = {{"extended", Series::Style::ticks, {}, of_extended}}};
  c.series[0].marks = {{.x = 1, .y = 2, .title = "a", .condition = 4}, {.x = 1, .y = 3, .title = "b", .condition = 5}};
  const std::string svg = chart(c);
  EXPECT_THAT(svg, testing::HasSubstr("data-condition=\"5\"><title>b</title>"));
  EXPECT_EQ(svg.find("<circle"), std::string::npos);
  EXPECT_EQ(svg.find("stroke-width=\"2\"/></g>"), svg.rfind("stroke-width=\"2\"/></g>")) << "the legend's alone";
}

/// Wide charts scroll on a phone: the text of a scaled chart would be too small.
TEST(Chart, WideOnesScroll) {
  const Chart c{.title = "t", .x_label = "x", .y_label = "y", .series = {}};
  EXPECT_THAT(chart(c, 860), testing::HasSubstr("min-width:731px"));
  EXPECT_EQ(field_map({.title = "t", .rows = 1, .columns = 1, .fields = {{1, ""}}}, 276, 240).find("min-width"),
            std::string::npos);
}

TEST(Page, NumbersStayWithTheirUnits) {
  Page page("t");
  page.verdict("from 3.4 mm < 5 mm");
  page.paragraph("4 \u00b1 1 of 3");
  const std::vector<std::string> notes = {"2 mm & more"};
  page.list(notes);
  const std::string html = page.html();
  EXPECT_THAT(html, testing::HasSubstr("from 3.4&nbsp;mm &lt; 5&nbsp;mm"));
  EXPECT_THAT(html, testing::HasSubstr("<p>4&nbsp;\u00b1&nbsp;1&nbsp;of 3</p>"));
  EXPECT_THAT(html, testing::HasSubstr("<li>2&nbsp;mm &amp; more</li>"));
}

}  // namespace
}  // namespace tofgraph::report
