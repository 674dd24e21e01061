// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Every command of docs/large_campaigns.md.
// Slow: *
// Rooms: reduction diagnosis cli
// The tests share the campaign created by SetUpTestSuite.
#include "tests/divided_campaign.hpp"
#include "tests/guide.hpp"

using namespace tofgraph::tests;
using testing::HasSubstr;
namespace fs = std::filesystem;

namespace {

using LargeCampaignsGuide = DividedCampaign;

TEST_F(LargeCampaignsGuide, EveryCommandOfThePage) {
  write_text(home() / "guide/scene.yaml", read_text(home() / "scene.yaml"));
  write_text(home() / "guide/ideal.yaml", read_text(home() / "ideal.yaml"));
  const std::vector<std::string> blocks = commands_of(TOFGRAPH_SOURCE_DIR "/docs/large_campaigns.md");
  ASSERT_EQ(blocks.size(), 3U);
  for (const std::string& block : blocks) {
    const Outcome outcome = shell("set -e; export PATH=\"$(dirname \"$TOFGRAPH\"):$PATH\"; " + block, home() / "guide");
    EXPECT_EQ(outcome.exit_code, 0) << block << outcome.err;
  }
  for (const std::string folder : {"guide/gap", "guide/job/result"})
    EXPECT_TRUE(fs::exists(home() / folder / "report.html")) << folder;
  EXPECT_EQ(result_of("guide/injected"), result_of("whole"));
}

}  // namespace
