// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A small campaign that is reduced and searched in parts, as tasks, jobs or ranks.
#pragma once

#include "io/sha256.hpp"
#include "tests/small_campaign.hpp"
#include "tests/unit/full_disk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <string>

namespace tofgraph::tests {

inline bool is_installed(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null").c_str()) == 0;
}

/// A small simulated campaign, and the reports of a single process: `plain`, and `whole` with two confidence cases.
class DividedCampaign : public SmallCampaign {
 protected:
  static constexpr int shards = 6;

  static void SetUpTestSuite() {
    simulate(40, "phases");
    done("$TOFGRAPH diagnose --model ideal.yaml --data c/campaign.yaml -o plain --quiet");
    done("$TOFGRAPH diagnose --model ideal.yaml --data c/campaign.yaml -o whole --confidence 2 --quiet");
  }
  /// SHA-256 of the model and of the report, excluding the names of the input files and of the campaign.
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
};

}  // namespace tofgraph::tests
