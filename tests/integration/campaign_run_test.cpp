// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: CampaignRun.EveryCondition*:CampaignRun.ResultsAreNot*
// Rooms: cli calibration simulation plugins
// A pipeline run over a campaign; its depths are compared with the known planes.
#include <gmock/gmock.h>
#include <hdf5.h>
#include <nlohmann/json.hpp>

#include "tests/small_boards.hpp"

#include <fstream>

using namespace tofgraph::tests;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

namespace {

constexpr double constant = 12e-3, noise = 3e-3;

class CampaignRun : public testing::Test {
 protected:
  void SetUp() override {
    write_text(path("small.yaml"), small_profile);
    write_text(path("constant.yaml"), "model: 1\ncamera: small\neffects: [{effect: zero_offset, offset: 12 mm}]\n");
    record("near", 1.0);
    record("far", 2.0);
    write_text(path("campaign.yaml"),
               "campaign: 1\nname: two boards\ncamera: ./small.yaml\nconditions:\n"
               "  - {id: near, capture: near.h5, frames: [0, 29], board: {distance: 1 m}}\n"
               "  - {id: far, capture: far.h5, board: {distance: 2 m}}\n");
    write_text(path("p.yaml"),
               "pipeline: 1\nnodes:\n  - {stage: capture_reader, file: near.h5}\n"
               "  - {stage: model_correction, model: constant.yaml}\n  - {stage: optimized_bistatic}\n"
               "  - {stage: point_cloud}\n  - {stage: pcd_writer, path: \"clouds/c_{frame:02}.pcd\"}\n");
  }
  void record(const std::string& name, double distance) {
    record_small(path(name + ".h5"),
                 {.distance = distance, .frames = 40, .serial = "S1", .noise = noise, .error = [](std::size_t) {
                    return constant;
                  }});
  }
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  Outcome tofgraph(const std::string& arguments) const {
    return shell("XDG_CACHE_HOME=\"$PWD/cache\" $TOFGRAPH " + arguments, folder_.path());
  }
  json evaluation(const std::string& folder) const {
    std::ifstream in(path(folder) / "evaluation.json");
    return json::parse(in);
  }
  std::size_t cached_tables() const {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path("cache") / "tofgraph" / "corrections"))
      count += entry.is_regular_file() ? 1 : 0;
    return count;
  }

  TemporaryFolder folder_;
};

TEST_F(CampaignRun, EveryConditionHasItsResultsAndIsEvaluatedAgainstItsPlane) {
  const Outcome run = tofgraph("run p.yaml --campaign campaign.yaml -o out");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("2 of 2 conditions, 70 frames"));
  EXPECT_TRUE(std::filesystem::exists(path("out/near/clouds/c_29.pcd")));
  EXPECT_FALSE(std::filesystem::exists(path("out/near/clouds/c_30.pcd"))) << "frames: [0, 29]";
  EXPECT_TRUE(std::filesystem::exists(path("out/far/clouds/c_39.pcd")));
  EXPECT_FALSE(std::filesystem::exists(path("clouds"))) << "nothing is written outside the folder";
  EXPECT_EQ(cached_tables(), 1U) << "compiled once for both conditions";
  EXPECT_EQ(tofgraph("check out/campaign.yaml").exit_code, 0);
  EXPECT_THAT(tofgraph("info out/near/result.h5").out, HasSubstr("serial: S1"));

  const Outcome outcome = tofgraph("evaluate out/campaign.yaml -o accuracy");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("bias, mm"));
  EXPECT_TRUE(std::filesystem::exists(path("accuracy/evaluation.html")));
  const json result = evaluation("accuracy");
  ASSERT_EQ(result["conditions"].size(), 2U);
  // The standard error of a pixel's mean over 30 frames is 0.55 mm, that of 192 pixels 0.04 mm.
  for (const json& condition : result["conditions"]) {
    EXPECT_EQ(condition["channel"], "depth");
    EXPECT_NEAR(condition["bias"], 0, 0.2e-3) << condition["id"];
    EXPECT_NEAR(condition["noise"].get<double>(), noise, 0.1 * noise) << condition["id"];
    EXPECT_LT(condition["flatness"], 0.3e-3) << condition["id"];
  }
  // The half path is 12 mm too long; the depth error is that times the cosine of the ray, which is 0.96 at the corner.
  const json& before = result["before"]["all"];
  EXPECT_GT(before["bias"], 0.96 * constant);
  EXPECT_LT(before["bias"], 1.01 * constant);
  EXPECT_EQ(result["by_distance"].size(), 2U);
  EXPECT_EQ(result["by_radius"].size(), 5U);
  EXPECT_EQ(result["serial"], "S1");
}

TEST_F(CampaignRun, ResultsAreNotReplacedUnlessForced) {
  ASSERT_EQ(tofgraph("run p.yaml --campaign campaign.yaml -o out --frames 2").exit_code, 0);
  const Outcome again = tofgraph("run p.yaml --campaign campaign.yaml -o out --frames 2");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("campaign.yaml"));
  EXPECT_EQ(tofgraph("run p.yaml --campaign campaign.yaml -o out --frames 2 --force").exit_code, 0);
}

TEST_F(CampaignRun, AConditionThatFailsIsNamedAndTheOthersAreWritten) {
  write_text(path("far.h5"), "no capture");
  const Outcome run = tofgraph("run p.yaml --campaign campaign.yaml -o out");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("error: condition 'far'"));
  EXPECT_THAT(run.err, HasSubstr("1 of 2 conditions"));
  EXPECT_THAT(read_text(path("out/campaign.yaml")), Not(HasSubstr("id: far")));
}

TEST_F(CampaignRun, NeedsAFolderAndAPipelineThatReadsCaptures) {
  const Outcome no_folder = tofgraph("run p.yaml --campaign campaign.yaml");
  EXPECT_EQ(no_folder.exit_code, 2);
  EXPECT_THAT(no_folder.err, HasSubstr("-o results"));
  const Outcome no_reader = tofgraph("run \"simulator ! null\" --campaign campaign.yaml -o out");
  EXPECT_EQ(no_reader.exit_code, 2);
  EXPECT_THAT(no_reader.err, HasSubstr("capture_reader"));
  const Outcome limited = tofgraph("run p.yaml --campaign campaign.yaml -o out --time-limit '5 min'");
  EXPECT_EQ(limited.exit_code, 2);
  EXPECT_THAT(limited.err, HasSubstr("--time-limit: error: is for one run, not for a campaign"));
}

TEST_F(CampaignRun, WarningsAndDroppedFramesOfEveryConditionAreReported) {
  const Outcome masked = tofgraph(
      "run \"capture_reader ! optimized_bistatic ! mask min_amplitude='100000 counts'\" --campaign campaign.yaml "
      "-o masked");
  EXPECT_EQ(masked.exit_code, 0) << masked.err;
  EXPECT_THAT(masked.err, HasSubstr("near: warning: no pixel is valid in 30 frames at 'campaign_result'"));
  EXPECT_THAT(masked.err, HasSubstr("far: warning: no pixel is valid in 40 frames at 'campaign_result'"));
  write_text(path("slow.yaml"),
             "pipeline: 1\nnodes:\n"
             "  - {stage: capture_reader, file: near.h5, queue: {capacity: 1, policy: drop_oldest}}\n"
             "  - {stage: make_depth, pause: 20 ms}\n");
  const Outcome slow = tofgraph("run slow.yaml --campaign campaign.yaml -o slow --threads 1");
  EXPECT_EQ(slow.exit_code, 0) << slow.err;
  EXPECT_THAT(slow.err, HasSubstr("frames dropped"));
}

TEST_F(CampaignRun, TheOneLineFormNeedsNoFile) {
  const Outcome run = tofgraph("run \"capture_reader ! optimized_bistatic\" --campaign campaign.yaml -o out");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  ASSERT_EQ(tofgraph("evaluate out/campaign.yaml -o accuracy --before campaign.yaml").exit_code, 0);
  const json result = evaluation("accuracy");
  EXPECT_NEAR(result["all"]["bias"].get<double>(), result["before"]["all"]["bias"].get<double>(), 1e-5)
      << "geometry alone is what the raw distances are judged by";
}

}  // namespace
