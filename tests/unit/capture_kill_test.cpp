// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: CaptureFile.AKillAtAnyWriteLosesNoFrameThatWasAppended
// Rooms: io
// A recorder that is killed at each single write, including the last ones: all flushed frames can be read.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <tofgraph/array.hpp>

#include <csignal>

#include "io/captures/repair.hpp"
#include "tests/unit/capture_fixture.hpp"
#include "tests/unit/raw_capture.hpp"

namespace {
/// In the child: number of writes until the process is killed; 0: it is not killed.
int writes_to_live = 0;
void one_write() {
  if (writes_to_live > 0 && --writes_to_live == 0) kill(getpid(), SIGKILL);
}
}  // namespace

#define IN_THE_PLACE_OF extern "C" __attribute__((visibility("default")))
// Replaces the system's functions, also for the HDF5 library.
IN_THE_PLACE_OF ssize_t pwrite64(int file, const void* data, size_t bytes, off64_t at) {
  one_write();
  return syscall(SYS_pwrite64, file, data, bytes, at);
}
IN_THE_PLACE_OF ssize_t pwrite(int file, const void* data, size_t bytes, off_t at) {
  return pwrite64(file, data, bytes, at);
}
IN_THE_PLACE_OF int ftruncate64(int file, off64_t size) noexcept {
  one_write();
  return static_cast<int>(syscall(SYS_ftruncate, file, size));
}
IN_THE_PLACE_OF int ftruncate(int file, off_t size) noexcept { return ftruncate64(file, size); }
IN_THE_PLACE_OF int fsync(int file) {
  one_write();
  return static_cast<int>(syscall(SYS_fsync, file));
}

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;
using io::CaptureWriter;

constexpr std::uint32_t side = 16;
const io::CaptureChannel channel{"range", TOFGRAPH_TYPE_F32, {side, side}, "m", "", "", ""};

void append(CaptureWriter& writer, std::size_t number) { append_frame(writer, side, number, number); }

/// Records in a child that is killed at its write `at`, counted from the start or from the start of finish().
/// @returns number of appended frames; -1: the child was not killed
int record_and_die(const fs::path& file, std::size_t frames, int at, bool in_finish) {
  int ends[2];
  EXPECT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    io::CaptureHeader header;
    header.camera = "test";
    header.width = header.height = side;
    if (!in_finish) writes_to_live = at;
    CaptureWriter writer(file, header, {channel});
    for (std::size_t i = 0; i < frames; ++i) {
      append(writer, i);
      if (write(ends[1], "f", 1) != 1) _exit(2);
    }
    if (in_finish) writes_to_live = at;
    writer.finish(R"({"made": "by a test"})" + std::string(40'000, ' '));
    _exit(0);
  }
  close(ends[1]);
  int appended = 0;
  for (char byte = 0; read(ends[0], &byte, 1) == 1;) ++appended;
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status)) {
    EXPECT_EQ(WEXITSTATUS(status), 0);
    return -1;
  }
  EXPECT_EQ(WTERMSIG(status), SIGKILL);
  return appended;
}

void expect_frames(const fs::path& file, int least) {
  const std::vector<float> values = raw_values<float>(file, "/frames/range");
  const std::size_t frames = values.size() / (side * side);
  EXPECT_GE(static_cast<int>(frames), least);
  for (std::size_t i = 0; i < values.size(); ++i)
    ASSERT_EQ(values[i], static_cast<float>(i / (side * side) + 1)) << file;
  EXPECT_GE(raw_values<std::int64_t>(file, "/frames/timestamp_ns").size(), frames);
}

TEST_F(CaptureFile, AKillAtAnyWriteOfFinishLosesNoFrame) {
  int writes = 0;
  for (;; ++writes) {
    fs::remove(path);
    fs::remove(CaptureWriter::part_of(path));
    const int appended = record_and_die(path, 20, writes + 1, true);
    if (appended < 0) break;
    ASSERT_EQ(appended, 20);
    ASSERT_FALSE(fs::exists(path)) << "not before it is whole";
    const io::Repaired repaired = io::repair_capture(CaptureWriter::part_of(path), path, false);
    EXPECT_EQ(repaired.frames, 20U) << "killed at write " << writes + 1;
    expect_frames(path, 20);
  }
  std::printf("killed at each of %d writes of finish()\n", writes);
  EXPECT_GT(writes, 5);
  expect_frames(path, 20);
  EXPECT_EQ(provenance_in(path).substr(0, 21), R"({"made": "by a test"})");
  EXPECT_EQ(io::CaptureReader(path).header().provenance, provenance_in(path));
}

TEST_F(CaptureFile, AKillAtAnyWriteLosesNoFrameThatWasAppended) {
  int writes = 0;
  for (;; ++writes) {
    fs::remove(path);
    fs::remove(CaptureWriter::part_of(path));
    const int appended = record_and_die(path, 6, writes + 1, false);
    if (appended < 0) break;
    if (appended == 0) continue;
    const io::Repaired repaired = io::repair_capture(CaptureWriter::part_of(path), path, false);
    EXPECT_GE(static_cast<int>(repaired.frames), appended) << "killed at write " << writes + 1;
    expect_frames(path, appended);
  }
  std::printf("killed at each of %d writes\n", writes);
  EXPECT_GT(writes, 40);
}

TEST_F(CaptureFile, WhatIsBeingWrittenIsNotRepaired) {
  const fs::path part = CaptureWriter::part_of(path);
  CaptureWriter writer(path,
                       [] {
                         io::CaptureHeader header;
                         header.camera = "test";
                         header.width = header.height = side;
                         return header;
                       }(),
                       {channel});
  append(writer, 0);
  EXPECT_TRUE(CaptureWriter::is_at_work(part));
  expect_words(thrown([&] { io::repair_capture(part, path, false); }), {"a.h5.part is still being recorded"});
  EXPECT_EQ(io::CaptureReader(part).frames(), 1U) << "readers are welcome";
  // A file of the same name that another process creates meanwhile is kept, and so is the recording.
  write_text(path, "precious");
  expect_words(thrown([&] { writer.finish(); }), {"a.h5 was made by somebody else meanwhile", "-o OTHER.h5"});
  EXPECT_EQ(read_text(path), "precious");
  EXPECT_EQ(io::CaptureReader(part).frames(), 1U);
}

TEST_F(CaptureFile, WhatAKilledRecorderLeftIsAtNobodysHands) {
  EXPECT_EQ(record_and_die(path, 3, 1, true), 3);
  EXPECT_FALSE(CaptureWriter::is_at_work(CaptureWriter::part_of(path)));
}

}  // namespace
}  // namespace tofgraph::tests
