// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A small simulated campaign `c`, 12 conditions, and the model `ideal.yaml` without its wiggling.
#pragma once

#include "tests/program.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace tofgraph::tests {

class SmallCampaign : public testing::Test {
 protected:
  static constexpr std::size_t conditions = 12;

  /// @param output of the simulated camera, as stated in a scene
  static void simulate(int frames, const std::string& output) {
    home_ = std::make_unique<TemporaryFolder>();
    write_text(home() / "scene.yaml",
               "scene: 1\nname: small campaign\ncamera: camcube2\nframes: " + std::to_string(frames) +
                   "\noutput: " + output +
                   "\nseed: 3\n"
                   "model: {light: reference, effects: [{effect: wiggling, amplitude: 6 mm, phase: 0.4 rad}]}\n"
                   "objects:\n  - {name: board, type: board, distance: 500 mm, reflectivity: 0.8}\n"
                   "sequence:\n"
                   "  - {key: board.distance, values: [600 mm, 800 mm, 1000 mm, 1200 mm, 1400 mm, 1600 mm]}\n"
                   "  - {key: integration_time, values: [0.5 ms, 1 ms]}\n");
    write_text(home() / "ideal.yaml", "model: 1\ncamera: camcube2\nlight: reference\neffects: []\n");
    done("$TOFGRAPH simulate scene.yaml -o c --quiet");
  }
  static void TearDownTestSuite() { home_.reset(); }

  static std::filesystem::path home() { return home_->path(); }
  static Outcome run(const std::string& command) { return shell(command, home()); }
  static Outcome done(const std::string& command) {
    Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 0) << command << "\n" << outcome.out << outcome.err;
    return outcome;
  }

 private:
  static inline std::unique_ptr<TemporaryFolder> home_;
};

}  // namespace tofgraph::tests
