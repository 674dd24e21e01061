// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Invalid input of reduce, merge and diagnose with statistics: one clear error each.
// Slow: ReduceMistakes.*Searches*:ReduceMistakes.*HaveChanged:ReduceMistakes.*HasChanged:ReduceMistakes.Merge*
// Rooms: reduction diagnosis simulation
#include "tests/reduced_campaign.hpp"

#include <array>

using namespace tofgraph::tests;
using testing::HasSubstr;
namespace fs = std::filesystem;

namespace {

using ReduceMistakes = ReducedCampaign;

TEST_F(ReduceMistakes, RefusesAReadOnlyFolder) {
  const SmallDisk disk("1m");
  if (!disk.available() || !disk.make_read_only()) GTEST_SKIP() << "no rights to mount a small disk";
  const Outcome outcome = run("$TOFGRAPH reduce c/campaign.yaml -o " + (disk.path() / "s").string());
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--out: error:"));
}

TEST_F(ReduceMistakes, NamesMissingShards) {
  done("$TOFGRAPH reduce c/campaign.yaml --quiet -o missing --shard 2/4");
  const Outcome merge = run("$TOFGRAPH merge missing");
  EXPECT_EQ(merge.exit_code, 2);
  EXPECT_THAT(merge.err, HasSubstr("3 of 12 conditions have statistics; missing shards: 1/4, 3/4, 4/4"));
  const Outcome search = run("$TOFGRAPH diagnose --model ideal.yaml --data missing -o none");
  EXPECT_EQ(search.exit_code, 2);
  EXPECT_THAT(search.err, HasSubstr("lacks the shards 1/4, 3/4, 4/4"));
}

TEST_F(ReduceMistakes, RefusesCapturesThatHaveChanged) {
  copy("c", "changed");
  done("$TOFGRAPH reduce changed/campaign.yaml --quiet -o changed_s --shard 1/2");
  done("$TOFGRAPH reduce changed/campaign.yaml --quiet -o changed_s --shard 2/2");
  const std::string name = listing(home() / "changed/captures").front();
  done("touch changed/captures/" + name);  // a new time stamp with the same content is no change
  done("$TOFGRAPH merge --quiet changed_s");
  damage(home() / "changed/captures" / name, 300000);
  const Outcome merge = run("$TOFGRAPH merge changed_s");
  EXPECT_EQ(merge.exit_code, 2);
  EXPECT_THAT(merge.err, HasSubstr(name + " has changed since shard 1/2 was reduced"));
}

TEST_F(ReduceMistakes, RefusesACampaignThatHasChanged) {
  copy("c", "edited");
  done("$TOFGRAPH reduce edited/campaign.yaml --quiet -o edited_s --shard 1/1");
  done("$TOFGRAPH reduce edited/campaign.yaml --quiet -o edited_2 --shard 1/2");
  done("sed -i 's/600 mm/601 mm/' edited/campaign.yaml");
  EXPECT_THAT(run("$TOFGRAPH merge edited_2").err, HasSubstr("has changed since shard 1/2 was reduced"));
  // Board poses are not stored in the statistics: none is recomputed.
  EXPECT_THAT(done("$TOFGRAPH reduce edited/campaign.yaml -o edited_s").err,
              HasSubstr("0 reduced, 12 existed already"));
}

TEST_F(ReduceMistakes, SearchesNoCampaignOfBefore) {
  for (const std::string shard : {" --shard 1/2", ""}) {
    copy("c", "stale");
    fs::remove_all(home() / "stale_s");
    done("$TOFGRAPH reduce stale/campaign.yaml --quiet -o stale_s");
    done("sed -i 's/600 mm/601 mm/' stale/campaign.yaml");
    const fs::path file = first_file("stale_s");
    if (shard.empty()) fs::remove(file), fs::create_directory(file);  // so that one condition fails
    EXPECT_EQ(run("$TOFGRAPH reduce stale/campaign.yaml -o stale_s" + shard).exit_code, shard.empty() ? 1 : 0);
    const Outcome search = run("$TOFGRAPH diagnose --model ideal.yaml --data stale_s -o none");
    EXPECT_EQ(search.exit_code, 2);
    EXPECT_THAT(search.err, HasSubstr("then: tofgraph merge stale_s"));
  }
}

TEST_F(ReduceMistakes, RefusesRecordsWithImpossibleNumbers) {
  for (const auto& [from, to, message] :
       {std::array<std::string, 3>{"\"shard\": 1", "\"shard\": 0", "the shard 0 of 1"},
        {"\"shards\": 1", "\"shards\": 9000000000", "the shard 1 of 9000000000"},
        {"\"shards\": 1", "\"shards\": -1", "the shard 1 of -1"},
        {"\"index\": 11", "\"index\": 12", "has condition 12 of 12"},
        {"\"index\": 11", "\"index\": -1", "of 12"},
        {"\"conditions\": 12", "\"conditions\": 13", "12 of 13 conditions"}}) {
    copy("s", "numbers");
    const fs::path file = home() / "numbers/shards/1-of-1.json";
    std::string text = read_text(file);
    ASSERT_NE(text.find(from), std::string::npos) << from;
    write_text(file, text.replace(text.find(from), from.size(), to));
    const Outcome outcome = run("$TOFGRAPH merge numbers");
    EXPECT_EQ(outcome.exit_code, 2) << to;
    EXPECT_THAT(outcome.err, HasSubstr(message)) << to;
  }
}

TEST_F(ReduceMistakes, RefusesOtherSettings) {
  copy("s", "settings");
  const std::string profile = std::string(TOFGRAPH_SOURCE_DIR) + "/devices/profiles/camcube2.yaml";
  done("sed 's/full_well: .*/full_well: 20000 counts/' " + profile + " > settings/camera.yaml");
  done("sed -i 's/^camera: .*/camera: .\\/camera.yaml/' settings/campaign.yaml");
  const Outcome outcome = run("$TOFGRAPH diagnose --model ideal.yaml --data settings -o none");
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("was made with other settings: now 'full_well 20000', then 'full_well 30000'"));
}

TEST_F(ReduceMistakes, RefusesAnotherCamera) {
  copy("s", "camera");
  done("sed -i 's/^camera: .*/camera: o3d303/' camera/campaign.yaml");
  const Outcome outcome = run("$TOFGRAPH diagnose --model ideal.yaml --data camera -o none");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("'o3d303'"));
}

TEST_F(ReduceMistakes, RefusesAnotherVersion) {
  copy("s", "version");
  const fs::path file = first_file("version");
  std::string bytes = read_text(file);
  bytes.replace(bytes.find("statistics 2"), 12, "statistics 1");
  write_text(file, bytes);
  const Outcome outcome = run("$TOFGRAPH diagnose --model ideal.yaml --data version -o none");
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("is of version 1 of the statistics, this program reads version 2"));
  EXPECT_THAT(run("$TOFGRAPH merge version").err, HasSubstr("reduce the captures again"));
  EXPECT_THAT(done("$TOFGRAPH reduce c/campaign.yaml -o version").err, HasSubstr("1 damaged and made again"));
  EXPECT_EQ(read_text(file), read_text(first_file("s")));
}

TEST_F(ReduceMistakes, RefusesWrongShards) {
  for (const std::string shard : {"0/2", "3/2", "1", "a/b", "1/2/3", "-1/2"}) {
    const Outcome outcome = run("$TOFGRAPH reduce c/campaign.yaml -o none --shard=" + shard);
    EXPECT_EQ(outcome.exit_code, 2) << shard;
    EXPECT_THAT(outcome.err, HasSubstr("expected I/N")) << shard;
  }
  EXPECT_THAT(run("$TOFGRAPH diagnose --model ideal.yaml --data s -o none --shard 1/2").err,
              HasSubstr("it divides the cases of --confidence"));
  const Outcome limit =
      run("$TOFGRAPH diagnose --model ideal.yaml --data s -o none --confidence 2 --shard 1/2 --time-limit '5 min'");
  EXPECT_EQ(limit.exit_code, 2);
  EXPECT_THAT(limit.err, HasSubstr("--time-limit: error:"));
}

TEST_F(ReduceMistakes, NeverReplacesTheCampaignThatItReads) {
  EXPECT_EQ(run("$TOFGRAPH reduce c/campaign.yaml -o c").exit_code, 2);
  EXPECT_THAT(read_text(home() / "c/campaign.yaml"), HasSubstr(".h5"));
}

TEST_F(ReduceMistakes, MergeNeverReplacesACampaignOfCaptures) {
  copy("c", "mine");
  for (const std::string folder : {"c", "mine"}) {
    const Outcome outcome = run("$TOFGRAPH merge s -o " + folder);
    EXPECT_EQ(outcome.exit_code, 2) << folder;
    EXPECT_THAT(outcome.err, HasSubstr("--out: error:"));
    EXPECT_THAT(read_text(home() / folder / "campaign.yaml"), HasSubstr(".h5"));
  }
  done("$TOFGRAPH merge --quiet s -o merged");
  done("$TOFGRAPH merge --quiet s -o merged");
}

TEST_F(ReduceMistakes, OtherCommandsSayThatTheyNeedCaptures) {
  EXPECT_THAT(run("$TOFGRAPH calibrate noise s/campaign.yaml -o none.yaml").err,
              HasSubstr("holds statistics of a capture, which only diagnose and calibrations of boards read"));
}

}  // namespace
