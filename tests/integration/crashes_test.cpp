// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: EndlessCall.IsNamed*:SlowCall.InPrepare*:SlowLoading.IsTold*
// Rooms: graph
// Plugins that crash, do not return, are slow or noisy: the program names the plugin.
#include "tests/program.hpp"

#include <algorithm>
#include <csignal>

namespace tofgraph::tests {
namespace {

const std::string tests_folder = TOFGRAPH_BINARY_DIR "/tests";

Outcome with(const std::string& folder, const std::string& arguments, const std::filesystem::path& where = "/tmp") {
  return shell("\"$TOFGRAPH\" --plugin-path " + tests_folder + "/" + folder + " " + arguments, where);
}
void expect_said(const Outcome& outcome, const std::string& words) {
  EXPECT_NE(outcome.err.find(words), std::string::npos) << words << "\nis not in:\n" << outcome.err;
}

TEST(Crash, InProcessNamesNodeFrameAndFile) {
  const Outcome run = with("broken", "run 'ramp ! crashes_in_process name=mine ! null' --threads 1");
  EXPECT_EQ(run.exit_code, 128 + SIGSEGV);
  expect_said(run,
              "tofgraph: error: crashed (signal 11, Segmentation fault): node 'mine' (crashes_in_process), "
              "frame 2, in process() of plugin " +
                  tests_folder + "/broken/tofgraph_filter_crashes_in_process.so");
}

TEST(Crash, OfAFullStackNamesNodeFrameAndFile) {
  for (const char* threads : {"1", "2"}) {
    const Outcome run = with("broken", std::string("run 'ramp ! never_stops_calling ! null' --threads ") + threads);
    EXPECT_EQ(run.exit_code, 128 + SIGSEGV);
    expect_said(run, "node 'never_stops_calling' (never_stops_calling), frame 2, in process() of plugin " +
                         tests_folder + "/broken/tofgraph_filter_never_stops_calling.so");
  }
}

TEST(Crash, InPrepareNamesNodeAndFile) {
  for (const char* command : {"run", "check"}) {
    const Outcome run = with("broken", std::string(command) + " 'ramp ! crashes_in_prepare ! null'");
    EXPECT_EQ(run.exit_code, 128 + SIGSEGV) << command;
    expect_said(run, "node 'crashes_in_prepare' (crashes_in_prepare), in prepare() of plugin " + tests_folder +
                         "/broken/tofgraph_filter_crashes_in_prepare.so");
  }
}

TEST(Crash, OfAnEffectNamesTheEffectAndItsFile) {
  const TemporaryFolder folder;
  write_text(folder.path() / "s.yaml",
             "scene: 1\ncamera: camcube2\nframes: 1\nintegration_time: 1 ms\nobjects:\n"
             "  - {type: board, distance: 1 m}\nmodel: {effects: [{effect: crashes_in_apply}]}\n");
  const Outcome simulated = with("crashing", "simulate s.yaml -o a.h5", folder.path());
  EXPECT_EQ(simulated.exit_code, 128 + SIGSEGV);
  const std::string effect = "effect 'crashes_in_apply' (crashes_in_apply), in apply() of plugin " + tests_folder +
                             "/crashing/tofgraph_effect_crashes_in_apply.so";
  expect_said(simulated, effect);
  const Outcome run = with("crashing", "run 'simulator scene=s.yaml ! null'", folder.path());
  EXPECT_EQ(run.exit_code, 128 + SIGSEGV);
  expect_said(run, effect);
}

/// The message says how to continue without third-party plugins; with --safe none are loaded.
TEST(Crash, SaysSafe) {
  const Outcome crash = with("broken", "run 'ramp ! crashes_in_process ! null' --threads 1");
  expect_said(crash, "\n         tofgraph run --safe runs without plugins that did not come with the program\n");
  const Outcome safe = with("broken", "run --safe 'simulator frames=1 ! crashes_in_process ! null' --camera camcube2");
  EXPECT_EQ(safe.exit_code, 2);
  expect_said(safe, "there is no stage 'crashes_in_process'");
  EXPECT_EQ(with("broken", "run --safe --quiet 'simulator frames=1 ! null' --camera camcube2").exit_code, 0);
}

TEST(EndlessCall, IsNamedAfterAnInterruptAndASecondOneEndsTheProgram) {
  const TemporaryFolder folder;
  const Outcome run =
      shell("\"$TOFGRAPH\" --plugin-path " + tests_folder + "/broken run 'ramp ! never_returns ! null' 2>err.txt & " +
                once_it_says("does not return") + "kill -INT $!; " + once_it_says("a second interrupt") +
                "kill -INT $!; wait $!",
            folder.path());
  EXPECT_EQ(run.exit_code, 130);
  const Outcome said{0, "", read_text(folder.path() / "err.txt")};
  expect_said(said, "still waiting: node 'never_returns' (never_returns), frame 0, has been in process() for ");
  expect_said(said, ": plugin " + tests_folder + "/broken/tofgraph_filter_never_returns.so\n");
}

TEST(SlowCall, InPrepareIsNamedOnce) {
  const Outcome run = with("broken", "run 'ramp ! prepares_slowly ! null'");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::string words = "node 'prepares_slowly' (prepares_slowly) has been in prepare() for 5";
  expect_said(run, words);
  EXPECT_EQ(run.err.find(words, run.err.find(words) + 1), std::string::npos) << run.err;
}

TEST(SlowLoading, IsToldOnceWithThePlugin) {
  const TemporaryFolder folder;
  const Outcome described = shell("XDG_CACHE_HOME=" + folder.path().string() + " \"$TOFGRAPH\" --plugin-path " +
                                      tests_folder + "/noisy describe loads_slowly",
                                  folder.path());
  EXPECT_EQ(described.exit_code, 0) << described.err;
  EXPECT_EQ(described.err,
            "plugin " + tests_folder + "/noisy/tofgraph_filter_loads_slowly.so: still being loaded after 2 s\n");
}

TEST(NoisyLoading, GoesToStandardError) {
  const TemporaryFolder folder;
  const Outcome run = with("noisy", "run 'ramp ! prints_when_loaded ! null'", folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, "");
  expect_said(run, "a licence is needed\n");
}

}  // namespace
}  // namespace tofgraph::tests
