// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The stage capture_writer, examined with HDF5's own interface.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <tofgraph/harness.hpp>

#include <cmath>

#include "tests/program.hpp"
#include "tests/unit/cameras.hpp"
#include "tests/unit/full_disk.hpp"
#include "tests/unit/raw_capture.hpp"

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

class WriterStage : public testing::Test {
 protected:
  TemporaryFolder folder;
  fs::path path = folder.path() / "out" / "a.h5";
  std::string line(const std::string& more = {}) const { return "capture_writer path=" + path.string() + " " + more; }

  /// Frame `number` of a 3 x 2 camera.
  static void put(Harness& stage, int number) {
    const auto n = static_cast<float>(number);
    stage.put<float>("depth", {2, 3}, std::vector<float>(6, n), {.applied = "optimized_bistatic", .from = "distance"});
    stage.put<std::uint16_t>("flags", {2, 3}, std::vector<std::uint16_t>(6, 1024));
    stage.put<std::uint16_t>("taps", {4, 2, 2, 3}, std::vector<std::uint16_t>(48, static_cast<std::uint16_t>(number)));
    stage.put<float>("sigma", {2, 3}, std::vector<float>(6, n / 100), {.of = "depth"});
    stage.metadata().integration_time = 1e-3 * number;
    stage.metadata().temperature = 273.15 + number;
    stage.metadata().timestamp_ns = number;
    stage.metadata().device_number = static_cast<std::uint64_t>(10 * number);
  }
  std::string why(const std::string& more, const std::function<void(Harness&)>& with) const {
    return thrown([&] {
      Harness stage(line(more));
      with(stage);
      stage.prepare();
    });
  }
};

void expect_words(const std::string& message, const std::string& words) {
  EXPECT_NE(message.find(words), std::string::npos) << words << " is not in: " << message;
}

TEST_F(WriterStage, WritesAllChannelsWithTheirMeaning) {
  const test::Camera small(3, 2, 12.8e-3, 40e-6, {{"lamp", {0, 0, 0}, 1}});
  const fs::path profile = test::profile_of(small.view);
  for (const char* options : {"comment='on a table'", "comment='on a table' compression=6 overwrite=true"}) {
    Harness stage(line(options));
    stage.camera(profile);
    for (int i = 1; i <= 3; ++i) {
      put(stage, i);
      stage.run();
    }
    EXPECT_TRUE(fs::exists(path.string() + ".part")) << "the name is given at the end";
    stage.finish();
    EXPECT_EQ(listing(path.parent_path()), std::vector<std::string>{"a.h5"});

    std::vector<float> depth;
    for (const float value : {1.0F, 2.0F, 3.0F}) depth.insert(depth.end(), 6, value);
    EXPECT_EQ(raw_values<float>(path, "/frames/depth"), depth);
    EXPECT_EQ(raw_values<std::uint16_t>(path, "/frames/flags"), std::vector<std::uint16_t>(18, 1024));
    EXPECT_EQ(raw_values<std::uint16_t>(path, "/frames/taps").back(), 3);
    EXPECT_EQ(raw_values<double>(path, "/frames/integration_time_s"), std::vector<double>({1e-3, 2e-3, 3e-3}));
    EXPECT_EQ(raw_values<std::uint64_t>(path, "/frames/frame_number"), std::vector<std::uint64_t>({10, 20, 30}));
    const auto celsius = raw_values<float>(path, "/frames/temperature_c");
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(celsius[i], static_cast<double>(i + 1), 1e-6);
    EXPECT_TRUE(std::isnan(raw_values<double>(path, "/frames/modulation_frequency_hz")[0]));
    EXPECT_EQ(raw_text(path, "/", "camera"), "test");
    EXPECT_EQ(raw_text(path, "/", "profile"), read_text(profile));
    EXPECT_EQ(raw_text(path, "/", "comment"), "on a table");
    EXPECT_EQ(raw_text(path, "/frames/depth", "applied"), "optimized_bistatic");
    EXPECT_EQ(raw_text(path, "/frames/depth", "from"), "distance");
    EXPECT_EQ(raw_text(path, "/frames/sigma", "of"), "depth");
    EXPECT_EQ(raw_values<std::int64_t>(path, "/frames/timestamp_ns"), std::vector<std::int64_t>({1, 2, 3}));
  }
}

TEST_F(WriterStage, WritesWhatIsAskedForAndNeverTheRays) {
  const test::Camera small(3, 2, 12.8e-3, 40e-6, {{"lamp", {0, 0, 0}, 1}});
  Harness stage(line("channels=[depth,flags]"));
  stage.camera(test::profile_of(small.view));
  put(stage, 1);
  stage.run();
  stage.finish();
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  EXPECT_GT(H5Lexists(file, "/frames/depth", H5P_DEFAULT), 0);
  EXPECT_GT(H5Lexists(file, "/frames/flags", H5P_DEFAULT), 0);
  EXPECT_EQ(H5Lexists(file, "/frames/taps", H5P_DEFAULT), 0);
  EXPECT_EQ(H5Lexists(file, "/frames/rays", H5P_DEFAULT), 0);
  H5Fclose(file);
  path = folder.path() / "b.h5";
  expect_words(why("channels=[depth,range]", [](Harness& s) { put(s, 1); }),
               "parameter 'channels': 'range' cannot be recorded: what arrives has depth, flags, taps, sigma");
  expect_words(why("channels=[rays]", [](Harness& s) { put(s, 1); }), "'rays' cannot be recorded");
  expect_words(why("channels=[flags]", [](Harness& s) { put(s, 1); }),
               "a capture needs at least one of taps, phases, distance, range, depth");
}

TEST_F(WriterStage, ChecksEverythingBeforeTheFirstFrameAndTouchesNothing) {
  expect_words(why("",
                   [](Harness& s) {
                     put(s, 1);
                     s.put<float>("amplitude", {3, 3}, std::vector<float>(9));
                   }),
               "'amplitude' has 3 px, but the channels before it have 2");
  expect_words(why("",
                   [](Harness& s) {
                     put(s, 1);
                     s.put<float>("spectrum", {7}, std::vector<float>(7));
                   }),
               "'spectrum' is not an image: a capture holds images that keep their size");
  expect_words(why("",
                   [](Harness& s) {
                     s.put<float>("points", {1, 5, 3}, std::vector<float>(15));
                   }),
               "a capture needs at least one of taps, phases, distance, range, depth");
  Harness stage(line());
  put(stage, 1);
  stage.prepare();
  EXPECT_FALSE(fs::exists(path.parent_path()));
}

TEST_F(WriterStage, ExistingCapturesAreNotReplacedUnlessAllowed) {
  write_text(path, "precious");
  const auto with_frame = [](Harness& s) { put(s, 1); };
  const std::string hint = " already exists: --force or overwrite: true allows it to be replaced";
  expect_words(why("", with_frame), "parameter 'path': " + path.string() + hint);
  fs::rename(path, path.string() + ".part");
  for (const bool forced : {false, true}) {
    const std::string message = why(forced ? "overwrite=true" : "", [&](Harness& s) {
      s.overwrite(forced);
      put(s, 1);
    });
    expect_words(message, "parameter 'path': " + path.string() + ".part already exists");
    expect_words(message, "read it (capture_reader file=" + path.string() +
                              ".part), make a capture of it (tofgraph repair " + path.string() + ".part)");
  }
  EXPECT_EQ(read_text(path.string() + ".part"), "precious");
}

TEST_F(WriterStage, SaysThatNoFrameArrived) {
  Harness stage(line());
  put(stage, 1);
  stage.prepare();
  stage.finish();
  EXPECT_EQ(stage.messages(), std::vector<std::string>{"no frames arrived: " + path.string() + " is not written"});
  EXPECT_FALSE(fs::exists(path));
}

TEST_F(WriterStage, WhatItWritesIsReadBackAlike) {
  Harness writer(line("compression=1"));
  put(writer, 2);
  writer.run();
  writer.finish();
  Harness reader("capture_reader file=" + path.string());
  ASSERT_TRUE(reader.run());
  EXPECT_EQ(reader.get<float>("depth"), std::vector<float>(6, 2));
  EXPECT_EQ(reader.get<std::uint16_t>("taps"), std::vector<std::uint16_t>(48, 2));
  EXPECT_EQ(reader.applied("depth"), "optimized_bistatic");
  EXPECT_EQ(reader.of("sigma"), "depth");
}

TEST_F(WriterStage, AFullDiskEndsTheRunAndNothingHasTheFinalName) {
  const SmallDisk disk("3m");
  if (!disk.available()) GTEST_SKIP() << "no right to mount a small disk";
  const std::string file = (disk.path() / "a.h5").string();
  const Outcome outcome =
      shell("\"$TOFGRAPH\" run 'simulator noise=none frames=0 ! capture_writer path=" + file + "' --camera camcube2",
            folder.path());
  EXPECT_EQ(outcome.exit_code, 1);
  expect_words(outcome.err, "node 'capture_writer' (capture_writer), frame ");
  EXPECT_EQ(outcome.err.find("HDF5-DIAG"), std::string::npos) << outcome.err;
  EXPECT_EQ(listing(disk.path()), std::vector<std::string>{"a.h5.part"});
  const Outcome rest = shell("\"$TOFGRAPH\" run 'capture_reader file=" + file + ".part ! null'", folder.path());
  EXPECT_EQ(rest.exit_code, 0) << rest.err;
}

}  // namespace
}  // namespace tofgraph::tests
