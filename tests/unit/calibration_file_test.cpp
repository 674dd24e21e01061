// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Calibration files: written values are read back; errors in a file are reported with their position.
#include <gtest/gtest.h>

#include <cmath>

#include "io/offset_calibration.hpp"
#include "io/profile.hpp"
#include "tests/program.hpp"

namespace tofgraph::io {
namespace {

using tests::TemporaryFolder;
using tests::write_text;

const std::filesystem::path shipped = TOFGRAPH_SOURCE_DIR "/devices/calibrations/camcube2_offset.yaml";

CameraPtr camcube2() {
  config::Diagnostics diagnostics;
  return find_camera(config::parse_value("camcube2", {}), diagnostics);
}

/// Message for the shipped calibration after a replacement in its text.
std::string mistake(const std::string& what, const std::string& by) {
  const TemporaryFolder folder;
  std::string text = tests::read_text(shipped);
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  write_text(folder.path() / "offset.yaml", text.replace(at, what.size(), by));
  try {
    read_offset_calibration(folder.path() / "offset.yaml", camcube2()->view());
  } catch (const config::ConfigurationError& error) {
    return error.what();
  }
  return "no error";
}

TEST(CalibrationFile, WhatIsWrittenIsReadAgain) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "offset.yaml";
  OffsetCalibration written{.camera = "camcube2",
                            .serial = "C 7",
                            .modulation_frequency = 20e6,
                            .gain = 7e6,
                            .variant = OffsetVariant::printed,
                            .targets = {"white", "50 % black"},
                            .samples = {{0, 0.5, 0.50766, 0.5e-3, 0.85}, {1, 1, 0.99409, 3e-3, 0.455}},
                            .depth_sd = {1e-5, 2e-5},
                            .falloff = {-1.5, 0.25}};
  CalibrationWriter writer(file, "offset", "camcube2", written.serial);
  write_text(folder.path() / "a.csv", "x");
  writer.input(folder.path() / "a.csv");
  write_offset_calibration(written, writer);
  write_text(file, writer.text());
  const OffsetCalibration read = read_offset_calibration(file, camcube2()->view());
  EXPECT_EQ(read.serial, "C 7");
  EXPECT_EQ(read.variant, OffsetVariant::printed);
  EXPECT_EQ(read.targets, written.targets);
  EXPECT_EQ(read.falloff, written.falloff);
  ASSERT_EQ(read.samples.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read.samples[i].target, i);
    EXPECT_NEAR(read.samples[i].distance, written.samples[i].distance, 1e-9);
    EXPECT_NEAR(read.samples[i].depth, written.samples[i].depth, 1e-9);
    EXPECT_NEAR(read.samples[i].integration_time, written.samples[i].integration_time, 1e-12);
    EXPECT_NEAR(read.samples[i].reflectivity, written.samples[i].reflectivity, 1e-7);
    EXPECT_NEAR(read.depth_sd[i], written.depth_sd[i], 1e-12);
  }
  // sha256 of "x"; path relative to the file's folder
  EXPECT_NE(
      writer.text().find("{file: a.csv, sha256: 2d711642b726b04401627ca9fbac32f5c8530fb1903cc4db02258717921a4881}"),
      std::string::npos)
      << writer.text();
}

TEST(CalibrationFile, MistakesAreToldWithTheirPlace) {
  EXPECT_EQ(mistake("kind: offset", "kind: offset"), "no error");
  const std::string frequency = mistake("{value: 20 MHz}", "{value: 30 MHz}");
  EXPECT_NE(frequency.find("the calibration is for 30 MHz, the camera 'camcube2' works at 20 MHz"), std::string::npos)
      << frequency;
  EXPECT_NE(frequency.find("offset.yaml:"), std::string::npos);
  const std::string kind = mistake("kind: offset", "kind: intrinsics");
  EXPECT_NE(kind.find("expected 'offset'"), std::string::npos) << kind;
  const std::string length = mistake("value: [0.5, 2, 3,", "value: [2, 3,");
  EXPECT_NE(length.find("'integration_time' has 83 numbers, but the other columns of the table have 84"),
            std::string::npos)
      << length;
  const std::string unit = mistake("unit: ms", "unit: mm");
  EXPECT_NE(unit.find("a number of 'integration_time' is"), std::string::npos) << unit;
  const std::string key = mistake("  depth:\n", "  dept:\n");
  EXPECT_NE(key.find("dept"), std::string::npos) << key;
  const std::string targets = mistake("targets: [white, ", "targets: [");
  EXPECT_NE(targets.find("there is no such target"), std::string::npos) << targets;
  const std::string negative = mistake("value: [500, 1000,", "value: [-500, 1000,");
  EXPECT_NE(negative.find("must be positive"), std::string::npos) << negative;
}

}  // namespace
}  // namespace tofgraph::io
