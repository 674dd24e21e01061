// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A small campaign `c` and its folder of statistics `s`, for tests of reduce, merge and diagnose.
#pragma once

#include "tests/unit/full_disk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::tests {

class ReducedCampaign : public testing::Test {
 protected:
  static constexpr std::size_t conditions = 12;

  static void SetUpTestSuite() {
    home_ = std::make_unique<TemporaryFolder>();
    write_text(home() / "scene.yaml",
               "scene: 1\nname: small campaign\ncamera: camcube2\nframes: 3\noutput: taps\nseed: 3\n"
               "model: {light: reference, effects: [{effect: wiggling, amplitude: 6 mm, phase: 0.4 rad}]}\n"
               "objects:\n  - {name: board, type: board, distance: 500 mm, reflectivity: 0.8}\n"
               "sequence:\n"
               "  - {key: board.distance, values: [600 mm, 800 mm, 1000 mm, 1200 mm, 1400 mm, 1600 mm]}\n"
               "  - {key: integration_time, values: [0.5 ms, 1 ms]}\n");
    write_text(home() / "ideal.yaml", "model: 1\ncamera: camcube2\nlight: reference\neffects: []\n");
    done("$TOFGRAPH simulate scene.yaml -o c --quiet");
    done("$TOFGRAPH reduce c/campaign.yaml -o s --quiet");
  }
  static void TearDownTestSuite() { home_.reset(); }

  static std::filesystem::path home() { return home_->path(); }
  static Outcome run(const std::string& command) { return shell(command, home()); }
  static Outcome done(const std::string& command) {
    Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 0) << command << "\n" << outcome.err;
    return outcome;
  }
  /// The report of a search without the name and hash of the campaign's own file, and the model.
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

 private:
  static inline std::unique_ptr<TemporaryFolder> home_;
};

}  // namespace tofgraph::tests
