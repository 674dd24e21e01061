// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Plugins that terminate the program: this is not reported as success, and the plugin is named.
#include "tests/program.hpp"

#include <csignal>

namespace tofgraph::tests {
namespace {

const std::string broken_folder = TOFGRAPH_BINARY_DIR "/tests/broken";

Outcome run_ending(const std::string& parameters, const std::filesystem::path& folder) {
  return shell("\"$TOFGRAPH\" --plugin-path " + broken_folder + " run 'ramp ! ends_the_program name=mine " +
                   parameters + " ! collect path=a.txt' --threads 1",
               folder);
}

class EndingCall : public testing::TestWithParam<const char*> {};

TEST_P(EndingCall, IsAFailureThatNamesNodeFrameAndPlugin) {
  const TemporaryFolder folder;
  const Outcome outcome = run_ending(std::string("how=") + GetParam(), folder.path());
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  const std::string call = GetParam() == std::string("thread") ? "exit" : GetParam();
  EXPECT_NE(outcome.err.find("tofgraph: error: a library ended the program by " + call +
                             "(0): node 'mine' (ends_the_program), frame 2, in process() of plugin " + broken_folder +
                             "/tofgraph_filter_ends_the_program.so"),
            std::string::npos)
      << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.txt"));
}

INSTANTIATE_TEST_SUITE_P(Calls, EndingCall, testing::Values("exit", "_exit", "_Exit", "quick_exit", "thread"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::erase(name, '_');
                           return name + std::to_string(info.index);
                         });

TEST(EndingCallElsewhere, IsNamedToo) {
  for (const std::string where : {"prepare", "finish", "destroy"}) {
    const TemporaryFolder folder;
    const Outcome outcome = run_ending("in=" + where, folder.path());
    EXPECT_EQ(outcome.exit_code, 1) << where << outcome.err;
    EXPECT_NE(outcome.err.find("(ends_the_program), in " + where + "() of plugin"), std::string::npos) << outcome.err;
  }
  const TemporaryFolder folder;
  EXPECT_EQ(run_ending("how=abort", folder.path()).exit_code, 128 + SIGABRT);
}

TEST(EndingCallElsewhere, AnOrdinaryEndIsNotReported) {
  const TemporaryFolder folder;
  const Outcome outcome = shell("\"$TOFGRAPH\" run 'ramp ! collect path=a.txt'", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err.find("ended the program"), std::string::npos) << outcome.err;
  EXPECT_EQ(shell("\"$TOFGRAPH\" --version", folder.path()).exit_code, 0);
  EXPECT_EQ(shell("\"$TOFGRAPH\" nonsense", folder.path()).exit_code, 2);
}

}  // namespace
}  // namespace tofgraph::tests
