// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: *
// Rooms: calibration simulation report plugins cli
// Every command of docs/calibrate_a_camera.md, and what the page says came out.
#include "tests/guide.hpp"

#include <nlohmann/json.hpp>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

TEST(CameraGuide, ACameraIsCalibratedFromNothing) {
  const TemporaryFolder folder;
  for (const char* name : {"pipelines", "devices"})
    fs::copy(fs::path(TOFGRAPH_SOURCE_DIR) / name, folder.path() / name, fs::copy_options::recursive);
  fs::remove_all(folder.path() / "pipelines/out");
  fs::create_directories(folder.path() / "out");
  for (const std::string& block : commands_of(TOFGRAPH_SOURCE_DIR "/docs/calibrate_a_camera.md")) {
    const Outcome outcome = shell("tofgraph() { \"$TOFGRAPH\" \"$@\"; }\n" + block, folder.path());
    ASSERT_EQ(outcome.exit_code, 0) << block << outcome.err;
  }
  const auto board = [&](const char* name) {
    return nlohmann::json::parse(read_text(folder.path() / "out" / name))["inputs"][0];
  };
  EXPECT_NEAR(board("before.json")["mean"].get<double>(), 1.7661, 0.5e-3) << "as the page says";
  EXPECT_NEAR(board("before.json")["sd"].get<double>(), 2.8e-3, 0.1e-3);
  EXPECT_NEAR(board("after.json")["mean"].get<double>(), 1.75, 1e-3);
  EXPECT_NEAR(board("after.json")["sd"].get<double>(), 1.5e-3, 0.1e-3);
  EXPECT_TRUE(fs::exists(folder.path() / "out/characterisation/report.html"));
}

}  // namespace
}  // namespace tofgraph::tests
