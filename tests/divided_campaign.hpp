// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A small campaign that is reduced and searched in parts, as tasks, jobs or ranks.
#pragma once

#include "io/sha256.hpp"
#include "tests/unit/full_disk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <memory>
#include <string>

namespace tofgraph::tests {

inline bool is_installed(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null").c_str()) == 0;
}

/// A small simulated campaign, and the reports of one process: `plain`, and `whole` with two cases of confidence.
class DividedCampaign : public testing::Test {
 protected:
  static constexpr int shards = 6;

  static void SetUpTestSuite() {
    home_ = std::make_unique<TemporaryFolder>();
    write_text(home() / "scene.yaml",
               "scene: 1\nname: small campaign\ncamera: camcube2\nframes: 40\noutput: phases\nseed: 3\n"
               "model: {light: reference, effects: [{effect: wiggling, amplitude: 6 mm, phase: 0.4 rad}]}\n"
               "objects:\n  - {name: board, type: board, distance: 500 mm, reflectivity: 0.8}\n"
               "sequence:\n"
               "  - {key: board.distance, values: [600 mm, 800 mm, 1000 mm, 1200 mm, 1400 mm, 1600 mm]}\n"
               "  - {key: integration_time, values: [0.5 ms, 1 ms]}\n");
    write_text(home() / "ideal.yaml", "model: 1\ncamera: camcube2\nlight: reference\neffects: []\n");
    done("$TOFGRAPH simulate scene.yaml -o c --quiet");
    done("$TOFGRAPH diagnose --model ideal.yaml --data c/campaign.yaml -o plain --quiet");
    done("$TOFGRAPH diagnose --model ideal.yaml --data c/campaign.yaml -o whole --confidence 2 --quiet");
  }
  static void TearDownTestSuite() { home_.reset(); }

  static std::filesystem::path home() { return home_->path(); }
  static Outcome run(const std::string& command) { return shell(command, home()); }
  static Outcome done(const std::string& command) {
    Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 0) << command << "\n" << outcome.out << outcome.err;
    return outcome;
  }
  /// SHA-256 of the report without the names of the input files and the campaign's own, and of the model.
  static std::string result_of(const std::string& folder) {
    nlohmann::json report = nlohmann::json::parse(read_text(home() / folder / "report.json"), nullptr, false);
    if (!report.is_object()) return folder + " has no report";
    report["inputs"].erase(1);
    for (auto& input : report["inputs"]) input.erase("file");
    return tofgraph::io::sha256_of(report.dump(1) + read_text(home() / folder / "model.yaml"));
  }
  static std::string batch(const std::string& engine, const std::string& job, int tasks = shards, int cases = 2) {
    return "$TOFGRAPH batch c/campaign.yaml --model ideal.yaml --engine " + engine + " --shards " +
           std::to_string(tasks) + " --confidence " + std::to_string(cases) + " -o " + job;
  }
  static std::size_t statistics_in(const std::filesystem::path& folder) {
    std::size_t count = 0;
    for (const std::string& name : listing(folder)) count += name.ends_with(".stats") ? 1U : 0U;
    return count;
  }

 private:
  static inline std::unique_ptr<TemporaryFolder> home_;
};

}  // namespace tofgraph::tests
