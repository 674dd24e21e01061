// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// `run --validate`: what a stage does to a frame that it may not, and that the shipped pipelines do no such thing.
#include "tests/program.hpp"

namespace tofgraph::tests {
namespace {

const std::string invalid = TOFGRAPH_BINARY_DIR "/tests/invalid";

Outcome run(const std::string& rule, const std::string& option) {
  return shell("\"$TOFGRAPH\" --plugin-path " + invalid + " run 'ramp frames=2 ! bends_rules rule=" + rule +
                   " ! null' " + option,
               "/tmp");
}

struct Case {
  const char *rule, *sentence;
};
class Rule : public testing::TestWithParam<Case> {};

TEST_P(Rule, TellsNodeFramePluginAndChannel) {
  const Outcome outcome = run(GetParam().rule, "--validate --threads 1");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  const std::string words = std::string("node 'bends_rules' (bends_rules), frame 0: ") + GetParam().sentence +
                            "\n         plugin " + invalid + "/tofgraph_filter_bends_rules.so\n";
  EXPECT_NE(outcome.err.find(words), std::string::npos) << words << "\nis not in:\n" << outcome.err;
}

INSTANTIATE_TEST_SUITE_P(
    Validate, Rule,
    testing::Values(Case{"nan", "'depth' is NaN without the flag 'invalid' at 2 pixels, the first in row 1, column 2"},
                    Case{"flag",
                         "'depth' is a number in spite of the flag 'invalid' at 1 pixel, the first in row 2, column 5"},
                    Case{"reads", "the stage changed 'distance', which it only reads"},
                    Case{"before", "the stage wrote before the memory of 'depth'"},
                    Case{"behind", "the stage wrote beyond the end of the memory of 'depth'"}),
    [](const auto& info) { return std::string(info.param.rule); });

TEST(Validate, FindsNothingWhereNothingIs) {
  EXPECT_EQ(run("none", "--validate").exit_code, 0) << run("none", "--validate").err;
  EXPECT_EQ(run("nan", "").exit_code, 0) << "without the option nobody looks";
}

TEST(Validate, ShippedPipelinesPass) {
  const TemporaryFolder folder;
  std::filesystem::copy(TOFGRAPH_SOURCE_DIR "/pipelines", folder.path() / "pipelines",
                        std::filesystem::copy_options::recursive);
  for (const char* pipeline : {"ideal_board", "quickstart"}) {
    const Outcome outcome =
        shell(std::string("\"$TOFGRAPH\" run pipelines/") + pipeline + ".yaml --validate --force", folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << pipeline << "\n" << outcome.err;
  }
}

}  // namespace
}  // namespace tofgraph::tests
