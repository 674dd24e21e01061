// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Validate.EveryEffect*
// Rooms: graph
// `run --validate`: forbidden changes of a frame by a stage; the shipped pipelines make none.
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
                         "'depth' is a number despite the flag 'invalid' at 1 pixel, the first in row 2, column 5"},
                    Case{"reads", "the stage changed 'distance', which it only reads"},
                    Case{"before", "the stage wrote before the memory of 'depth'"},
                    Case{"behind", "the stage wrote beyond the end of the memory of 'depth'"}),
    [](const auto& info) { return std::string(info.param.rule); });

TEST(Validate, AnnouncedMetadataThatIsMissingIsTold) {
  const std::string line = "\"$TOFGRAPH\" run 'forgets_metadata ! null' --camera camcube2 ";
  EXPECT_EQ(shell(line, "/tmp").exit_code, 0) << "without a close look nobody sees it";
  const Outcome outcome = shell(line + "--validate", "/tmp");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(
      outcome.err.find("frame 0: the source announced the frames' integration time, but did not set it in this one"),
      std::string::npos)
      << outcome.err;
}

/// Messages about an effect when the simulator uses it.
Outcome with_effect(const std::string& effect, const std::string& option) {
  const TemporaryFolder folder;
  write_text(folder.path() / "model.yaml", "model: 1\ncamera: camcube2\neffects: [{effect: " + effect + "}]\n");
  return shell("\"$TOFGRAPH\" --plugin-path " + invalid +
                   " --plugin-path " TOFGRAPH_BINARY_DIR
                   "/tests/broken_effects run \"simulator distance='1 m' model=model.yaml ! null\" --camera camcube2 " +
                   option,
               folder.path());
}

TEST(Validate, AnEffectThatIsNotOffIsTold) {
  EXPECT_EQ(with_effect("never_off", "").exit_code, 0) << "without a close look nobody sees it";
  const Outcome outcome = with_effect("never_off", "--validate");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("the effect never_off changes the light although all its sizes are off"),
            std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("tofgraph_effect_never_off.so"), std::string::npos) << outcome.err;
}

TEST(Validate, AnEffectThatMakesNaNIsTold) {
  const Outcome outcome = with_effect("gives_nan", "--validate");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("the effect gives_nan turns finite light into NaN or infinity"), std::string::npos)
      << outcome.err;
}

TEST(Validate, EveryEffectThatIsShippedIsOffWhenItIsOff) {
  for (const auto& entry : std::filesystem::directory_iterator(TOFGRAPH_SOURCE_DIR "/plugins/effects")) {
    if (entry.path().extension() != ".cpp") continue;
    const Outcome outcome = with_effect(entry.path().stem().string(), "--validate");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  }
}

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
