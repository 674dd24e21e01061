// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The examples of docs/formats are accepted by the program.
#include "io/captures/capture_map.hpp"
#include "tests/program.hpp"

namespace tofgraph::tests {
namespace {

/// YAML blocks of a page.
std::vector<std::string> examples(const std::string& page) {
  const std::string text = read_text(std::filesystem::path(TOFGRAPH_SOURCE_DIR) / "docs/formats" / page), fence = "```";
  std::vector<std::string> blocks;
  for (std::size_t begin = 0; (begin = text.find(fence + "yaml\n", begin)) != std::string::npos;) {
    begin = text.find('\n', begin) + 1;
    const std::size_t end = text.find(fence, begin);
    blocks.push_back(text.substr(begin, end - begin));
    begin = end + fence.size();
  }
  return blocks;
}

class Formats : public testing::TestWithParam<std::string> {};

TEST_P(Formats, ExamplesAreRight) {
  const TemporaryFolder folder;
  const std::string files =
      "mkdir captures && cp \"" TOFGRAPH_SOURCE_DIR
      "/pipelines/campaigns/thesis_offset_tables.csv\" . && "
      "\"$TOFGRAPH\" run --quiet \"simulator distance='500 mm' frames=20 ! capture_writer path=board.h5\" --camera "
      "camcube2 && cp board.h5 captures/white_0500.h5";
  io::write_pixel_maps((folder.path() / "pattern.h5").string(), {{"map", "m", std::vector<double>(204 * 204)}}, 204,
                       204);
  const Outcome made = shell(files, folder.path());
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::vector<std::string> found = examples(GetParam() + ".md");
  ASSERT_FALSE(found.empty());
  for (const std::string& example : found) {
    write_text(folder.path() / "example.yaml", example);
    const Outcome outcome = shell("\"$TOFGRAPH\" check example.yaml", folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << example << outcome.err;
    EXPECT_EQ(outcome.err.find("warning"), std::string::npos) << outcome.err;
  }
}

INSTANTIATE_TEST_SUITE_P(Docs, Formats, testing::Values("pipeline", "profile", "campaign", "model", "scene"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace tofgraph::tests
