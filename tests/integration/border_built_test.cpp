// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Plugin libraries built with the first release are loaded and run by this host.
#include "tests/program.hpp"

#include <tofgraph/harness.hpp>

namespace tofgraph::tests {
namespace {

const std::string folder = TOFGRAPH_SOURCE_DIR "/tests/fixtures/border_1";

TEST(BuiltPlugins, AllAreDescribed) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".so") continue;
    ++count;
    const Outcome outcome = shell("\"$TOFGRAPH\" plugin check --only descriptor " + entry.path().string(), "/tmp");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.out;
  }
  EXPECT_EQ(count, 8U);
}

TEST(BuiltPlugins, FiltersDoWhatTheyDid) {
  for (const std::string name : {"plain_filter", "shaped_filter"}) {
    Harness stage(name + " factor=2", {folder});
    stage.put<float>("depth", {1, 2}, {1, 2.5});
    stage.run();
    EXPECT_EQ(stage.get<float>("depth"), (std::vector<float>{2, 5})) << name;
  }
}

TEST(BuiltPlugins, APipelineOfThemRuns) {
  const TemporaryFolder here;
  for (const std::string kind : {"plain", "shaped"}) {
    const Outcome outcome =
        shell("\"$TOFGRAPH\" --plugin-path " + folder + " run --quiet '" + kind + "_source frames=2 ! " + kind +
                  "_filter factor=2 ! " + kind + "_sink path=" + kind + ".csv' --camera camcube2",
              here.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(read_text(here.path() / (kind + ".csv")), "frame,mean_m\n0,2\n1,2.02\n");
  }
}

/// 20 mm more than without the plugin.
TEST(BuiltPlugins, EffectsDoWhatTheyDid) {
  const TemporaryFolder here;
  for (const std::string name : {"plain_effect", "shaped_effect"}) {
    write_text(here.path() / "m.yaml", "model: 1\neffects: [{effect: " + name + ", size: 20 mm}]\n");
    const Outcome outcome =
        shell("\"$TOFGRAPH\" --plugin-path " + folder +
                  " run \"simulator model=m.yaml distance='1 m' frames=1 noise=none ! four_phase_decoder ! "
                  "optimized_bistatic ! statistics value='1 m'\" --camera camcube2",
              here.path());
    EXPECT_NE((outcome.out + outcome.err).find(" 1020.0"), std::string::npos) << outcome.out << outcome.err;
  }
}

}  // namespace
}  // namespace tofgraph::tests
