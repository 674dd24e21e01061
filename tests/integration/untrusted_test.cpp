// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Untrusted.EndsWhileItWaitsForAnInput
// Rooms: cli
// run --untrusted: limits for pipelines from untrusted sources.
#include "graph/runner.hpp"
#include "tests/small_capture.hpp"

#include <gmock/gmock.h>

namespace tofgraph {
namespace {

using testing::HasSubstr;

class Untrusted : public testing::Test {
 protected:
  Untrusted() {
    std::filesystem::create_directory(inner());
    tests::write_text(inner() / "tiny.yaml", tests::small_profile);
    tests::SmallCapture capture;
    capture.channels = {{"depth", {tests::SmallCapture::Image(tests::small_pixels, 1.5F)}}};
    capture.write(inner() / "a.h5");
  }
  std::filesystem::path inner() const { return folder_.path() / "received"; }
  /// Runs a pipeline of a reader and these nodes from the parent of its folder.
  tests::Outcome run(const std::string& nodes, const std::string& options = "") const {
    tests::write_text(inner() / "p.yaml",
                      "pipeline: 1\ncamera: ./tiny.yaml\nnodes:\n"
                      "  - {name: grab, stage: capture_reader, file: a.h5}\n" +
                          nodes);
    return tests::shell("$TOFGRAPH run --untrusted " + options + " received/p.yaml", folder_.path());
  }
  tests::Outcome run_to(const std::string& path) const {
    return run("  - {name: out, stage: capture_writer, path: '" + path + "'}\n");
  }
  tests::TemporaryFolder folder_;
};

TEST_F(Untrusted, WritesIntoThePipelinesFolder) {
  const tests::Outcome outcome = run_to("out/b.h5");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(std::filesystem::exists(inner() / "out" / "b.h5"));
}

TEST_F(Untrusted, RefusesOutputsElsewhereLinksIncluded) {
  std::filesystem::create_directory(folder_.path() / "received_too");
  std::filesystem::create_symlink(folder_.path(), inner() / "link");
  std::filesystem::create_symlink("made/../../received_too", inner() / "dangling");
  for (const char* path : {"dangling/b.h5", "../b.h5", "../received_too/b.h5", "out/../../b.h5", "link/b.h5",
                           "/tmp/tofgraph_untrusted_test.h5"}) {
    const tests::Outcome outcome = run_to(path);
    EXPECT_EQ(outcome.exit_code, 2) << path;
    EXPECT_THAT(outcome.err, HasSubstr("node 'out': error: writes ")) << path;
    EXPECT_THAT(outcome.err, HasSubstr("--untrusted does not allow that")) << path;
  }
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "b.h5"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path() / "received_too"));
}

TEST_F(Untrusted, RefusesPluginsOfOthersDevicesAndPorts) {
  const tests::Outcome plugin = run("  - {name: more, stage: scale, factor: 2}\n");
  EXPECT_EQ(plugin.exit_code, 2);
  EXPECT_THAT(plugin.err, HasSubstr("scale"));
  for (const std::string& stage : std::vector<std::string>{"live_view", "camcube"}) {
    const tests::Outcome outcome = run("  - {name: more, stage: " + stage + "}\n");
    EXPECT_EQ(outcome.exit_code, 2) << stage;
    EXPECT_THAT(outcome.err, HasSubstr("p.yaml:5:25: error: '" + stage + "' opens a device or a network port"));
  }
}

TEST_F(Untrusted, RefusesCampaigns) {
  const tests::Outcome outcome = run("", "--campaign c.yaml -o out");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--untrusted"));
}

TEST_F(Untrusted, LimitsMemory) {
  const tests::Outcome outcome = tests::shell(
      "$TOFGRAPH run --untrusted 'simulator frames=0 ! four_phase_decoder ! statistics path=s.json' --camera camcube2 "
      "& "
      "program=$!; for i in $(seq 100); do sleep 0.1; awk '/Max address space/ {print $4}' /proc/$program/limits | "
      "grep -v unlimited && break; done; kill -9 $program",
      folder_.path());
  const double limit = outcome.out.empty() ? 0 : std::stod(outcome.out), allowed = std::exp2(32);
  EXPECT_GT(limit, allowed);
  EXPECT_LT(limit, 1.1 * allowed) << "4 GB beyond what the program had mapped at its start";
}

TEST_F(Untrusted, RefusesAPipelineThatReplacesFiles) {
  const tests::Outcome outcome = run("  - {name: out, stage: capture_writer, path: b.h5, overwrite: true}\n");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("p.yaml:5:52: error: --untrusted does not allow a pipeline to replace files"));
}

TEST_F(Untrusted, LimitsFrames) {
  const auto simulate = [&](const std::string& frames) {
    return tests::shell("$TOFGRAPH run --untrusted --force 'simulator frames=" + frames +
                            " noise=none frame_rate=80Hz ! four_phase_decoder ! statistics path=s.json' "
                            "--camera received/tiny.yaml",
                        folder_.path());
  };
  for (const char* frames : {"0", "10001"}) {
    const tests::Outcome outcome = simulate(frames);
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("error: stopped after 10000 frames, the limit of --untrusted")) << frames;
  }
  const tests::Outcome complete = simulate("10000");
  EXPECT_EQ(complete.exit_code, 0) << complete.err;
  EXPECT_THAT(complete.err, HasSubstr("10000 frames in "));
}

/// Runs a source that does not announce its number of frames, limited to 100 frames.
/// @returns the number of completed frames, and whether the source had another frame
std::pair<std::uint64_t, bool> run_limited(std::uint64_t frames) {
  graph::GraphOptions options;
  options.plugin_folders = graph::plugin_path({TOFGRAPH_BINARY_DIR "/tests/plugins"});
  config::Diagnostics diagnostics;
  const auto built = graph::build_graph(
      graph::document_of("ramp announced=false frames=" + std::to_string(frames) + " ! make_depth ! null", ""), {},
      options, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  built->nodes().front()->set_max_frames(100);
  const graph::RunResult result = graph::Runner(*built, {}).run();
  EXPECT_EQ(result.error, "");
  EXPECT_EQ(result.nodes.back().frames, result.frames) << "the frame beyond the limit reaches no sink";
  return {result.frames, built->nodes().front()->exceeded_max_frames()};
}

TEST(UntrustedSource, ThatAnnouncesNothingMayHaveExactlyTheLimit) {
  EXPECT_EQ(run_limited(99), std::pair(std::uint64_t{99}, false));
  EXPECT_EQ(run_limited(100), std::pair(std::uint64_t{100}, false));
  EXPECT_EQ(run_limited(101), std::pair(std::uint64_t{100}, true));
  EXPECT_EQ(run_limited(0), std::pair(std::uint64_t{100}, true)) << "endless";
}

TEST_F(Untrusted, LimitsTime) {
  const std::string begin = "$TOFGRAPH run --untrusted --frames 1000000000 --time-limit '200 ms' ";
  const tests::Outcome outcome =
      tests::shell(begin +
                       "'simulator frames=0 noise=none frame_rate=80Hz ! four_phase_decoder ! statistics path=s.json' "
                       "--camera received/tiny.yaml",
                   folder_.path());
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("error: stopped after 200 ms, the limit of --time-limit"));
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "s.json"));
}

// A pipe without a writer: the run waits for it before its first frame.
TEST_F(Untrusted, EndsWhileItWaitsForAnInput) {
  const tests::Outcome outcome = tests::shell(
      "mkfifo a.raw; $TOFGRAPH run --untrusted --time-limit '200 ms' 'pmd_raw_reader file=a.raw ! null' --camera "
      "camcube2",
      folder_.path());
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("stopped at once"));
}

}  // namespace
}  // namespace tofgraph
