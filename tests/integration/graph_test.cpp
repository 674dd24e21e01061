// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Graph.AnInterrupt*:Statistics.DoNot*
// Rooms: graph
// Semantics of a graph: order, fan-out, joins, drops, errors, interrupts; with small stages whose results are known.
#include "tests/program.hpp"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <sstream>

namespace tofgraph::tests {
namespace {

Outcome run(const std::string& arguments, const TemporaryFolder& folder) {
  return shell("\"$TOFGRAPH\" run " + arguments, folder.path());
}

TEST(Graph, FramesArriveInOrderWithSeveralInFlight) {
  const TemporaryFolder folder;
  const Outcome outcome =
      run("'ramp frames=500 ! scale factor=2 ! make_depth offset=\"500 mm\" ! collect path=a.txt' --threads 4", folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(read_text(folder.path() / "a.txt"));
  for (int i = 0; i < 500; ++i) {
    std::string line;
    std::getline(lines, line);
    std::ostringstream expected;
    expected << i << " make_depth=" << 2.0 * i + 0.5;
    ASSERT_EQ(line, expected.str());
  }
}

TEST(Graph, FanOutSharesTheFrameAndEverySinkRuns) {
  const TemporaryFolder folder;
  write_text(folder.path() / "p.yaml",
             "pipeline: 1\nnodes:\n"
             "  - {name: grab, stage: ramp, frames: 50}\n"
             "  - {name: twice, stage: scale, factor: 2, inputs: [grab]}\n"
             "  - {name: half, stage: scale, factor: 0.5, inputs: [grab]}\n"
             "  - {name: both, stage: collect, path: both.txt, inputs: [grab, twice, half]}\n"
             "  - {name: one, stage: collect, path: one.txt, inputs: [twice]}\n");
  const Outcome outcome = run("p.yaml --stats s.json", folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string both = read_text(folder.path() / "both.txt");
  EXPECT_EQ(both.substr(both.find("7 "), both.find("8 grab") - both.find("7 ")), "7 grab=7 twice=14 half=3.5\n");
  EXPECT_NE(read_text(folder.path() / "one.txt").find("49 twice=98\n"), std::string::npos);
  const auto statistics = nlohmann::json::parse(read_text(folder.path() / "s.json"));
  EXPECT_EQ(statistics["format"], "tofgraph-stats");
  EXPECT_EQ(statistics["frames"], 50);
  for (const auto& node : statistics["nodes"]) EXPECT_EQ(node["frames"], 50) << node;  // a node runs once per frame
}

TEST(Graph, BranchesJoinByFrameNumber) {
  const TemporaryFolder folder;
  write_text(
      folder.path() / "p.yaml",
      "pipeline: 1\nnodes:\n"
      "  - {name: grab, stage: ramp, frames: 200}\n"
      "  - {name: slow, stage: make_depth, offset: 250 mm, pause: 1 ms, inputs: [grab]}\n"
      "  - {name: joined, stage: scale, channel: depth, factor: 2, inputs: {depth: slow, depth|distance: grab}}\n"
      "  - {stage: collect, path: a.txt}\n");
  Outcome outcome = run("p.yaml", folder);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("p.yaml:5:99: error: the stage scale has no input 'depth|distance'\n"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("inputs: depth\n"), std::string::npos) << "what it has instead: " << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.txt"));
  write_text(folder.path() / "p.yaml",
             "pipeline: 1\nnodes:\n"
             "  - {name: grab, stage: ramp, frames: 200}\n"
             "  - {name: slow, stage: make_depth, offset: 250 mm, pause: 1 ms, inputs: [grab]}\n"
             "  - {name: joined, stage: scale, channel: depth, factor: 2, inputs: [grab, slow]}\n"
             "  - {stage: collect, path: a.txt}\n");
  outcome = run("p.yaml --threads 3", folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(read_text(folder.path() / "a.txt").find("123 joined=246.5\n"), std::string::npos);
}

TEST(Graph, WhatAStageReadsStaysUntilItReturns) {
  const TemporaryFolder folder;
  // crop requests its output buffer while it still reads the memory lent by the source.
  const Outcome outcome = run("'lend frames=3 ! crop columns=[10, 19] rows=[5, 9] ! collect path=a.txt'", folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(read_text(folder.path() / "a.txt"), "0 crop=1\n1 crop=2\n2 crop=3\n");
}

/// Counts the pool's buffers only; other allocations of a graph: steady_state_test.
TEST(Graph, BuffersAreUsedAgainHoweverManyFramesThereAre) {
  const TemporaryFolder folder;
  for (const int threads : {1, 4}) {
    for (const int frames : {1, 200, 2000}) {
      const Outcome outcome =
          run("'ramp width=300 height=300 frames=" + std::to_string(frames) +
                  " ! scale ! make_depth ! null' --force --stats s.json --threads " + std::to_string(threads),
              folder);
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
      const int allocated = nlohmann::json::parse(read_text(folder.path() / "s.json"))["buffers_allocated"].get<int>();
      // A distance and a depth for each frame in progress (2 per thread), queued (4) or being created (1), and no more
      // for any number of frames.
      EXPECT_GE(allocated, 2) << frames << " frames";
      EXPECT_LE(allocated, 2 * std::min(frames, 2 * threads + 4 + 1)) << frames << " frames";
    }
  }
}

TEST(Graph, AnErrorDrainsTheGraphAndNamesNodeAndFrame) {
  const TemporaryFolder folder;
  const Outcome outcome = run("'ramp frames=1000 ! make_depth fail_at=20 ! collect path=a.txt' --threads 2", folder);
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("node 'make_depth' (make_depth), frame 20: told to fail"), std::string::npos)
      << outcome.err;
  const std::string text = read_text(folder.path() / "a.txt");
  EXPECT_NE(text.find("19 make_depth=19\n"), std::string::npos) << "what came before the error is complete";
  EXPECT_EQ(text.find("21 "), std::string::npos);
}

TEST(Graph, AnInterruptEndsInOrder) {
  const TemporaryFolder folder;
  const Outcome outcome = shell("\"$TOFGRAPH\" run 'ramp frames=0 pause=\"1 ms\" ! collect path=a.txt' & " +
                                    once_it_writes("a.txt") + "sleep 1; kill -INT $!; wait $!",
                                folder.path());
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_NE(read_text(folder.path() / "a.txt").find("\n100 ramp=100\n"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.txt.part"));
}

TEST(Graph, DropOldestCountsWhatItDrops) {
  const TemporaryFolder folder;
  write_text(folder.path() / "p.yaml",
             "pipeline: 1\nnodes:\n"
             "  - {stage: ramp, frames: 300, queue: {capacity: 2, policy: drop_oldest}}\n"
             "  - {stage: make_depth, pause: 5 ms}\n"
             "  - {stage: collect, path: a.txt}\n");
  const Outcome outcome = run("p.yaml --stats s.json", folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto statistics = nlohmann::json::parse(read_text(folder.path() / "s.json"));
  const auto frames = statistics["frames"].get<int>(), dropped = statistics["dropped"].get<int>();
  EXPECT_EQ(frames + dropped, 300);
  EXPECT_GT(dropped, 0);
  EXPECT_EQ(statistics["edges"][0]["dropped"], dropped);
  EXPECT_EQ(statistics["edges"][0]["policy"], "drop_oldest");
  EXPECT_NE(outcome.err.find("frames dropped"), std::string::npos) << "drops are told";
  const std::string text = read_text(folder.path() / "a.txt");
  EXPECT_NE(text.find("299 make_depth=299"), std::string::npos) << "the newest frame is kept";
  EXPECT_EQ(static_cast<int>(std::count(text.begin(), text.end(), '\n')), frames);
}

TEST(Graph, ADroppedFrameIsCountedOnce) {
  const TemporaryFolder folder;
  write_text(folder.path() / "p.yaml",
             "pipeline: 1\nnodes:\n"
             "  - {name: grab, stage: ramp, frames: 100, queue: {capacity: 3, policy: drop_oldest}}\n"
             "  - {name: one, stage: make_depth, pause: 3 ms, inputs: [grab]}\n"
             "  - {stage: collect, path: a.txt, inputs: [one]}\n"
             "  - {name: two, stage: collect, path: b.txt, inputs: [grab]}\n");
  const Outcome outcome = run("p.yaml --threads 2 --stats s.json", folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto statistics = nlohmann::json::parse(read_text(folder.path() / "s.json"));
  int dropped = 0;
  for (const auto& edge : statistics["edges"]) {
    dropped += edge["dropped"].get<int>();
    EXPECT_EQ(edge["capacity"], edge["from"] == "grab" ? 3 : 2 * 2) << edge;
  }
  EXPECT_EQ(statistics["edges"].size(), 3U);
  EXPECT_GT(dropped, 0);
  EXPECT_EQ(dropped, statistics["dropped"]);
}

TEST(Graph, BlockLosesNothing) {
  const TemporaryFolder folder;
  const Outcome outcome = run("'ramp frames=300 ! make_depth pause=\"1 ms\" ! collect path=a.txt' --threads 2", folder);
  ASSERT_EQ(outcome.exit_code, 0);
  const std::string text = read_text(folder.path() / "a.txt");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 300);
}

TEST(Graph, FramesAndSettingsOfTheCommandLineWin) {
  const TemporaryFolder folder;
  const Outcome outcome = run("'ramp frames=100 ! scale ! collect path=a.txt' --frames 3 --set scale.factor=2", folder);
  ASSERT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(read_text(folder.path() / "a.txt"), "0 scale=0\n1 scale=2\n2 scale=4\n");
}

TEST(Graph, QuietSaysNothing) {
  const TemporaryFolder folder;
  const Outcome outcome = run("--quiet 'ramp ! null'", folder);
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out + outcome.err, "");
}

TEST(Statistics, ThatCannotBeWrittenAreToldBeforeTheFirstFrame) {
  const TemporaryFolder folder;
  write_text(folder.path() / "there.json", "precious");
  const std::string line = "'ramp ! collect path=a.txt' --stats ";
  const auto expect_refused = [&](const std::string& arguments, const std::string& message) {
    const Outcome outcome = run(line + arguments, folder);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_EQ(outcome.err, message);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.txt")) << arguments;
  };
  expect_refused("there.json", "--stats there.json: error: the file exists\n         --force replaces it\n");
  expect_refused("there.json/s.json",
                 "--stats there.json/s.json: error: there.json/s.json cannot be written: there.json is not a folder\n");
  expect_refused("'" + folder.path().string() + "' --force",
                 "--stats " + folder.path().string() + ": error: " + folder.path().string() + " is a folder\n");
  EXPECT_EQ(read_text(folder.path() / "there.json"), "precious");
  const Outcome both = run("'ramp ! collect path=same' --stats same", folder);
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_EQ(both.err, "--stats same: error: node 'collect' writes this file\n");
}

TEST(Statistics, DoNotHideTheErrorOfTheRun) {
  const TemporaryFolder folder;
  // The folder of the statistics disappears during the run.
  const std::string taken = once_it_writes("a.txt") + "rmdir gone; touch gone; ";
  std::filesystem::create_directory(folder.path() / "gone");
  const Outcome failed = shell("(" + taken +
                                   ") & \"$TOFGRAPH\" run 'ramp frames=1000 pause=\"2 ms\" ! make_depth fail_at=400 ! "
                                   "collect path=a.txt' --stats gone/s.json; code=$?; wait; exit $code",
                               folder.path());
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_NE(failed.err.find("node 'make_depth' (make_depth), frame 400: told to fail"), std::string::npos)
      << failed.err;
  EXPECT_NE(failed.err.find("the statistics of the run could not be written: "), std::string::npos) << failed.err;
  // Another program creates the file of the statistics during the run.
  const Outcome interrupted =
      shell("\"$TOFGRAPH\" run 'ramp frames=0 pause=\"1 ms\" ! collect path=b.txt' --stats s.json & " +
                once_it_writes("b.txt") + "echo precious > s.json; kill -INT $!; wait $!",
            folder.path());
  EXPECT_EQ(interrupted.exit_code, 130) << interrupted.err;
  EXPECT_NE(interrupted.err.find("--stats s.json: error: the file exists"), std::string::npos) << interrupted.err;
  EXPECT_EQ(read_text(folder.path() / "s.json"), "precious\n");
}

TEST(StandardOutput, ThatIsFullIsAnError) {
  const TemporaryFolder folder;
  const std::string graph = " 'ramp ! make_depth ! null'";
  for (const std::string& command :
       {std::string("list"), std::string("list --json"), std::string("describe scale"), "explain" + graph,
        "explain --dot" + graph, std::string("--help"), std::string("--version")}) {
    const Outcome outcome = shell("\"$TOFGRAPH\" " + command + " > /dev/full", folder.path());
    EXPECT_EQ(outcome.exit_code, 1) << command;
    // On a slow machine a message about a plugin still being loaded may come first.
    EXPECT_THAT(outcome.err, testing::ContainsRegex("(^|\n)tofgraph: error: (standard output cannot be written|"
                                                    "cannot write to file: No space left on device\n$)"))  // of fmt
        << command;
  }
  const Outcome table = run("'ramp ! make_depth ! statistics' > /dev/full", folder);
  EXPECT_EQ(table.exit_code, 1);
  EXPECT_NE(table.err.find("node 'statistics' (statistics), at the end: standard output cannot be written: No space "
                           "left on device"),
            std::string::npos)
      << table.err;
}

TEST(Explain, TellsWhatWasDoneAndDrawsTheGraph) {
  const TemporaryFolder folder;
  write_text(folder.path() / "t.txt", "abc");
  const std::string line = " 'ramp ! make_depth table=t.txt offset=\"3 mm\" ! collect path=a.txt'";
  const Outcome text = shell("\"$TOFGRAPH\" explain" + line, folder.path());
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_NE(
      text.out.find(
          "makes   depth (float32 4 x 8, m): along z from the sensor plane; applied so far: make_depth, linearised"),
      std::string::npos)
      << text.out;
  EXPECT_NE(text.out.find("offset=3 mm"), std::string::npos);
  // The published SHA-256 of "abc" (FIPS 180-2, B.1).
  EXPECT_NE(text.out.find("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"), std::string::npos);
  const Outcome dot = shell("\"$TOFGRAPH\" explain --dot" + line, folder.path());
  EXPECT_NE(dot.out.find("\"ramp\" -> \"make_depth\" [label=\"distance\"];"), std::string::npos) << dot.out;
}

TEST(CommandLine, HelpAndVersion) {
  const Outcome help = shell("\"$TOFGRAPH\" --help && \"$TOFGRAPH\" run --help", "/tmp");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(
      help.out.find("Exit codes: 0 done, 1 failed while running, 2 wrong usage or configuration, 130 interrupted"),
      std::string::npos);
  EXPECT_NE(help.out.find("--stats"), std::string::npos);
  EXPECT_EQ(shell("\"$TOFGRAPH\" --version", "/tmp").out, "tofgraph " TOFGRAPH_VERSION "\n");
  EXPECT_EQ(shell("\"$TOFGRAPH\"", "/tmp").exit_code, 2);
  EXPECT_EQ(shell("\"$TOFGRAPH\" rnu", "/tmp").exit_code, 2);
}

}  // namespace
}  // namespace tofgraph::tests
