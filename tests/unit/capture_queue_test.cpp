// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Captures that are written in the background, full disks, and repair of truncated recordings, examined with HDF5's own
// interface, as any other program would do.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <tofgraph/array.hpp>

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "io/captures/capture_hdf5.hpp"
#include "io/captures/queued_capture.hpp"
#include "io/captures/repair.hpp"
#include "tests/unit/capture_fixture.hpp"
#include "tests/unit/full_disk.hpp"
#include "tests/unit/raw_capture.hpp"

namespace tofgraph::tests {
namespace {

using io::CaptureReader;
using io::CaptureWriter;
using io::QueuedCapture;
namespace fs = std::filesystem;

constexpr std::uint32_t side = 64;
constexpr std::size_t pixels = side * side;
const io::CaptureChannel channel{"range", TOFGRAPH_TYPE_F32, {side, side}, "m", "", "", ""};

std::unique_ptr<CaptureWriter> writer_of(const fs::path& file) {
  io::CaptureHeader header;
  header.camera = "test";
  header.width = header.height = side;
  return std::make_unique<CaptureWriter>(file, header, std::vector{channel});
}

template <class Writer> void append(Writer& writer, std::size_t number, std::uint64_t counter) {
  append_frame(writer, side, number, counter);
}

/// Number of frames of a file opened as by any program; all datasets have the same number, and none is all zeros.
std::size_t plain_frames(const fs::path& file) {
  const std::vector<float> values = raw_values<float>(file, "/frames/range");
  const std::size_t frames = values.size() / pixels;
  for (std::size_t i = 0; i < frames; ++i)
    EXPECT_EQ(std::count(values.begin() + static_cast<std::ptrdiff_t>(i * pixels),
                         values.begin() + static_cast<std::ptrdiff_t>((i + 1) * pixels), static_cast<float>(i + 1)),
              static_cast<std::ptrdiff_t>(pixels))
        << "frame " << i;
  EXPECT_EQ(raw_values<std::int64_t>(file, "/frames/timestamp_ns").size(), frames);
  EXPECT_EQ(raw_values<std::uint64_t>(file, "/frames/frame_number").size(), frames);
  return frames;
}

TEST_F(CaptureFile, WrittenBehindIsWrittenWholeAndInOrder) {
  for (const std::size_t memory : {std::size_t{0}, pixels * sizeof(float) * 3, std::size_t{1} << 30U}) {
    QueuedCapture queue(writer_of(path), memory);
    for (std::size_t i = 0; i < 50; ++i) append(queue, i, i);
    queue.finish();
    EXPECT_EQ(plain_frames(path), 50U);
    fs::remove(path);
  }
}

TEST_F(CaptureFile, TheLimitOfTheQueueIsThatOfItsMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer replaces the memory allocator";
#endif
  constexpr std::uint32_t tiny = 2;
  constexpr std::size_t limit = 2'000'000;
  io::CaptureHeader header;
  header.camera = "test";
  header.width = header.height = tiny;
  QueuedCapture queue(
      std::make_unique<CaptureWriter>(
          path, header, std::vector<io::CaptureChannel>{{"range", TOFGRAPH_TYPE_F32, {tiny, tiny}, "m", "", "", ""}}),
      limit);
  std::atomic<std::size_t> given = 0;
  const std::size_t before = mallinfo2().uordblks;
  std::thread producer;
  {
    const io::h5::Lock nothing_is_written;
    producer = std::thread([&] {
      for (; given < 12'000; ++given) append_frame(queue, tiny, given, given);
    });
    std::size_t seen = 0;
    do {
      seen = given;
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
    } while (given != seen);
    EXPECT_LT(given, 12'000U) << "the producer waits";
    EXPECT_GT(given, 4000U);
    const std::size_t taken = mallinfo2().uordblks - before;
    EXPECT_LT(taken, limit * 5 / 4) << given << " frames wait";
    EXPECT_GT(taken, limit / 2);
  }
  producer.join();
  queue.finish();
  EXPECT_EQ(CaptureReader(path).frames(), 12'000U);
}

TEST_F(CaptureFile, WithoutFinishWhatWaitsIsWrittenAndThePartStays) {
  {
    QueuedCapture queue(writer_of(path), std::size_t{1} << 30U);
    for (std::size_t i = 0; i < 20; ++i) append(queue, i, i);
  }
  EXPECT_EQ(listing(folder.path()), std::vector<std::string>{"a.h5.part"});
  EXPECT_EQ(plain_frames(path.string() + ".part"), 20U);
}

TEST_F(CaptureFile, AFullDiskLosesNoWrittenFrameAndLeavesNoneOfZeros) {
  for (const char* size : {"2m", "2100k", "2500k", "3m"}) {
    const SmallDisk disk(size);
    if (!disk.available()) GTEST_SKIP() << "no right to mount a small disk";
    const fs::path small = disk.path() / "a.h5";
    std::size_t given = 0;
    const std::string message = thrown([&] {
      QueuedCapture queue(writer_of(small), pixels * sizeof(float) * 4);
      for (; given < 1000; ++given) append(queue, given, given);
    });
    const std::size_t written = plain_frames(small.string() + ".part");
    EXPECT_GT(written, 10U);
    expect_words(message, {"a.h5.part", "No space left on device", std::to_string(written) + " frames are written",
                           std::to_string(given + 1 - written) + " frame", "could not be written"});
    EXPECT_FALSE(fs::exists(small));
    EXPECT_EQ(CaptureReader(small.string() + ".part").frames(), written);
  }
}

TEST_F(CaptureFile, RepairCopiesAllFramesAndCountsTheGaps) {
  const fs::path part = CaptureWriter::part_of(path);
  {
    const auto writer = writer_of(path);
    for (std::size_t i = 0; i < 9; ++i) append(*writer, i, i < 5 ? i : i + 3);
  }
  const io::Repaired repaired = io::repair_capture(part, path, false);
  EXPECT_EQ(repaired.frames, 9U);
  EXPECT_EQ(repaired.missing, 3U);
  EXPECT_EQ(plain_frames(path), 9U);
  EXPECT_EQ(raw_values<std::uint64_t>(path, "/frames/frame_number"),
            std::vector<std::uint64_t>({0, 1, 2, 3, 4, 8, 9, 10, 11}));
  EXPECT_EQ(listing(folder.path()), std::vector<std::string>({"a.h5", "a.h5.part"})) << "the recording stays";
  expect_words(thrown([&] { io::repair_capture(part, path, false); }), {"already exists"});
  EXPECT_EQ(plain_frames(path), 9U);
}

TEST_F(CaptureFile, RepairOnAFullDiskLeavesNothing) {
  const SmallDisk disk("2m");
  if (!disk.available()) GTEST_SKIP() << "no right to mount a small disk";
  {
    const auto writer = writer_of(path);
    for (std::size_t i = 0; i < 200; ++i) append(*writer, i, i);
  }
  const fs::path out = disk.path() / "b.h5";
  expect_words(thrown([&] { io::repair_capture(CaptureWriter::part_of(path), out, false); }),
               {"No space left on device"});
  EXPECT_TRUE(listing(disk.path()).empty());
}

}  // namespace
}  // namespace tofgraph::tests
