// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Captures written with HDF5's own interface: the values read equal the stored ones, errors are named.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <tofgraph/array.hpp>

#include <algorithm>
#include <cstring>

#include "io/captures/capture.hpp"
#include "tests/program.hpp"
#include "tests/unit/capture_fixture.hpp"
#include "tests/unit/full_disk.hpp"
#include "tests/unit/raw_capture.hpp"

namespace tofgraph::tests {
namespace {

using io::CaptureReader;
namespace fs = std::filesystem;

const fs::path recording = TOFGRAPH_SOURCE_DIR "/pipelines/data/o3d303_scene.h5";

/// Two frames of 3 x 2 range images, values 0.5, 0.75, ..
std::vector<float> ramp(std::size_t count) {
  std::vector<float> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = 0.5F + 0.25F * static_cast<float>(i);
  return values;
}

TEST_F(CaptureFile, ReadsWhatIsStored) {
  RawCapture(path)
      .head(3, 2)
      .text("comment", "on a table")
      .dataset("range", {2, 2, 3}, ramp(12), {1, 2, 3}, "optimized_bistatic offset_correction")
      .dataset<std::uint8_t>("flags", {2, 2, 3}, {0, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 255})
      .dataset<std::int16_t>("phases", {2, 4, 2, 3}, std::vector<std::int16_t>(48, -7))
      .metadata(2, 5e-3);
  const CaptureReader reader(path);
  EXPECT_EQ(reader.header().camera, "test");
  EXPECT_EQ(reader.header().comment, "on a table");
  EXPECT_EQ(reader.header().width, 3U);
  EXPECT_EQ(reader.header().height, 2U);
  EXPECT_EQ(reader.frames(), 2U);
  EXPECT_TRUE(reader.finished());
  ASSERT_EQ(reader.channels().size(), 3U);  // sorted by name
  const io::CaptureChannel &flags = reader.channels()[0], &phases = reader.channels()[1], &range = reader.channels()[2];
  EXPECT_EQ(range.applied, "optimized_bistatic offset_correction");
  EXPECT_EQ(range.unit, "m");
  EXPECT_EQ(phases.type, static_cast<std::uint32_t>(TOFGRAPH_TYPE_I16));
  EXPECT_EQ(flags.type, static_cast<std::uint32_t>(TOFGRAPH_TYPE_U16));
  std::vector<float> values(6);
  reader.read(2, 1, values.data());
  EXPECT_EQ(values, std::vector<float>({2, 2.25, 2.5, 2.75, 3, 3.25}));
  std::vector<std::uint16_t> bits(6);
  reader.read(0, 1, bits.data());
  EXPECT_EQ(bits, std::vector<std::uint16_t>({0, 0, 0, 0, 0, 255}));
}

TEST_F(CaptureFile, GivesMetadataInSiAndSaysWhatIsKnown) {
  RawCapture(path)
      .head(2, 1)
      .dataset("depth", {3, 1, 2}, ramp(6))
      .dataset<std::int64_t>("timestamp_ns", {3}, {10, 11, 0})
      .dataset<double>("integration_time_s", {3}, {1e-3, 2e-3, 3e-3})
      .dataset<double>("modulation_frequency_hz", {3}, {20e6, std::nan(""), 20e6})
      .dataset<float>("temperature_c", {3}, {25, -10, 0})
      .dataset<double>("time_since_power_on_s", {3}, {1, 2, 3})
      .dataset<std::uint64_t>("frame_number", {3}, {5, 6, 9});
  const CaptureReader reader(path);
  const tofgraph_metadata second = reader.metadata(1);
  EXPECT_EQ(second.timestamp_ns, 11);
  EXPECT_EQ(second.integration_time, 2e-3);
  EXPECT_TRUE(std::isnan(second.modulation_frequency));
  EXPECT_DOUBLE_EQ(second.temperature, 263.15);
  EXPECT_EQ(second.time_since_power_on, 2);
  EXPECT_EQ(reader.metadata(2).device_number, 9U);
  constexpr unsigned always =
      0U | TOFGRAPH_KNOWS_INTEGRATION_TIME | TOFGRAPH_KNOWS_TEMPERATURE | TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON;
  EXPECT_EQ(reader.known(0, 2), always);
  EXPECT_EQ(reader.known(1, 1), always | TOFGRAPH_KNOWS_TIMESTAMP);
  EXPECT_EQ(reader.known(2, 2), always | TOFGRAPH_KNOWS_MODULATION_FREQUENCY);
}

TEST_F(CaptureFile, AClockMayStartAtZero) {
  const auto knows_time = [&](std::int64_t second) {
    RawCapture(path)
        .head(2, 1)
        .dataset("depth", {2, 1, 2}, ramp(4))
        .dataset<std::int64_t>("timestamp_ns", {2}, {0, second})
        .dataset<double>("integration_time_s", {2}, {1e-3, 1e-3})
        .dataset<double>("modulation_frequency_hz", {2}, {20e6, 20e6})
        .dataset<float>("temperature_c", {2}, {25, 25})
        .dataset<double>("time_since_power_on_s", {2}, {1, 2});
    return (CaptureReader(path).known(0, 1) & TOFGRAPH_KNOWS_TIMESTAMP) != 0;
  };
  EXPECT_TRUE(knows_time(11));
  EXPECT_FALSE(knows_time(0));
}

TEST_F(CaptureFile, TheRealRecordingIsReadBitForBit) {
  const CaptureReader reader(recording);
  EXPECT_EQ(reader.header().camera, "o3d303");
  EXPECT_EQ(reader.frames(), 3U);
  std::size_t invalid = 0;
  for (std::size_t c = 0; c < reader.channels().size(); ++c) {
    const io::CaptureChannel& channel = reader.channels()[c];
    if (channel.type != TOFGRAPH_TYPE_F32) continue;
    const auto expected = raw_values<float>(recording, "/frames/" + channel.name);
    std::vector<float> all(3 * channel.elements());
    for (std::size_t f = 0; f < 3; ++f) reader.read(c, f, all.data() + f * channel.elements());
    EXPECT_EQ(std::memcmp(all.data(), expected.data(), all.size() * sizeof(float)), 0) << channel.name;
    if (channel.name == "range")
      invalid = static_cast<std::size_t>(std::ranges::count_if(all, [](float v) { return std::isnan(v); }));
  }
  EXPECT_EQ(invalid, 319U);
  EXPECT_DOUBLE_EQ(reader.metadata(1).integration_time, 5e-3);
}

TEST_F(CaptureFile, NumbersOfMatlabAreNumbersToo) {
  RawCapture(path)
      .text("format", "tofgraph-capture")
      .text("camera", "test")
      .number("version", 1.0)
      .number("width", 3.0)
      .number("height", 2.0)
      .group()
      .dataset("range", {1, 2, 3}, ramp(6))
      .metadata(1);
  EXPECT_EQ(CaptureReader(path).header().width, 3U);
}

TEST_F(CaptureFile, UnknownDatasetsAreChannelsOrLeftOut) {
  RawCapture(path)
      .head(3, 2)
      .dataset("range", {2, 2, 3}, ramp(12))
      .dataset("confidence", {2, 2, 3}, ramp(12))
      .dataset<double>("voltage", {2}, {1, 2})
      .dataset("average", {1, 2, 3}, ramp(6))
      .metadata(2);
  const CaptureReader reader(path);
  ASSERT_EQ(reader.channels().size(), 2U);
  EXPECT_EQ(reader.channels()[1].name, "confidence");
  EXPECT_EQ(reader.ignored(), std::vector<std::string>({"average", "voltage"}));
}

// Errors in a file are named.

TEST_F(CaptureFile, NoFile) {
  expect_words(why(), {path.string(), "there is no such file"});
  write_text(path.string() + ".part", "");
  expect_words(why(), {"a.h5.part does: a recording that is still running or was cut off"});
  path = folder.path();
  expect_words(why(), {"is not a file"});
}

TEST_F(CaptureFile, EmptyOrNotHdf5) {
  write_text(path, "");
  expect_words(why(), {path.string(), "is empty"});
  write_text(path, std::string(10000, 'x'));
  expect_words(why(), {"is not an HDF5 file"});
}

TEST_F(CaptureFile, AnotherFormatOrVersion) {
  { RawCapture(path).head(3, 2, 1, "something-else"); }
  expect_words(why(), {"is HDF5, but not a capture", "'something-else'", "expected 'tofgraph-capture'"});
  { RawCapture(path).head(3, 2, 2); }
  expect_words(why(), {"is a capture of version 2, this program reads version 1"});
  { RawCapture(path).text("format", "tofgraph-capture"); }
  expect_words(why(), {"has no attribute version"});
  { RawCapture(path).number("format", 1.0); }
  expect_words(why(), {"attribute format is not text"});
  { RawCapture(path).head(3, 2, 1, "tofgraph-capture", ""); }
  expect_words(why(), {"has no attribute camera", "camcube2"});
}

TEST_F(CaptureFile, AbsurdDimensions) {
  { RawCapture(path).head(std::int64_t{1} << 40, 2); }
  expect_words(why(), {"width is 1099511627776 px, expected 1 to 16384"});
  { RawCapture(path).head(3, -2); }
  expect_words(why(), {"height is -2 px"});
  { RawCapture(path).text("format", "tofgraph-capture").number("version", 1.5).text("camera", "a").group(); }
  expect_words(why(), {"attribute version is 1.5, expected a whole number"});
}

TEST_F(CaptureFile, NoFramesAndNoMeasurement) {
  {
    RawCapture(path)
        .text("format", "tofgraph-capture")
        .number("version", 1)
        .text("camera", "a")
        .number("width", 3)
        .number("height", 2);
  }
  expect_words(why(), {"has no group /frames"});
  { RawCapture(path).head(3, 2); }
  expect_words(why(), {"/frames holds nothing: at least one of taps, phases, distance, range, depth, amplitude, "
                       "intensity, points is expected"});
  { RawCapture(path).head(3, 2).dataset("sigma", {1, 2, 3}, ramp(6)); }
  expect_words(why(), {"/frames holds sigma: at least one"});
  { RawCapture(path).head(3, 2).dataset<float>("range", {0, 2, 3}, {}, {1, 2, 3}).metadata(0); }
  expect_words(why(), {"holds no frames"});
}

TEST_F(CaptureFile, WronglyShapedChannel) {
  { RawCapture(path).head(3, 2).dataset("range", {1, 3, 2}, ramp(6)).metadata(1); }
  expect_words(why(), {"/frames/range is 1 x 3 x 2 float32, expected 1 x 2 x 3 float32"});
  { RawCapture(path).head(3, 2).dataset("range", {1, 2, 3}, std::vector<double>(6)).metadata(1); }
  expect_words(why(), {"/frames/range is 1 x 2 x 3 float64, expected 1 x 2 x 3 float32"});
  { RawCapture(path).head(3, 2).dataset("phases", {1, 2, 3}, ramp(6)).metadata(1); }
  expect_words(why(),
               {"/frames/phases is 1 x 2 x 3 float32, expected 1 x P (3 to 32) x 2 x 3 float32 or int16 or int32"});
  { RawCapture(path).head(3, 2).dataset("taps", {1, 4, 2, 2, 3}, std::vector<std::int16_t>(48)).metadata(1); }
  expect_words(why(), {"/frames/taps is 1 x 4 x 2 x 2 x 3 int16, expected 1 x P (3 to 32) x 2 x 2 x 3 uint16"});
  {
    RawCapture(path)
        .head(3, 2)
        .dataset("range", {1, 2, 3}, ramp(6))
        .dataset("amplitude", {2, 2, 3}, ramp(12))
        .metadata(1);
  }
  expect_words(why(), {"/frames/range has 1 frame, but /frames/amplitude has 2"});
}

TEST_F(CaptureFile, MissingOrWrongMetadata) {
  { RawCapture(path).head(3, 2).dataset("range", {1, 2, 3}, ramp(6)).metadata(1, 1e-3, "temperature_c"); }
  expect_words(why(), {"has no /frames/temperature_c: 1 values are expected, NaN where it is unknown"});
  { RawCapture(path).head(3, 2).dataset("range", {2, 2, 3}, ramp(12)).metadata(3); }
  expect_words(why(), {"/frames/timestamp_ns has 3 frames, but /frames/range has 2"});
  {
    RawCapture(path)
        .head(3, 2)
        .dataset("range", {1, 2, 3}, ramp(6))
        .metadata(1, 1e-3, "timestamp_ns")
        .dataset<double>("timestamp_ns", {1}, {1});
  }
  expect_words(why(), {"/frames/timestamp_ns is 1 float64, expected one of N whole numbers"});
}

TEST_F(CaptureFile, AThousandMillionFramesThatAreNotThere) {
  constexpr hsize_t many = 1'000'000'000;
  for (const std::vector<hsize_t>& chunk : {std::vector<hsize_t>{1, 2, 3}, std::vector<hsize_t>{}}) {
    { RawCapture(path).head(3, 2).dataset<float>("range", {many, 2, 3}, {}, chunk).metadata(1); }
    EXPECT_LT(fs::file_size(path), 100'000U);
    expect_words(why(), {"/frames/range announces 1000000000 frames, but 0 are stored"});
  }
  {
    RawCapture(path)
        .head(3, 2)
        .dataset("range", {2, 2, 3}, ramp(12))
        .metadata(2, 1e-3, "integration_time_s")
        .dataset<double>("integration_time_s", {many}, {}, {1024});
  }
  expect_words(why(), {"/frames/integration_time_s announces 1000000000 frames, but 0 are stored"});
}

TEST_F(CaptureFile, OneChunkForEverything) {
  { RawCapture(path).head(3, 2).dataset<float>("range", {10000000, 2, 3}, {}, {10000000, 2, 3}).metadata(1); }
  expect_words(why(), {"/frames/range is stored in chunks of 10000000 x 2 x 3, 240000000 bytes each", "h5repack"});
}

TEST_F(CaptureFile, NothingElsewhereIsFollowed) {
  const fs::path other = folder.path() / "other.h5";
  { RawCapture(other).head(3, 2).dataset("range", {1, 2, 3}, ramp(6)); }
  {
    RawCapture capture(path);
    capture.head(3, 2).metadata(1);
    H5Lcreate_external(other.c_str(), "/frames/range", capture.frames_group(), "range", H5P_DEFAULT, H5P_DEFAULT);
  }
  expect_words(why(),
               {"at least one of taps, phases, distance, range, depth, amplitude, intensity, points is expected"});
}

}  // namespace
}  // namespace tofgraph::tests
