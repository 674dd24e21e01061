// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: HuntGuide.*
// Rooms: diagnosis cli simulation plugins
// Every command of docs/find_the_hidden_effect.md gives the result stated in the page.
#include "tests/guide.hpp"

#include <nlohmann/json.hpp>

#include <cmath>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

TEST(HuntGuide, EveryCommandWorksAndTheRecordingIsCorrected) {
  const TemporaryFolder folder;
  const fs::path hunt = folder.path() / "hunt", page = TOFGRAPH_SOURCE_DIR "/docs/find_the_hidden_effect.md";
  std::string said;
  for (const std::string& block : commands_of(page)) {
    const std::string command = replaced(block, "/tmp/hunt", hunt.string());
    const Outcome outcome = shell("tofgraph() { \"$TOFGRAPH\" \"$@\"; }\n" + command, TOFGRAPH_SOURCE_DIR);
    ASSERT_EQ(outcome.exit_code, 0) << command << outcome.err;
    said += outcome.out + outcome.err;
  }
  EXPECT_NE(said.find("The model lacks wiggling, crosstalk"), std::string::npos) << said;
  EXPECT_NE(said.find("undoes crosstalk: each pixel's distance is corrected"), std::string::npos) << said;
  const std::string text = read_text(page);
  const std::pair<const char*, double> boards[] = {{"near", 1.45}, {"far", 3.3}, {"wall", 5.65}};
  for (const auto& [name, truth] : boards) {
    const auto table = nlohmann::json::parse(read_text(hunt / (std::string(name) + ".json")));
    const double before = table["inputs"][0]["mean"], after = table["inputs"][1]["mean"];
    EXPECT_LE(std::abs(after - truth), 0.1 * std::abs(before - truth)) << name;
    char row[100];
    std::snprintf(row, sizeof row, "| %s | %g | %.1f | %.1f |", name, truth * 1e3, before * 1e3, after * 1e3);
    EXPECT_NE(text.find(row), std::string::npos) << "the page should say " << row;
  }
  EXPECT_TRUE(fs::exists(hunt / "before_00.pcd"));
  EXPECT_TRUE(fs::exists(hunt / "after_19.pcd"));
}

}  // namespace
}  // namespace tofgraph::tests
