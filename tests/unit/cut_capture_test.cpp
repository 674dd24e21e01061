// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: CutCapture.EveryWhole*
// Rooms: io
// Truncated captures: repair keeps the frames whose chunks are complete.
#include <gtest/gtest.h>
#include <hdf5.h>

#include "io/captures/repair.hpp"
#include "tests/unit/capture_fixture.hpp"
#include "tests/unit/raw_capture.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t side = 32, frames = 10, frame = side * side;

/// Each frame holds its number and that of the pixel; metadata follow the channels, as other programs write them.
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
    // Lost metadata are unknown, never zero.
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

/// File offset of the end of each frame, the end of its last chunk, as reported by HDF5.
std::vector<std::uintmax_t> ends_of_frames(const fs::path& file, const std::vector<std::string>& channels) {
  std::vector<std::uintmax_t> ends;
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, H5P_DEFAULT);
  for (const std::string& channel : channels) {
    const hid_t set = H5Dopen2(h5, ("/frames/" + channel).c_str(), H5P_DEFAULT), space = H5Dget_space(set);
    hsize_t size[3] = {}, count = 0;
    H5Sget_simple_extent_dims(space, size, nullptr);
    H5Dget_num_chunks(set, space, &count);
    ends.resize(count);
    for (hsize_t i = 0; i < count; ++i) {
      hsize_t at[3] = {}, bytes = 0;
      haddr_t place = 0;
      unsigned filters = 0;
      H5Dget_chunk_info(set, space, i, at, &filters, &place, &bytes);
      ends.at(at[0]) = std::max<std::uintmax_t>(ends[at[0]], place + bytes);
    }
    H5Sclose(space);
    H5Dclose(set);
  }
  H5Fclose(h5);
  return ends;
}

struct Ending {
  const char* name;
  int compression;
  bool killed;
};

/// Recordings of this program, truncated at a fraction of their bytes, at the end of a frame and one byte before it.
class CutRecording : public CutCapture, public testing::WithParamInterface<Ending> {
 protected:
  static constexpr std::size_t recorded = 60;
  static float value(std::size_t number, std::size_t pixel) {
    return static_cast<float>(1 + number) + 1e-3F * static_cast<float>(pixel % 97);
  }

  static void record(const fs::path& file, int compression, bool finish) {
    io::CaptureHeader header;
    header.camera = "test";
    header.width = header.height = side;
    io::CaptureWriter writer(file, header,
                             {{"range", TOFGRAPH_TYPE_F32, {side, side}, "m", "", "", ""},
                              {"amplitude", TOFGRAPH_TYPE_F32, {side, side}, "counts", "", "", ""}},
                             {.compression = compression});
    for (std::size_t i = 0; i < recorded; ++i) {
      std::vector<float> images[2] = {std::vector<float>(frame), std::vector<float>(frame)};
      for (std::size_t p = 0; p < frame; ++p) images[1][p] = 2 * (images[0][p] = value(i, p));
      std::array<tofgraph_view, 2> views{};
      for (std::size_t c = 0; c < 2; ++c)
        views[c] = {.size = sizeof views[c],
                    .type = TOFGRAPH_TYPE_F32,
                    .rank = 2,
                    .data = images[c].data(),
                    .extent = {side, side},
                    .stride = {side * sizeof(float), sizeof(float)}};
      writer.append({.size = sizeof(tofgraph_metadata),
                     .device_number = i,
                     .timestamp_ns = 1000 + static_cast<std::int64_t>(i),
                     .integration_time = 2e-3},
                    views);
    }
    if (!finish) _exit(0);  // like a kill: the writer's destructor would close the file cleanly
    writer.finish(R"({"made": "by a test"})");
  }

  /// @returns the capture, or the .part file of a killed recorder
  fs::path recording() const {
    if (!GetParam().killed) {
      record(path, GetParam().compression, true);
      return path;
    }
    const pid_t child = fork();
    if (child == 0) {
      try {
        record(path, GetParam().compression, false);
      } catch (...) {
        _exit(1);
      }
    }
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0) << "the recorder";
    return io::CaptureWriter::part_of(path);
  }
};

TEST_P(CutRecording, KeepsTheFramesWhoseChunksAreWholeAndCountsTheOthers) {
  const fs::path whole = recording();
  const std::vector<std::uintmax_t> ends = ends_of_frames(whole, {"range", "amplitude"});
  ASSERT_EQ(ends.size(), recorded);
  const std::uintmax_t size = fs::file_size(whole);
  std::vector<std::uintmax_t> cuts = {size / 10, size / 2, size * 9 / 10, size - 1, size};
  for (const std::size_t f : {0U, 7U, 30U}) cuts.insert(cuts.end(), {ends[f], ends[f] - 1});
  const fs::path cut = folder.path() / ("cut" + whole.filename().string());
  for (const std::uintmax_t bytes : cuts) {
    fs::copy_file(whole, cut, fs::copy_options::overwrite_existing);
    fs::resize_file(cut, bytes);
    fs::remove(mended);
    const auto held = static_cast<std::size_t>(std::ranges::count_if(ends, [&](auto end) { return end <= bytes; }));
    io::Repaired result;
    const std::string problem = thrown([&] { result = io::repair_capture(cut, mended, false); });
    const std::string where = "at " + std::to_string(bytes) + " of " + std::to_string(size);
    if (held == 0) {
      // If no structure is left, the message states this as the cause.
      const std::string begin = cut.string() + " was cut off: it has " + std::to_string(bytes) + " of " +
                                std::to_string(size) + " bytes, and ";
      EXPECT_TRUE(problem == begin + "no whole frame is in them" ||
                  problem.starts_with(begin + "they cannot be read: "))
          << problem;
      EXPECT_EQ(problem.find(".copy"), std::string::npos) << problem;
      EXPECT_FALSE(fs::exists(mended));
      continue;
    }
    ASSERT_EQ(problem, "") << where;
    EXPECT_EQ(result.frames, held) << where;
    EXPECT_EQ(result.cut, bytes < size) << where;
    EXPECT_EQ(result.lost, bytes < size ? recorded - result.frames : 0) << where;
    const io::CaptureReader reader(mended);
    ASSERT_EQ(reader.frames(), result.frames) << where;
    for (std::size_t f = 0; f < result.frames; ++f) {
      std::vector<float> values(frame);
      const tofgraph_metadata metadata = reader.metadata(f);
      for (std::size_t c = 0; c < 2; ++c) {
        reader.read(c, f, values.data());
        const float scale = reader.channels()[c].name == "amplitude" ? 2 : 1;
        for (std::size_t p = 0; p < frame; ++p) ASSERT_EQ(values[p], scale * value(f, p)) << where << " frame " << f;
      }
      // Either known and correct, or unknown and counted.
      const bool lost = f + result.without_time >= result.frames;
      EXPECT_EQ(metadata.timestamp_ns, lost ? 0 : 1000 + static_cast<std::int64_t>(f)) << where;
      EXPECT_EQ(std::isnan(metadata.integration_time), lost) << where;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, CutRecording,
                         testing::Values(Ending{"Plain", 0, false}, Ending{"Compressed", 4, false},
                                         Ending{"Killed", 0, true}, Ending{"KilledCompressed", 4, true}),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST_F(CutCapture, AnotherCauseThanTheCutIsKept) {
  {
    RawCapture capture(path);
    capture.head(side, side, 7).metadata(frames, 2e-3);
    capture.dataset("range", {frames, side, side}, std::vector<float>(frames * frame, 1), {1, side, side});
  }
  fs::resize_file(path, fs::file_size(path) - 1000);
  const std::string problem = thrown([&] { io::repair_capture(path, mended, false); });
  EXPECT_NE(problem.find(" bytes, and they cannot be read: "), std::string::npos) << problem;
  EXPECT_NE(problem.find("version 7"), std::string::npos) << problem;
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
