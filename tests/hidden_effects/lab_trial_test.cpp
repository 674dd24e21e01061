// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: *
// Rooms: calibration simulation plugins cli
// A camera with all errors at once, with physics independent of the simulator, calibrated end to end with the camera
// folder, starting from raw dumps of another program, and evaluated with surfaces that no calibration used: one camera
// of tests/hidden_effects/lab_trial.py.
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <cmath>

namespace tofgraph::tests {
namespace {

/// Figures of the camera of seed 1. @param more options of the script
nlohmann::json figures(const std::string& more) {
  const TemporaryFolder folder;
  const Outcome outcome = shell("python3 '" TOFGRAPH_SOURCE_DIR
                                "/tests/hidden_effects/lab_trial.py' --build \"${TOFGRAPH%/bin/*}\" --last "
                                "--foreign --seeds 1 -o trial" +
                                    more,
                                folder.path());
  EXPECT_LT(outcome.exit_code, 2) << outcome.err;
  return nlohmann::json::parse(read_text(folder.path() / "trial/trial.json"))["1"]["figures"];
}

TEST(LabTrial, ADirtyCameraIsCalibratedFromRawDumpsToClouds) {
  const nlohmann::json result = figures("");
  EXPECT_LE(result["mean_bias"].get<double>(), 0.8) << "mm";
  EXPECT_LE(result["worst_bias"].get<double>(), 2) << "mm";
  EXPECT_LE(result["flatness"].get<double>(), 1.5) << "mm";
  EXPECT_LE(result["corner"].get<double>(), 0.3) << "deg";
  EXPECT_LE(result["cold"].get<double>(), 1) << "mm";
  EXPECT_LE(std::abs(result["sigma"].get<double>()), 10) << "% of the real spread";
  EXPECT_LE(std::abs(result["above_limit"].get<double>()), 10) << "% above the closed form of shot and read noise";
  EXPECT_LE(result["slowest"].get<double>(), 60) << "s";
}

TEST(LabTrial, NoiseOfSingleFramesIsNearTheShotNoiseLimit) {
  const nlohmann::json result = figures(" --shot-limited");
  EXPECT_LE(result["mean_bias"].get<double>(), 1) << "mm";
  EXPECT_LE(std::abs(result["above_limit"].get<double>()), 10) << "% above the closed form of shot noise alone";
}

}  // namespace
}  // namespace tofgraph::tests
