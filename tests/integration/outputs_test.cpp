// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Host handling of every sink's files, including third-party sinks; and streams that contain one channel twice.
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace tofgraph::tests {
namespace {

std::vector<std::string> listing(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.push_back(entry.path().filename());
  std::ranges::sort(names);
  return names;
}

TEST(Outputs, OfAThirdPartyAppearWholeAndNumbered) {
  const TemporaryFolder folder;
  const Outcome run =
      shell("\"$TOFGRAPH\" run 'ramp frames=3 ! notes path=b_{frame}.csv total=sum.txt'", folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(listing(folder.path()),
            (std::vector<std::string>{"b.notes.txt", "b_0.csv", "b_1.csv", "b_2.csv", "sum.txt"}));
  EXPECT_EQ(read_text(folder.path() / "b_2.csv"), "2\n");
  EXPECT_EQ(read_text(folder.path() / "sum.txt"), "3\n");
}

TEST(Outputs, ANameForOneFrameIsNumberedWhereMoreMayCome) {
  const TemporaryFolder folder;
  const Outcome run = shell("\"$TOFGRAPH\" run 'ramp frames=2 ! notes path=b.csv'", folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("path names one file, but there may be more than one frame"), std::string::npos) << run.err;
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "b_000001.csv"));
}

TEST(Outputs, AreRefusedByCheckAndRunAlikeWhereTheyExist) {
  const TemporaryFolder folder;
  write_text(folder.path() / "b.notes.txt", "mine");
  const std::string line = "'ramp frames=2 ! notes path=b_{frame}.csv'";
  for (const std::string command : {"check ", "run "}) {
    const Outcome refused = shell("\"$TOFGRAPH\" " + command + line, folder.path());
    EXPECT_EQ(refused.exit_code, 2) << command;
    EXPECT_NE(refused.err.find("exists: --force or overwrite: true allows it to be replaced"), std::string::npos)
        << refused.err;
  }
  EXPECT_EQ(shell("\"$TOFGRAPH\" check --force " + line, folder.path()).exit_code, 0);
  EXPECT_EQ(
      shell("\"$TOFGRAPH\" run 'ramp frames=2 ! notes path=b_{frame}.csv overwrite=true'", folder.path()).exit_code, 0);
  EXPECT_EQ(read_text(folder.path() / "b.notes.txt"), "first\n");
}

TEST(Outputs, OfAFrameThatFailedAreNotThereAndToldByTheirName) {
  const TemporaryFolder folder;
  const Outcome run = shell("\"$TOFGRAPH\" run 'ramp frames=3 ! notes path=b_{frame}.csv fail_at=1'", folder.path());
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find((folder.path() / "b_1.csv").string() + " gave up"), std::string::npos) << run.err;
  EXPECT_EQ(listing(folder.path()), (std::vector<std::string>{"b.notes.txt", "b_0.csv"}));
}

TEST(Outputs, OneFileForTheRunHasNoNumber) {
  const TemporaryFolder folder;
  const Outcome run = shell("\"$TOFGRAPH\" run 'ramp ! notes total=sum_{frame}.txt'", folder.path());
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("parameter 'total': is one file for the whole run"), std::string::npos) << run.err;
}

constexpr const char* two_distances =
    "pipeline: 1\n"
    "nodes:\n"
    "  - {name: grab, stage: ramp, frames: 4}\n"
    "  - {name: twice, stage: scale, inputs: [grab], channel: distance, factor: 2}\n"
    "  - {name: less, stage: difference, inputs: {minuend: twice, subtrahend: grab}}\n"
    "  - {name: save, stage: collect, path: a.txt}\n";

TEST(NamedPorts, TakeTheSameChannelFromTwoStreams) {
  const TemporaryFolder folder;
  write_text(folder.path() / "a.yaml", two_distances);
  const Outcome run = shell("\"$TOFGRAPH\" run a.yaml", folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(read_text(folder.path() / "a.txt"), "0 less=0\n1 less=1\n2 less=2\n3 less=3\n");
}

TEST(NamedPorts, TheOtherWayRoundGivesTheOppositeSign) {
  const TemporaryFolder folder;
  std::string text = two_distances;
  text.replace(text.find("minuend: twice, subtrahend: grab"), 32, "minuend: grab, subtrahend: twice");
  write_text(folder.path() / "a.yaml", text);
  EXPECT_EQ(shell("\"$TOFGRAPH\" run a.yaml", folder.path()).exit_code, 0);
  EXPECT_EQ(read_text(folder.path() / "a.txt"), "0 less=0\n1 less=-1\n2 less=-2\n3 less=-3\n");
}

TEST(NamedPorts, ARenamedChannelPassesAJoin) {
  const TemporaryFolder folder;
  write_text(folder.path() / "a.yaml",
             "pipeline: 1\n"
             "nodes:\n"
             "  - {name: grab, stage: ramp, frames: 2}\n"
             "  - {name: other, stage: scale, inputs: [grab], channel: distance, factor: 2}\n"
             "  - {name: renamed, stage: channels, rename: [distance=distance_other]}\n"
             "  - {name: both, stage: make_depth, inputs: [grab, renamed]}\n"
             "  - {name: save, stage: collect, path: a.txt}\n");
  const Outcome run = shell("\"$TOFGRAPH\" run a.yaml", folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(read_text(folder.path() / "a.txt"), "0 both=0\n1 both=1\n");
}

TEST(Provenance, HasTheLibraryOfEachStageWithItsHash) {
  const TemporaryFolder folder;
  const Outcome run = shell(
      "\"$TOFGRAPH\" run \"simulator distance='1 m' ! four_phase_decoder ! optimized_bistatic ! point_cloud ! "
      "pcd_writer "
      "path=a.pcd\" --camera camcube2",
      folder.path());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto provenance = nlohmann::json::parse(read_text(folder.path() / "a.provenance.json"));
  for (const auto& stage : provenance.at("stages")) {
    const std::string path = stage.at("library").at("path");
    const Outcome sum = shell("sha256sum '" + path + "'", folder.path());
    EXPECT_EQ(stage.at("library").at("sha256"), sum.out.substr(0, 64)) << path;
  }
}

}  // namespace
}  // namespace tofgraph::tests
