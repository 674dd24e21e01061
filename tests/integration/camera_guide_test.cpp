// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: *
// Rooms: calibration simulation report plugins cli
// Every command of docs/calibrate_a_camera.md; result of each calibration as stated in the page's table.
#include "tests/guide.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <sstream>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

constexpr const char* page = TOFGRAPH_SOURCE_DIR "/docs/calibrate_a_camera.md";

/// Numbers of a row of the page's table, mm.
struct Row {
  std::string step;
  std::array<double, 5> values{};  ///< mean bias, worst bias, flatness, noise, bias of the cold camera
};

std::vector<Row> rows_of_page() {
  std::vector<Row> rows;
  std::istringstream lines(read_text(page));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| ") || line.starts_with("| after") || line.starts_with("| ---")) continue;
    std::istringstream cells(line.substr(1));
    Row row;
    std::getline(cells, row.step, '|');
    for (double& value : row.values) {
      std::string cell;
      std::getline(cells, cell, '|');
      value = std::stod(cell);
    }
    rows.push_back(row);
  }
  return rows;
}

/// Errors from `evaluate` on the surfaces that no calibration used.
std::array<double, 5> judged(const fs::path& evaluation) {
  const nlohmann::json result = nlohmann::json::parse(read_text(evaluation));
  double bias = 0, worst = 0, flatness = 0, noise = 0, cold = NAN, n = 0;
  for (const nlohmann::json& c : result["conditions"]) {
    const double error = 1e3 * c["bias"].get<double>();
    if (c["target"] == "cold") {
      cold = error;
      continue;
    }
    ++n;
    bias += std::abs(error);
    worst = std::max(worst, std::abs(error));
    flatness += std::pow(1e3 * c["flatness"].get<double>(), 2);
    noise += std::pow(1e3 * c["noise"].get<double>(), 2);
  }
  EXPECT_EQ(n, 5);
  return {bias / n, worst, std::sqrt(flatness / n), std::sqrt(noise / n), cold};
}

TEST(CameraGuide, ACameraIsCalibratedFromNothing) {
  const TemporaryFolder folder;
  const std::string setup =
      "set -e; export XDG_DATA_HOME=\"$PWD/data\" XDG_CACHE_HOME=\"$PWD/cache\" PATH=\"${TOFGRAPH%/*}:$PATH\"\n";
  const auto run = [&](const std::string& commands) { return shell(setup + commands, folder.path()); };
  const std::vector<Row> stated = rows_of_page();
  std::string fresh;
  std::size_t step = 0;
  for (const std::string& block : commands_of(page)) {
    const Outcome outcome = run(block);
    ASSERT_EQ(outcome.exit_code, 0) << block << outcome.err;
    const bool first = block.find("-o out/before") != std::string::npos;
    if (!first && block.find("camera add") == std::string::npos) continue;
    const std::string name = first ? "before" : fmt::format("step{}", step);
    if (!first) {
      const Outcome judging =
          run(fmt::format("tofgraph run out/corrected.yaml --campaign out/new/campaign.yaml -o "
                          "out/{0}\ntofgraph evaluate out/{0}/campaign.yaml -o out/{0}/accuracy",
                          name));
      ASSERT_EQ(judging.exit_code, 0) << judging.err;
    }
    const std::array<double, 5> now = judged(folder.path() / "out" / name / "accuracy/evaluation.json");
    ASSERT_LT(step, stated.size());
    fresh += fmt::format("|{}| {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", stated[step].step, now[0], now[1],
                         now[2], now[3], now[4]);
    for (std::size_t k = 0; k < now.size(); ++k)
      EXPECT_NEAR(now[k], stated[step].values[k], std::max(0.15, 0.03 * std::abs(now[k]))) << stated[step].step;
    ++step;
  }
  EXPECT_EQ(step, stated.size());
  if (HasFailure()) std::printf("the table of the page is now:\n%s", fresh.c_str());
  EXPECT_TRUE(fs::exists(folder.path() / "out/characterisation/report.html"));
}

}  // namespace
}  // namespace tofgraph::tests
