// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: io plugins
// Captures state the light sources that were on, and the distance models use only these. The board is that of tables
// 5.1 and 5.2 of the reference: one of the two LED arrays is on.
#include "tests/program.hpp"

#include <hdf5.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace tofgraph::tests {
namespace {

constexpr double distance = 0.445609;  // m

class Sources : public testing::Test {
 protected:
  void SetUp() override {
    write_text(folder.path() / "scene.yaml",
               "scene: 1\ncamera: camcube2\nframes: 1\nintegration_time: 0.5 ms\nnoise: none\n"
               "objects:\n  - {name: board, type: board, distance: 445.609 mm, reflectivity: 0.85}\n"
               "sequence:\n  - {key: sources, values: [left, right, both]}\n");
    const Outcome outcome = run("simulate scene.yaml -o sim --model ideal.yaml");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }

  Outcome run(const std::string& arguments) const {
    write_text(folder.path() / "ideal.yaml", "model: 1\ncamera: camcube2\nlight: reference\neffects: []\n");
    return shell("\"$TOFGRAPH\" " + arguments, folder.path());
  }
  static std::string capture(const std::string& source) {
    const std::string number = source == "left" ? "0000" : source == "right" ? "0001" : "0002";
    return "sim/captures/" + number + "_" + source + ".h5";
  }
  std::string attribute(const std::string& source) const {
    const auto info = nlohmann::json::parse(run("info " + capture(source) + " --json").out);
    return info["sources"].get<std::string>();
  }
  void erase_attribute(const std::string& source) const {
    const hid_t file = H5Fopen((folder.path() / capture(source)).c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    ASSERT_GE(H5Adelete(file, "sources"), 0);
    H5Fclose(file);
  }

  struct Depth {
    double mean, sd;  ///< m
  };
  /// Mean and standard deviation over all pixels of the depth from the optimized bistatic model.
  Depth corrected(const std::string& reader) const {
    const Outcome outcome =
        run("run \"" + reader + " ! four_phase_decoder ! optimized_bistatic ! statistics path=depth.json\" --force");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const auto all = nlohmann::json::parse(read_text(folder.path() / "depth.json"));
    const auto& frame = all["inputs"][0];
    return {frame["mean"].get<double>(), frame["sd"].get<double>()};
  }

  TemporaryFolder folder;
};

TEST_F(Sources, ACaptureStatesThemAndTheModelsUseNoOther) {
  EXPECT_EQ(attribute("left"), "left");
  EXPECT_EQ(attribute("right"), "right");
  EXPECT_EQ(attribute("both"), "left, right");
  for (const std::string source : {"left", "right", "both"}) {
    const Depth depth = corrected("capture_reader file=" + capture(source));
    EXPECT_NEAR(depth.mean, distance, 1e-5) << source;
    EXPECT_LT(depth.sd, 1e-5) << source;
  }
}

TEST_F(Sources, ACaptureThatDoesNotStateThemIsToldThem) {
  erase_attribute("left");
  EXPECT_GT(corrected("capture_reader file=" + capture("left")).sd, 4e-3) << "with both sources";
  const Depth told = corrected("capture_reader sources=left file=" + capture("left"));
  EXPECT_NEAR(told.mean, distance, 1e-5);
  EXPECT_LT(told.sd, 1e-5);
  const Outcome unknown = run("run \"capture_reader sources=middle file=" + capture("left") + " ! statistics\"");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err.find("has no source 'middle', it has left, right"), std::string::npos) << unknown.err;
}

TEST_F(Sources, ContradictionsAreErrors) {
  const Outcome told = run("run \"capture_reader sources=right file=" + capture("left") + " ! statistics\"");
  EXPECT_EQ(told.exit_code, 2);
  EXPECT_NE(told.err.find("the capture was recorded with left"), std::string::npos) << told.err;
  write_text(folder.path() / "campaign.yaml", "campaign: 1\ncamera: camcube2\nconditions:\n  - {capture: " +
                                                  capture("left") + ", board: {distance: 445.609 mm}}\n");
  const Outcome check = run("check campaign.yaml");
  EXPECT_EQ(check.exit_code, 2) << check.out << check.err;
  EXPECT_NE(check.err.find("the capture was recorded with left, the condition has all sources"), std::string::npos)
      << check.err;
}

TEST_F(Sources, TravelThroughAPipeline) {
  const Outcome copied = run("run \"capture_reader file=" + capture("right") +
                             " ! four_phase_decoder ! capture_writer path=distance.h5\"");
  ASSERT_EQ(copied.exit_code, 0) << copied.err;
  const auto info = nlohmann::json::parse(run("info distance.h5 --json").out);
  EXPECT_EQ(info["sources"], "right");
  const Outcome outcome =
      run("run \"capture_reader file=distance.h5 ! optimized_bistatic ! statistics path=depth.json\" --force");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
}

TEST_F(Sources, ASceneWithOneSourceIsCorrectedWithIt) {
  write_text(folder.path() / "left.yaml",
             "scene: 1\ncamera: camcube2\nframes: 1\nintegration_time: 0.5 ms\nnoise: none\nsources: left\n"
             "objects:\n  - {name: board, type: board, distance: 445.609 mm, reflectivity: 0.85}\n");
  const Depth depth = corrected("simulator scene=left.yaml model=ideal.yaml");
  EXPECT_NEAR(depth.mean, distance, 1e-5);
  EXPECT_LT(depth.sd, 1e-5);
  const Outcome mixed =
      run("run \"simulator scene=scene.yaml ! four_phase_decoder ! optimized_bistatic ! statistics\"");
  EXPECT_NE(mixed.err.find("conditions differ in the sources that are on"), std::string::npos) << mixed.err;
}

}  // namespace
}  // namespace tofgraph::tests
