// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Campaigns given only as tables, and campaigns that are joined.
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

const std::string table_text = R"(campaign: 1
camera: camcube2
table:
  file: thesis_offset_tables.csv
  distance: {column: true_depth_mm, unit: mm}
  integration_time: {column: integration_time_ms, unit: ms}
  target: {column: black_percent}
  measured_depth: {column: corrected_mean_mm, unit: mm}
  measured_depth_sd: {column: corrected_std_mm, unit: mm}
  roi_half_width: {column: roi_half_width_px}
  roi_half_height: {column: roi_half_height_px}
  corrected_with: optimized_bistatic
)";

TEST(Campaign, ReadsThePublishedTable) {
  const TemporaryFolder folder;
  std::filesystem::copy(TOFGRAPH_SOURCE_DIR "/tests/fixtures/thesis_offset_tables.csv", folder.path());
  write_text(folder.path() / "t.yaml", table_text);
  const Campaign campaign = read(folder.path() / "t.yaml");
  EXPECT_TRUE(campaign.from_table);
  EXPECT_EQ(campaign.corrected_with, "optimized_bistatic");
  ASSERT_EQ(campaign.conditions.size(), 84U);  // 6 grey levels x 14 depths
  const Condition& row = campaign.conditions.at(1);
  EXPECT_EQ(row.id, "line 3");
  EXPECT_EQ(row.board_distance, 1.0);
  EXPECT_EQ(row.integration_time, 2e-3);
  EXPECT_EQ(row.target, "0");
  EXPECT_DOUBLE_EQ(row.measured.depth, 0.99802);
  EXPECT_DOUBLE_EQ(row.measured.depth_sd, 3.63e-3);
  EXPECT_TRUE(std::isnan(row.measured.amplitude));
  EXPECT_EQ(row.roi->first_column, 0U);  // the window of equations.md, section 3: columns 102-hw .. 102+hw-1
  EXPECT_EQ(row.roi->last_column, 203U);
  EXPECT_EQ(row.roi->first_row, 50U);
  EXPECT_EQ(row.roi->last_row, 153U);
  EXPECT_THROW(write_campaign(campaign, folder.path() / "again.yaml"), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "again.yaml"));
}

TEST(Campaign, MistakesInATableHaveItsLineAndColumn) {
  const TemporaryFolder folder;
  write_text(folder.path() / "t.yaml", table_text);
  const std::string names =
      "black_percent,true_depth_mm,integration_time_ms,corrected_mean_mm,corrected_std_mm,roi_half_width_px,roi_half_"
      "height_px\r\n";
  write_text(folder.path() / "thesis_offset_tables.csv", names +
                                                             "0,five,0.5,507.66,3.84,102,102\r\n"
                                                             "0,1000,2.0,998.02,3.63,102,5200\r\n\r\n"
                                                             "0,1000,2.0,998.02,3.63,102\n"
                                                             "0, -1000,0,,-3.63,1.5,52\n");
  const std::string said = mistakes(folder.path() / "t.yaml");
  for (const char* line :
       {"csv:2:3: error: the distance 'five' is not a number", "csv:3:28: error: the roi_half_height",
        "csv:5:1: error: the row has 6 cells, but the first line has 7",
        "csv:6:4: error: the distance '-1000' is -1 m: the board would be behind the lens",
        "csv:6:10: error: the integration_time '0' must be positive",
        "csv:6:13: error: the measured_depth_sd '-3.63' must not be negative",
        "csv:6:19: error: the roi_half_width '1.5' must be a whole number of pixels from 1 to 102"})
    EXPECT_THAT(said, testing::HasSubstr(line));
  write_text(folder.path() / "thesis_offset_tables.csv", "");
  EXPECT_THAT(mistakes(folder.path() / "t.yaml"), testing::HasSubstr("t.yaml:4:9: error: "));
  write_text(folder.path() / "thesis_offset_tables.csv", names);
  EXPECT_THAT(mistakes(folder.path() / "t.yaml"), testing::HasSubstr("the table has no rows"));
}

/// Tables 5.1 to 5.3 and 3.1 of the reference have this form; here each has one wrong cell.
TEST(Campaign, ATableHasSourcesTimesFramesAndValuesOfAllRows) {
  const TemporaryFolder folder;
  const std::string text = R"(campaign: 1
camera: camcube2
table:
  file: t.csv
  distance: 500 mm
  integration_time: 0.5 ms
  sources: {column: lamps}
  time_since_power_on: {column: minutes, unit: min}
  frames: {column: frames}
  measured_depth_sd: {column: sd, unit: mm}
  reach: 20 mm
)";
  write_text(folder.path() / "t.yaml", text);
  write_text(folder.path() / "t.csv",
             "lamps,minutes,frames,sd\nleft,1,500,6.93\nboth,60,,2.77\nright left,,20,6\n,,,1\n");
  const Campaign campaign = read(folder.path() / "t.yaml");
  ASSERT_EQ(campaign.conditions.size(), 4U);
  const Condition& left = campaign.conditions[0];
  EXPECT_THAT(left.sources, testing::ElementsAre("left"));
  EXPECT_EQ(left.board_distance, 0.5);
  EXPECT_EQ(left.board_tilt_x, 0);
  EXPECT_EQ(left.integration_time, 0.5e-3);
  EXPECT_EQ(left.time_since_power_on, 60);
  EXPECT_EQ(left.measured.frames, 500);
  EXPECT_EQ(left.measured.reach, 20e-3);
  EXPECT_TRUE(std::isnan(left.measured.depth)) << "a deviation alone is evidence";
  EXPECT_TRUE(campaign.conditions[1].sources.empty()) << "both: all";
  EXPECT_TRUE(std::isnan(campaign.conditions[1].measured.frames));
  EXPECT_THAT(campaign.conditions[2].sources, testing::ElementsAre("right", "left"));
  EXPECT_TRUE(campaign.conditions[3].sources.empty());

  write_text(folder.path() / "t.csv", "lamps,minutes,frames,sd\nmiddle,-1,0.5,6\nleft left,1,1,6\n");
  const std::string said = mistakes(folder.path() / "t.yaml");
  for (const char* line : {"csv:2:1: error: 'sources' names 'middle', which the camera does not have",
                           "csv:2:8: error: the time_since_power_on '-1' must not be negative",
                           "csv:2:11: error: the frames '0.5' must be a whole number from 1 on",
                           "csv:3:1: error: 'sources' names 'left' twice"})
    EXPECT_THAT(said, testing::HasSubstr(line));
  std::string wrong = text;
  wrong.replace(wrong.find("0.5 ms"), 6, "0.5 mm");
  write_text(folder.path() / "t.yaml", wrong);
  EXPECT_THAT(mistakes(folder.path() / "t.yaml"), testing::HasSubstr("t.yaml:6:21: error: 'integration_time' is"));
}

TEST(Campaign, ATableOfAnUnknownCameraIsReadForItsOtherMistakes) {
  const TemporaryFolder folder;
  write_text(folder.path() / "t.csv", "m\n501\n");
  write_text(folder.path() / "c.yaml",
             "campaign: 1\ncamera: camcube0\ntable:\n  file: t.csv\n  distance: 500 mm\n"
             "  measured_depth: {column: m, unit: mm}\n  roi_half_width: 4\n  frames: -3\n");
  const std::string text = mistakes(folder.path() / "c.yaml");
  EXPECT_THAT(text, testing::HasSubstr("camcube0"));
  EXPECT_THAT(text, testing::HasSubstr("c.yaml:8:11: error:"));
}

TEST(Campaign, SeveralAreJoined) {
  const TemporaryFolder folder;
  const auto table = [&](const std::string& name, const std::string& more) {
    write_text(folder.path() / (name + ".yaml"), "campaign: 1\ncamera: camcube2\nnote: of " + name +
                                                     "\ntable:\n  file: t.csv\n  distance: {column: z, unit: mm}\n"
                                                     "  measured_depth: {column: z, unit: mm}\n" +
                                                     more);
  };
  const auto all = folder.path() / "all.yaml";
  const auto join = [&](const std::string& members) {
    write_text(all, "campaign: 1\ncamera: camcube2\nnote: together\ncampaigns: " + members + "\n");
  };
  write_text(folder.path() / "t.csv", "z\n500\n1000\n");
  table("a", "");
  table("b", "  frames: 20\n");
  join("[a.yaml, b.yaml]");
  const Campaign campaign = read(all);
  ASSERT_EQ(campaign.conditions.size(), 4U);
  EXPECT_TRUE(campaign.from_table);
  EXPECT_EQ(campaign.conditions[1].id, "a line 3");
  EXPECT_EQ(campaign.conditions[2].id, "b line 2");
  EXPECT_EQ(campaign.conditions[2].session, "b") << "set up anew";
  EXPECT_EQ(campaign.conditions[2].campaign, folder.path() / "b.yaml");
  EXPECT_EQ(campaign.conditions[2].measured.frames, 20);
  EXPECT_THAT(campaign.notes, testing::ElementsAre("together", "a: of a", "b: of b"));

  const auto said = [&](const std::string& members) {
    join(members);
    return mistakes(all);
  };
  EXPECT_THAT(said("[]"), testing::HasSubstr("all.yaml:4:12: error: 'campaigns' is an empty list"));
  EXPECT_THAT(said("[a.yaml, a.yaml]"),
              testing::HasSubstr("all.yaml:4:21: error: two conditions have the id 'a line 2'"));
  EXPECT_THAT(said("[all.yaml]"), testing::HasSubstr("all.yaml:4:13: error: 'all.yaml' joins campaigns itself"));
  EXPECT_THAT(said("[gone.yaml]"), testing::HasSubstr("gone.yaml"));
  EXPECT_THAT(said("[a.yaml]\ntable: {file: t.csv}"), testing::HasSubstr("either 'campaigns' or data of its own"));
  write_text(folder.path() / "c.yaml",
             "campaign: 1\ncamera: camcube3\ntable: {file: t.csv, distance: {column: z, unit: "
             "mm}, measured_depth: {column: z, unit: mm}}\n");
  EXPECT_THAT(said("[a.yaml, c.yaml]"),
              testing::HasSubstr("all.yaml:4:21: error: the campaign c.yaml was made with the camera 'camcube3'"));
  write_text(folder.path() / "d.h5", "");
  write_text(folder.path() / "d.yaml",
             "campaign: 1\ncamera: camcube2\nconditions: [{capture: d.h5, board: {distance: 1 m}}]\n");
  EXPECT_THAT(said("[a.yaml, d.yaml]"), testing::HasSubstr("has captures where the others have tables"));
}

}  // namespace
}  // namespace tofgraph::io
