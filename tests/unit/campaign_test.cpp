// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Campaigns as the format describes them, written and read back. Wording of errors: tests/fixtures/errors.
#include "io/campaign.hpp"
#include "tests/program.hpp"
#include "tests/unit/campaign_reading.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace tofgraph::io {
namespace {

using tests::TemporaryFolder;
using tests::write_text;

TEST(Campaign, PatternsThatCannotBeAreRefusedAtTheirPlace) {
  const TemporaryFolder folder;
  write_text(folder.path() / "c.h5", "");
  const auto with = [&](const std::string& pattern) {
    write_text(folder.path() / "c.yaml",
               "campaign: 1\ncamera: camcube2\npattern: {" + pattern + "}\nconditions:\n  - {id: a, capture: c.h5}\n");
    return mistakes(folder.path() / "c.yaml");
  };
  EXPECT_THAT(with("type: chessboard, columns: 2, rows: 6, square: 30 mm"), testing::HasSubstr("c.yaml:3:"));
  EXPECT_EQ(with("type: chessboard, columns: 3, rows: 3, square: 30 mm"), "");
  const std::string charuco = "type: charuco, columns: 12, rows: 8, square: 30 mm, marker: 22 mm, dictionary: ";
  EXPECT_THAT(with(charuco + "4x4_50"), testing::HasSubstr("has 58 markers, the dictionary 4x4_50 only 50"));
  EXPECT_EQ(with(charuco + "4x4_100"), "");
}

TEST(Campaign, ANoteIsATextOrAListOfTexts) {
  const TemporaryFolder folder;
  write_text(folder.path() / "c.h5", "");
  const auto file = folder.path() / "c.yaml";
  const auto write = [&](const std::string& note) {
    write_text(file, "campaign: 1\ncamera: camcube2\nnote: " + note +
                         "\nconditions:\n  - {id: a, capture: c.h5, board: {distance: 1 m}}\n");
  };
  write("one");
  EXPECT_THAT(read(file).notes, testing::ElementsAre("one"));
  write("[one, two]");
  EXPECT_THAT(read(file).notes, testing::ElementsAre("one", "two"));
  for (const char* wrong : {"", "[]", "{a: b}", "[{a: b}]"}) {
    write(wrong);
    EXPECT_THAT(mistakes(file), testing::HasSubstr("c.yaml:3:")) << wrong;
  }
}

TEST(Campaign, TheLargestJitterOfJoinedCampaignsHoldsIfEachStatesOne) {
  const TemporaryFolder folder;
  const auto write = [&](const std::string& name, const std::string& text) {
    write_text(folder.path() / (name + ".yaml"), "campaign: 1\ncamera: camcube2\n" + text);
  };
  const auto jitter = [&](const std::string& name) { return read(folder.path() / (name + ".yaml")).jitter; };
  write_text(folder.path() / "c.h5", "");
  const std::string one = "conditions:\n  - {capture: c.h5, board: {distance: 1 m}}\n";
  write("near", "jitter: 0.2 mm\n" + one);
  write("far", "jitter: 3 mm\n" + one);
  write("plain", one);
  write("both", "campaigns: [near.yaml, far.yaml]\n");
  write("own", "jitter: 1 mm\ncampaigns: [near.yaml, far.yaml]\n");
  write("not_all", "campaigns: [near.yaml, plain.yaml]\n");
  EXPECT_DOUBLE_EQ(jitter("near"), 0.2e-3);
  EXPECT_TRUE(std::isinf(jitter("plain")));
  EXPECT_DOUBLE_EQ(jitter("both"), 3e-3);
  EXPECT_DOUBLE_EQ(jitter("own"), 1e-3);
  EXPECT_TRUE(std::isinf(jitter("not_all")));
  write("none", "jitter: 0 mm\n" + one);
  EXPECT_THAT(mistakes(folder.path() / "none.yaml"), testing::HasSubstr("none.yaml:3:9: error: 'jitter' is '0 mm'"));
}

TEST(Campaign, ReadsTheExampleOfTheFormat) {
  const TemporaryFolder folder;
  write_text(folder.path() / "captures/white_0500.h5", "");
  write_text(folder.path() / "corner.yaml", "");
  write_text(folder.path() / "c.yaml", R"(campaign: 1
name: white board on a rail
camera: camcube2
pattern: {type: chessboard, columns: 8, rows: 6, square: 30 mm}
conditions:
  - id: white-0500-0.5ms
    capture: captures/white_0500.h5
    frames: [0, 19]
    board: {distance: 500 mm, tilt_x: 10 deg, tilt_y: -5 deg, size: [841 mm, 594 mm]}
    target: white
    reflectivity: 0.8
    integration_time: 0.5 ms
    sources: both
    ambient: dark
    time_since_power_on: 3600 s
    roi: {columns: [0, 203], rows: [10, 193]}
    order: 4
  - id: more
    capture: captures/white_0500.h5
    scene: corner.yaml
    sources: left
    ambient: lamp
    roll: 180 deg
    velocity: 100 mm/s
    reference: laser
    lens: capped
    rail: covered
    temperature: 25 degC
)");
  const Campaign campaign = read(folder.path() / "c.yaml");
  EXPECT_EQ(campaign.name, "white board on a rail");
  EXPECT_EQ(campaign.pattern->columns, 8);
  EXPECT_DOUBLE_EQ(campaign.pattern->square, 0.03);
  ASSERT_EQ(campaign.conditions.size(), 2U);
  const Condition& a = campaign.conditions[0];
  EXPECT_EQ(a.id, "white-0500-0.5ms");
  EXPECT_EQ(a.capture, folder.path() / "captures/white_0500.h5");
  EXPECT_THAT(*a.frames, testing::ElementsAre(0, 19));
  EXPECT_EQ(a.board_distance, 0.5);
  EXPECT_DOUBLE_EQ(a.board_tilt_x, M_PI / 18);
  EXPECT_DOUBLE_EQ(a.board_tilt_y, -M_PI / 36);
  EXPECT_DOUBLE_EQ(a.board_size->at(1), 0.594);
  EXPECT_EQ(a.target, "white");
  EXPECT_EQ(a.reflectivity, 0.8);
  EXPECT_EQ(a.integration_time, 0.5e-3);
  EXPECT_TRUE(a.sources.empty());
  EXPECT_EQ(a.time_since_power_on, 3600);
  EXPECT_EQ(a.roi->first_row, 10U);
  EXPECT_EQ(a.roi->last_column, 203U);
  EXPECT_EQ(a.order, 4U);
  EXPECT_EQ(a.at.line, 6U);
  EXPECT_EQ(a.place("capture").line, 7U);
  EXPECT_GT(a.place("distance").line, a.place("capture").line);
  EXPECT_EQ(a.place("velocity").line, 6U) << "it is not written";
  EXPECT_TRUE(std::isnan(a.velocity));
  const Condition& b = campaign.conditions[1];
  EXPECT_FALSE(b.has_board());
  EXPECT_EQ(b.scene, folder.path() / "corner.yaml");
  EXPECT_THAT(b.sources, testing::ElementsAre("left"));
  EXPECT_DOUBLE_EQ(b.roll, M_PI);
  EXPECT_DOUBLE_EQ(b.velocity, 0.1);
  EXPECT_DOUBLE_EQ(b.temperature, 298.15);
  EXPECT_EQ(b.reference + b.lens + b.rail, "lasercappedcovered");
  EXPECT_TRUE(std::isnan(b.integration_time)) << "the capture's";
}

TEST(Campaign, ATargetIsTakenForMisspelledWhereManyHaveNearlyItsLabel) {
  const auto warned = [](const std::vector<std::string>& targets) {
    Campaign campaign;
    for (const std::string& target : targets) {
      Condition condition;
      condition.target = target;
      campaign.conditions.push_back(std::move(condition));
    }
    config::Diagnostics diagnostics;
    warn_of_targets(campaign, diagnostics);
    EXPECT_TRUE(diagnostics.ok());
    std::vector<std::string> said;
    for (const config::Diagnostic& one : diagnostics.all()) said.push_back(one.message + ": " + one.hint);
    return said;
  };
  using testing::ElementsAre;
  const std::vector<std::string> nothing;
  EXPECT_THAT(warned({"grey", "grey", "gray", "grey"}),
              ElementsAre("target 'gray' has one condition only: did you mean 'grey'?"));
  EXPECT_THAT(warned({"white", "white", "White", "white", "White", "white"}),
              ElementsAre("target 'White' has two conditions only: did you mean 'white'?"));
  EXPECT_EQ(warned({"grey", "gray", "grey"}), nothing) << "two of three tell nothing";
  EXPECT_EQ(warned({"grey", "grey", "grey", "black"}), nothing);
  EXPECT_EQ(warned({"board 1", "board 1", "board 1", "board 2"}), nothing) << "a number is no misspelling";
  EXPECT_EQ(warned({"75", "75", "75", "25"}), nothing);
  EXPECT_EQ(warned({"a", "a", "a", "b"}), nothing);
  EXPECT_EQ(warned({"grey", "grey", "grey", ""}), nothing);
}

void expect_same(double a, double b) {
  if (std::isnan(a))
    EXPECT_TRUE(std::isnan(b));
  else
    EXPECT_EQ(a, b);  // to the last bit
}

TEST(Campaign, ComesBackAsWritten) {
  const TemporaryFolder folder;
  write_text(folder.path() / "data/one two.h5", "");
  write_text(folder.path() / "data/scene.yaml", "");
  Campaign campaign;
  campaign.name = "a: \"name\" # of 'signs' \u00e4";
  campaign.notes = {"the board of 2 m: moved by hand", "- and back"};
  campaign.camera_name = "camcube2";
  campaign.pattern = Pattern{7, 5, 0.1 / 3};
  campaign.jitter = 0.001 / 3;
  Condition c;
  c.id = "12.5";
  c.capture = folder.path() / "data/one two.h5";
  c.frames = {3, 9};
  c.board_distance = 0.1 + 0.2;
  c.board_tilt_x = std::nextafter(0.1, 1);
  c.board_tilt_y = -M_PI / 7;
  c.board_size = {1.0 / 3, 0.594};
  c.target = "null";
  c.reflectivity = 2.0 / 3;
  c.integration_time = 0.0005 / 3;
  c.sources = {"right"};
  c.ambient = "- lamp";
  c.time_since_power_on = 1e9 / 7;
  c.roll = M_PI;
  c.velocity = -0.1;
  c.reference = "rail";
  c.lens = "open";
  c.rail = "bare";
  c.temperature = 273.15 + 21.3;
  c.scene = folder.path() / "data/scene.yaml";
  c.roi = Roi{1, 2, 3, 4};
  c.order = 11;
  Condition plain;
  plain.id = "plain";
  plain.capture = c.capture;
  plain.board_distance = 7.5;
  plain.board_tilt_x = plain.board_tilt_y = 0;
  campaign.conditions = {c, plain};
  const auto file = folder.path() / "out/campaign.yaml";
  write_campaign(campaign, file);
  const Campaign again = read(file);
  EXPECT_EQ(again.name, campaign.name);
  EXPECT_EQ(again.notes, campaign.notes);
  EXPECT_EQ(again.pattern->square, campaign.pattern->square);
  EXPECT_EQ(again.jitter, campaign.jitter);
  ASSERT_EQ(again.conditions.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const Condition &was = campaign.conditions[i], &is = again.conditions[i];
    EXPECT_EQ(is.id, was.id);
    EXPECT_EQ(is.capture, was.capture);
    EXPECT_EQ(is.frames, was.frames);
    expect_same(was.board_distance, is.board_distance);
    expect_same(was.board_tilt_x, is.board_tilt_x);
    expect_same(was.board_tilt_y, is.board_tilt_y);
    EXPECT_EQ(is.board_size, was.board_size);
    EXPECT_EQ(is.target, was.target);
    expect_same(was.reflectivity, is.reflectivity);
    expect_same(was.integration_time, is.integration_time);
    EXPECT_EQ(is.sources, was.sources);
    EXPECT_EQ(is.ambient, was.ambient);
    expect_same(was.time_since_power_on, is.time_since_power_on);
    expect_same(was.roll, is.roll);
    expect_same(was.velocity, is.velocity);
    EXPECT_EQ(is.reference + is.lens + is.rail, was.reference + was.lens + was.rail);
    expect_same(was.temperature, is.temperature);
    EXPECT_EQ(is.scene, was.scene);
    EXPECT_EQ(is.roi.has_value(), was.roi.has_value());
    EXPECT_EQ(is.order, was.order);
  }
  EXPECT_EQ(again.conditions[0].roi->first_row, 3U);
  EXPECT_THAT(tests::read_text(file), testing::HasSubstr("board: {distance: 7.5 m, tilt_x: 0 "));
  EXPECT_THAT(tests::read_text(file), testing::HasSubstr("temperature: 21.3 degC"));
  EXPECT_THAT(tests::read_text(file), testing::HasSubstr("../data/one two.h5"));
}

}  // namespace
}  // namespace tofgraph::io
