// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Plugins that are wrong on purpose: each is refused by name and reason, none takes the program down.
#include "tests/program.hpp"

namespace tofgraph::tests {
namespace {

const std::string broken = TOFGRAPH_BINARY_DIR "/tests/broken";

Outcome with_broken(const std::string& arguments) {
  return shell("\"$TOFGRAPH\" --plugin-path " + broken + " " + arguments, "/tmp");
}

struct Case {
  const char* plugin;
  const char* reason;
};

class Refusal : public testing::TestWithParam<Case> {};

TEST_P(Refusal, NamesFileAndReason) {
  const std::string plugin = GetParam().plugin;
  const Outcome run = with_broken("run 'ramp ! " + plugin + " ! null'");
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_NE(run.err.find("tofgraph_filter_" + plugin + ".so"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find(GetParam().reason), std::string::npos) << run.err;
  const Outcome describe = with_broken("describe " + plugin);
  EXPECT_EQ(describe.exit_code, 2);
  EXPECT_NE(describe.err.find(GetParam().reason), std::string::npos) << describe.err;
}

INSTANTIATE_TEST_SUITE_P(Broken, Refusal,
                         testing::Values(Case{"no_symbol", "has no symbol 'tofgraph_plugin'"},
                                         Case{"old_version", "was built for plugin API 0.0, this program has 1.0"},
                                         Case{"new_version", "was built for plugin API 1.99, this program has 1.0"},
                                         Case{"no_descriptor", "gave no descriptor"},
                                         Case{"joins_streams", "is a filter over any number of streams"},
                                         Case{"crashes_when_loaded", "crashed while it was loaded (signal 11"},
                                         Case{"ends_the_process", "ended the process that loaded it (exit code 7)"},
                                         Case{"missing_library",
                                              "needs the library 'libtofgraph_absent.so', which is not installed"},
                                         Case{"undefined_symbol", "needs the symbol 'tofgraph_defined_nowhere'"}),
                         [](const auto& info) { return std::string(info.param.plugin); });

TEST(BrokenPlugin, ThatThrowsInItsConstructorIsToldWithItsWords) {
  const Outcome run = with_broken("run 'ramp ! throws_in_constructor ! null'");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("the stage cannot be made: the constructor gave up"), std::string::npos) << run.err;
}

TEST(BrokenPlugin, ThatThrowsWhileRunningEndsTheRunInOrder) {
  const TemporaryFolder folder;
  const Outcome run = shell(
      "\"$TOFGRAPH\" --plugin-path " + broken + " run 'ramp ! throws_in_process ! collect path=a.txt'", folder.path());
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(
      run.err.find("node 'throws_in_process' (throws_in_process), frame 3: threw something that is no std::exception"),
      std::string::npos)
      << run.err;
  EXPECT_EQ(read_text(folder.path() / "a.txt"),
            "0 throws_in_process=0\n1 throws_in_process=1\n2 throws_in_process=2\n");
}

TEST(BrokenPlugin, ThatThrowsWhenItIsStoppedEndsTheRunInOrder) {
  const TemporaryFolder folder;
  const Outcome failed =
      shell("\"$TOFGRAPH\" run 'throws_in_stop ! make_depth fail_at=3 ! collect path=a.txt'", folder.path());
  EXPECT_EQ(failed.exit_code, 1) << failed.err;
  EXPECT_NE(failed.err.find("node 'make_depth' (make_depth), frame 3: told to fail"), std::string::npos) << failed.err;
  EXPECT_NE(failed.err.find("throws_in_stop: warning: cannot be stopped: the device does not answer"),
            std::string::npos)
      << failed.err;
  const Outcome interrupted =
      shell("\"$TOFGRAPH\" run 'throws_in_stop ! null' & sleep 0.5; kill -INT $!; wait $!", folder.path());
  EXPECT_EQ(interrupted.exit_code, 130) << interrupted.err;
}

TEST(BrokenPlugin, ThatGivesAnotherShapeIsRefused) {
  const Outcome run = with_broken("run 'ramp ! wrong_shape ! null'");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("frame 0: 'depth' is float32 2 x 3, announced was float32 4 x 8, m"), std::string::npos)
      << run.err;
}

TEST(BrokenPlugin, ThatWritesWhatItDidNotAnnounceIsRefused) {
  const Outcome run = with_broken("run 'ramp ! writes_undeclared ! null'");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("wrote 'surprise', which it had not announced"), std::string::npos) << run.err;
}

TEST(BrokenPlugin, DoesNotKeepTheOthersFromBeingListed) {
  const Outcome list = with_broken("list --json");
  EXPECT_EQ(list.exit_code, 0);
  EXPECT_NE(list.out.find("\"make_depth\""), std::string::npos);
  EXPECT_NE(list.out.find("crashed while it was loaded"), std::string::npos);
}

}  // namespace
}  // namespace tofgraph::tests
