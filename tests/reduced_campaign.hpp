// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A small campaign `c` and its folder of statistics `s`, for tests of reduce, merge and diagnose.
#pragma once

#include "tests/small_campaign.hpp"
#include "tests/unit/full_disk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

namespace tofgraph::tests {

class ReducedCampaign : public SmallCampaign {
 protected:
  static void SetUpTestSuite() {
    simulate(3, "taps");
    done("$TOFGRAPH reduce c/campaign.yaml -o s --quiet");
  }
  /// Report of a search without the name and hash of the campaign file, and the model.
  static std::string result_of(const std::string& folder) {
    nlohmann::json report = nlohmann::json::parse(read_text(home() / folder / "report.json"));
    EXPECT_GE(report["inputs"].size(), 2 + conditions);
    report["inputs"].erase(1);
    return report.dump(1) + read_text(home() / folder / "model.yaml");
  }
  static void search(const std::string& data, const std::string& out, const std::string& more = "") {
    done("$TOFGRAPH diagnose --model ideal.yaml --data " + data + " -o " + out + " --quiet " + more);
  }
  /// Path of the first statistics file.
  static std::filesystem::path first_file(const std::string& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(home() / folder))
      if (entry.path().extension() == ".stats") files.push_back(entry.path());
    std::ranges::sort(files);
    return files.at(0);
  }
  static void copy(const std::string& from, const std::string& to) {
    std::filesystem::remove_all(home() / to);
    std::filesystem::copy(home() / from, home() / to, std::filesystem::copy_options::recursive);
  }
  static void damage(const std::filesystem::path& file, std::streamoff at) {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekg(at);
    const char byte = static_cast<char>(stream.get() ^ 0x10);
    stream.seekp(at);
    stream.put(byte);
  }
};

}  // namespace tofgraph::tests
