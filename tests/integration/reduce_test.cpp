// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Campaigns in parts: statistics instead of captures, shards in any order, kills, full disks; bit-identical results.
// Slow: Reduce.*SameReport*:Reduce.*SameFiles*:Reduce.*Killed*:Reduce.*Cases*
// Slow: Reduce.*SameCalibrations*:Reduce.*ShardsOf*:Reduce.Simulates*:Reduce.Redoes*
// Rooms: reduction diagnosis simulation
#include "tests/reduced_campaign.hpp"

#include <map>
#include <random>

using namespace tofgraph::tests;
using testing::HasSubstr;
namespace fs = std::filesystem;

namespace {

using Reduce = ReducedCampaign;

TEST_F(Reduce, SameReportFromStatisticsAsFromCaptures) {
  search("c/campaign.yaml", "from_captures");
  search("s", "from_statistics");
  EXPECT_EQ(result_of("from_captures"), result_of("from_statistics"));
}

TEST_F(Reduce, SameReportWithPatternsOfPixels) {
  // A fixed pattern is estimated per pixel, which requires every pixel's sums.
  std::string scene = read_text(home() / "scene.yaml");
  write_text(home() / "map.py",
             "import struct, random\nr = random.Random(5)\nn = 204 * 204\n"
             "h = \"{'descr': '<f4', 'fortran_order': False, 'shape': (204, 204), }\"\n"
             "h = h + ' ' * (117 - len(h)) + '\\n'\n"
             "open('map.npy', 'wb').write(b'\\x93NUMPY\\x01\\x00' + struct.pack('<H', len(h)) + "
             "h.encode() + b''.join(struct.pack('<f', r.gauss(0, 0.02)) for _ in range(n)))\n");
  done("python3 map.py");
  const std::string effect = "{effect: wiggling, amplitude: 6 mm, phase: 0.4 rad}";
  scene.replace(scene.find(effect), effect.size(), "{effect: fixed_pattern, map: {file: map.npy}, scale: 1}");
  write_text(home() / "pattern.yaml", scene);
  done("$TOFGRAPH simulate pattern.yaml -o pc --quiet");
  done("$TOFGRAPH reduce pc/campaign.yaml -o ps --quiet");
  search("pc/campaign.yaml", "pattern_captures");
  search("ps", "pattern_statistics");
  EXPECT_EQ(result_of("pattern_captures"), result_of("pattern_statistics"));
  EXPECT_THAT(result_of("pattern_captures"), HasSubstr("fixed_pattern"));
}

TEST_F(Reduce, SameReportOfConditionsThatShareACapture) {
  // Also with a profile beside the campaign, referenced by the folder of statistics.
  copy("c", "shared");
  done("sed 's/^name: .*/name: camcube2/' " TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml > shared/my.yaml");
  std::string text = "campaign: 1\ncamera: ./my.yaml\nconditions:\n";
  for (const std::string& name : listing(home() / "c/captures"))
    for (const std::string frames : {"[0, 1]", "[2, 2]"})
      text += "  - {id: \"" + name + frames + "\", capture: captures/" + name + ", frames: " + frames +
              ", board: {distance: " + name.substr(5, name.find("mm") - 5) + " mm}, target: white}\n";
  write_text(home() / "shared/campaign.yaml", text);
  EXPECT_THAT(done("$TOFGRAPH reduce shared/campaign.yaml -o shared_s").err, HasSubstr("24 reduced"));
  search("shared/campaign.yaml", "shared_captures");
  search("shared_s", "shared_statistics");
  EXPECT_EQ(result_of("shared_captures"), result_of("shared_statistics"));
  done("sed -i 's/frames: \\[2, 2\\]/frames: [1, 2]/' shared_s/campaign.yaml");
  EXPECT_THAT(run("$TOFGRAPH diagnose --model ideal.yaml --data shared_s -o none").err,
              HasSubstr("now 'frames 1 to 2', then 'frames 2 to 2'"));
}

/// The folder of a device, and the name of a profile that is also that of a file beside the campaign.
TEST_F(Reduce, StatisticsInAnotherFolderHaveTheCameraOfTheCampaign) {
  done("$TOFGRAPH camera new lab --profile camcube2 --folder lab");
  for (const auto& [camera, expected] :
       {std::pair<std::string, std::string>{"../lab", "\"../../lab\""}, {"camcube2", "camcube2"}}) {
    copy("c", "device");
    write_text(home() / "device/camcube2", "");
    done("sed -i 's|^camera: .*|camera: " + camera + "|' device/campaign.yaml");
    done("$TOFGRAPH reduce device/campaign.yaml -o nested/device_s --quiet");
    EXPECT_THAT(read_text(home() / "nested/device_s/campaign.yaml"), HasSubstr("camera: " + expected + "\n"));
    done("$TOFGRAPH check nested/device_s/campaign.yaml");
  }
}

/// Calibrations of boards use the sums of every pixel: bit-identical results, apart from the list of inputs.
TEST_F(Reduce, SameCalibrationsFromStatisticsAsFromCaptures) {
  const auto values = [](const std::string& file) {
    const std::string text = read_text(home() / file);
    EXPECT_THAT(text, HasSubstr("\nvalues:\n"));
    return text.substr(text.find("\nvalues:\n"));
  };
  for (const std::string kind : {"offset", "fixed-pattern", "integration-time"}) {
    done("$TOFGRAPH calibrate " + kind + " c/campaign.yaml --force -o captures_" + kind + ".yaml");
    done("$TOFGRAPH calibrate " + kind + " s/campaign.yaml --force -o statistics_" + kind + ".yaml");
    EXPECT_EQ(values("captures_" + kind + ".yaml"), values("statistics_" + kind + ".yaml"));
  }
  EXPECT_TRUE(read_text(home() / "captures_fixed-pattern.maps.h5") ==
              read_text(home() / "statistics_fixed-pattern.maps.h5"));
  for (const std::string data : {"c", "s"}) done("$TOFGRAPH report " + data + "/campaign.yaml -o report_" + data);
  EXPECT_EQ(read_text(home() / "report_c/report.json"), read_text(home() / "report_s/report.json"));
  EXPECT_THAT(run("$TOFGRAPH calibrate noise s/campaign.yaml -o noise.yaml").err,
              HasSubstr("give the campaign of captures"));
}

TEST_F(Reduce, RunsAgainWithoutRedoingWhatIsThere) {
  copy("s", "again");
  const auto time = fs::last_write_time(first_file("again"));
  EXPECT_THAT(done("$TOFGRAPH reduce c/campaign.yaml -o again").err, HasSubstr("0 reduced, 12 existed already"));
  EXPECT_EQ(fs::last_write_time(first_file("again")), time);
}

TEST_F(Reduce, RedoesDamagedFilesAndReportsThem) {
  for (const std::streamoff at : {3, 30, 700, 200000}) {
    copy("s", "damaged");
    damage(first_file("damaged"), at);
    const Outcome search = run("$TOFGRAPH diagnose --model ideal.yaml --data damaged -o none");
    EXPECT_NE(search.exit_code, 0) << at;
    EXPECT_THAT(search.err, HasSubstr(first_file("damaged").filename())) << at;
    const Outcome outcome = done("$TOFGRAPH reduce c/campaign.yaml -o damaged");
    EXPECT_THAT(outcome.err, HasSubstr("0 reduced, 11 existed already, 1 damaged and made again")) << at;
    EXPECT_THAT(outcome.err, HasSubstr(first_file("damaged").filename())) << at;
    EXPECT_EQ(read_text(first_file("damaged")), read_text(first_file("s")));
  }
}

TEST_F(Reduce, SameFilesForAnyNumberAndOrderOfShards) {
  std::mt19937 generator(7);
  for (const int shards : {2, 3, 16}) {
    const std::string folder = "s" + std::to_string(shards);
    std::vector<int> order;
    for (int i = 1; i <= shards; ++i) order.push_back(i);
    std::ranges::shuffle(order, generator);
    for (const int i : order)
      done("$TOFGRAPH reduce c/campaign.yaml --quiet -o " + folder + " --shard " + std::to_string(i) + "/" +
           std::to_string(shards));
    done("$TOFGRAPH merge --quiet " + folder);
    EXPECT_EQ(read_text(home() / folder / "campaign.yaml"), read_text(home() / "s/campaign.yaml"));
    for (const std::string& name : listing(home() / "s")) {
      if (!name.ends_with(".stats")) continue;
      EXPECT_TRUE(read_text(home() / folder / name) == read_text(home() / "s" / name)) << name;
    }
  }
}

TEST_F(Reduce, ShardsOfSeveralFoldersBecomeOne) {
  for (const std::string i : {"1", "2"})
    done("$TOFGRAPH reduce c/campaign.yaml --quiet -o part" + i + " --shard " + i + "/2");
  done("$TOFGRAPH merge --quiet part1 part2 -o joined");
  std::vector<std::string> joined = listing(home() / "joined"), whole = listing(home() / "s");
  std::erase(whole, "shards");
  EXPECT_EQ(joined, whole);
}

TEST_F(Reduce, SimulatesTheSameBytesInShards) {
  for (const std::string shard : {"3/3", "1/3", "2/3"}) {
    EXPECT_FALSE(fs::exists(home() / "simulated/campaign.yaml"));
    done("$TOFGRAPH simulate scene.yaml -o simulated --quiet --shard " + shard);
  }
  EXPECT_EQ(read_text(home() / "simulated/campaign.yaml"), read_text(home() / "c/campaign.yaml"));
  for (const std::string& name : listing(home() / "c/captures"))
    EXPECT_TRUE(read_text(home() / "simulated/captures" / name) == read_text(home() / "c/captures" / name)) << name;
  done("sed 's/seed: 3/seed: 4/' scene.yaml > other.yaml");
  const Outcome other = run("$TOFGRAPH simulate other.yaml -o simulated --shard 1/3");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("made from another scene, model or seed"));
  EXPECT_EQ(run("$TOFGRAPH simulate scene.yaml -o simulated --shard 1/1").exit_code, 2);
}

TEST_F(Reduce, ShardsOfAnotherSceneReplaceNoSceneFile) {
  std::string scene = read_text(home() / "scene.yaml");
  scene.replace(scene.find("sequence:"), 0, "  - {name: wall, type: board, distance: 3 m, reflectivity: 0.5}\n");
  write_text(home() / "walled.yaml", scene);
  done("$TOFGRAPH simulate walled.yaml -o walled --quiet --shard 2/2");
  const fs::path file = home() / "walled/scenes" / listing(home() / "walled/scenes").at(0);
  const std::string before = read_text(file);
  done("sed -i 's/distance: 3 m/distance: 4 m/' walled.yaml");
  EXPECT_EQ(run("$TOFGRAPH simulate walled.yaml -o walled --shard 1/2").exit_code, 1);
  EXPECT_EQ(read_text(file), before);
}

TEST_F(Reduce, CasesOfShardsGiveTheSameReport) {
  search("s", "cases_whole", "--confidence 3");
  for (const std::string shard : {"2/2", "1/2"}) search("s", "cases_shards", "--confidence 3 --shard " + shard);
  EXPECT_EQ(listing(home() / "cases_shards/cases").size(), 3U);
  search("s", "cases_shards", "--confidence 3");
  EXPECT_EQ(result_of("cases_whole"), result_of("cases_shards"));
  EXPECT_THAT(result_of("cases_whole"), HasSubstr("\"cases\": 3"));
}

TEST_F(Reduce, KilledTasksLoseNothing) {
  // Random kills and restarts of `reduce`: no complete file is computed twice, none is lost.
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> when(0.01, 0.35);
  std::map<std::string, fs::file_time_type> whole;
  std::size_t kills = 0;
  for (int k = 0; k < 100; ++k) {
    const Outcome outcome = run("timeout -s KILL " + std::to_string(when(generator)) +
                                " $TOFGRAPH reduce c/campaign.yaml -o killed --quiet --threads 1");
    kills += outcome.exit_code == 137 ? 1U : 0U;
    if (!fs::exists(home() / "killed")) continue;
    for (const std::string& name : listing(home() / "killed")) {
      if (!name.ends_with(".stats")) continue;
      const fs::path file = home() / "killed" / name;
      EXPECT_TRUE(read_text(file) == read_text(home() / "s" / name)) << name;
      const auto [at, added] = whole.try_emplace(name, fs::last_write_time(file));
      EXPECT_EQ(at->second, fs::last_write_time(file)) << name << " was made again";
    }
    if (outcome.exit_code == 0) fs::remove_all(home() / "killed"), whole.clear();
  }
  EXPECT_GE(kills, 10U);
  done("$TOFGRAPH reduce c/campaign.yaml -o killed --quiet");
  EXPECT_EQ(read_text(home() / "killed/campaign.yaml"), read_text(home() / "s/campaign.yaml"));
  RecordProperty("kills", static_cast<int>(kills));
}

TEST_F(Reduce, FullDiskKeepsWhatIsWhole) {
  const SmallDisk disk("3m");
  if (!disk.available()) GTEST_SKIP() << "no rights to mount a small disk";
  const std::string reduce = "$TOFGRAPH reduce c/campaign.yaml -o " + (disk.path() / "s").string();
  const Outcome full = run(reduce);
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_THAT(full.err, HasSubstr("No space left on device"));
  std::size_t kept = 0;
  for (const std::string& name : listing(disk.path() / "s")) {
    EXPECT_TRUE(name.ends_with(".stats")) << name;
    EXPECT_TRUE(read_text(disk.path() / "s" / name) == read_text(home() / "s" / name));
    ++kept;
  }
  EXPECT_GE(kept, 1U);
  EXPECT_THAT(run(reduce).err, HasSubstr(std::to_string(kept) + " existed already"));
}

}  // namespace
