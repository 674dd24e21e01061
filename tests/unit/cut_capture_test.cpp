// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: CutCapture.EveryWhole*
// Rooms: io
// Captures that are shorter than they were: repair keeps the frames whose chunks are whole.
#include <gtest/gtest.h>
#include <hdf5.h>

#include "io/captures/repair.hpp"
#include "tests/unit/capture_fixture.hpp"
#include "tests/unit/raw_capture.hpp"

#include <cmath>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t side = 32, frames = 10, frame = side * side;

/// Each frame holds its number and the pixel's; metadata come after the channels, as a program without tofgraph writes.
class CutCapture : public CaptureFile {
 protected:
  void write() const {
    std::vector<float> range(frames * frame), amplitude(frames * frame);
    for (std::size_t i = 0; i < range.size(); ++i) {
      range[i] = static_cast<float>(i);
      amplitude[i] = 1 + static_cast<float>(i);
    }
    RawCapture capture(path);
    capture.head(side, side).metadata(frames, 2e-3);
    capture.dataset("range", {frames, side, side}, range, {1, side, side});
    capture.dataset("amplitude", {frames, side, side}, amplitude, {1, side, side});
  }
  fs::path mended = folder.path() / "mended.h5";
};

TEST_F(CutCapture, EveryWholeFrameIsKeptWhereverTheFileEnds) {
  write();
  const std::uintmax_t whole = fs::file_size(path);
  std::size_t repaired = 0, most = 0;
  for (std::uintmax_t size = whole - 1; size > 2048; size -= std::min<std::uintmax_t>(size, 3000)) {
    fs::resize_file(path, size);
    fs::remove(mended);
    io::Repaired result;
    try {
      result = io::repair_capture(path, mended, false);
    } catch (const std::runtime_error& problem) {
      EXPECT_NE(std::string(problem.what()).find("was cut off"), std::string::npos) << problem.what();
      EXPECT_FALSE(fs::exists(mended));
      continue;
    }
    ++repaired;
    most = std::max(most, result.frames);
    ASSERT_GE(result.frames, 1U);
    EXPECT_EQ(result.frames + result.lost, frames);
    const io::CaptureReader reader(mended);
    ASSERT_EQ(reader.frames(), result.frames);
    EXPECT_TRUE(reader.finished());
    for (std::size_t c = 0; c < reader.channels().size(); ++c) {
      std::vector<float> values(frame);
      for (std::size_t f = 0; f < result.frames; ++f) {
        reader.read(c, f, values.data());
        const float more = reader.channels()[c].name == "amplitude" ? 1 : 0;
        for (std::size_t i = 0; i < frame; ++i) ASSERT_EQ(values[i], static_cast<float>(f * frame + i) + more);
      }
    }
    // Metadata that are lost are unknown, never zero.
    const double time = reader.metadata(0).integration_time;
    EXPECT_TRUE(std::isnan(time) || time == 2e-3) << time;
  }
  EXPECT_GE(repaired, 5U);
  EXPECT_GE(most, 8U);
}

TEST_F(CutCapture, AWholeCaptureLosesNothing) {
  write();
  const io::Repaired result = io::repair_capture(path, mended, false);
  EXPECT_EQ(result.frames, frames);
  EXPECT_EQ(result.lost, 0U);
}

TEST_F(CutCapture, ARecordingOfThisProgramIsRepairedToo) {
  {
    io::CaptureHeader header;
    header.camera = "test";
    header.width = header.height = side;
    io::CaptureWriter writer(path, header, {{"range", TOFGRAPH_TYPE_F32, {side, side}, "m", "", "", ""}});
    for (std::size_t i = 0; i < 40; ++i) append_frame(writer, side, i, i);
    writer.finish();
  }
  fs::resize_file(path, fs::file_size(path) * 6 / 10);
  const io::Repaired result = io::repair_capture(path, mended, false);
  EXPECT_GE(result.frames, 15U);
  EXPECT_EQ(result.frames + result.lost, 40U);
  const io::CaptureReader reader(mended);
  std::vector<float> values(frame);
  for (std::size_t f = 0; f < result.frames; ++f) {
    reader.read(0, f, values.data());
    for (const float value : values) ASSERT_EQ(value, static_cast<float>(f + 1));
  }
}

TEST_F(CutCapture, WhatIsNotHdf5IsNotExtended) {
  write_text(path, std::string(5000, 'x'));
  const std::string problem = thrown([&] { io::repair_capture(path, mended, false); });
  EXPECT_NE(problem.find("is not an HDF5 file"), std::string::npos) << problem;
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder.path())) ++files;
  EXPECT_EQ(files, 1U) << "no temporary file is left";
}

}  // namespace
}  // namespace tofgraph::tests
