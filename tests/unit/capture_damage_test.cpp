// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: CaptureDamage.TurnedBits*:Trial.EndsALoop*
// Rooms: io config
// Damage to recordings that occurs in practice: killed recorders, truncated files, flipped bits.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <hdf5.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <random>
#include <thread>

#include "config/paths.hpp"
#include "config/process_limits.hpp"
#include "io/captures/capture.hpp"
#include "io/captures/capture_guard.hpp"
#include "io/captures/capture_map.hpp"
#include "tests/program.hpp"
#include "tests/unit/full_disk.hpp"

namespace tofgraph::tests {
namespace {

using io::CaptureReader;
namespace fs = std::filesystem;

const fs::path recording = TOFGRAPH_SOURCE_DIR "/pipelines/data/o3d303_scene.h5";

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool memory_is_ours = false;  // the memory of a sanitizer itself would be counted
constexpr std::uint32_t effort = 1;
#else
constexpr bool memory_is_ours = true;
constexpr std::uint32_t effort = 4;
#endif

/// Reads everything. @returns the error message, or an empty string
std::string read_whole(const fs::path& path) {
  return thrown([&] {
    const CaptureReader reader(path);
    for (std::size_t c = 0; c < reader.channels().size(); ++c) {
      std::vector<std::byte> frame(reader.channels()[c].bytes());
      for (std::size_t i = 0; i < reader.frames(); ++i) reader.read(c, i, frame.data());
    }
  });
}

/// Records frames of 64 x 48 whose pixels all hold the frame number, and reports each written frame, until killed.
[[noreturn]] void record_for_ever(const fs::path& path, int told) {
  io::CaptureHeader header;
  header.camera = "test";
  header.width = 64;
  header.height = 48;
  io::CaptureWriter writer(path, header, {{"distance", TOFGRAPH_TYPE_F32, {48, 64}, "m", "", "", ""}});
  for (std::uint32_t number = 0;; ++number) {
    std::vector<float> values(48 * 64, static_cast<float>(number));
    const tofgraph_view view{
        .type = TOFGRAPH_TYPE_F32, .rank = 2, .data = values.data(), .extent = {48, 64}, .stride = {256, 4}};
    writer.append({}, {&view, 1});
    if (write(told, &number, sizeof number) < 0) _exit(1);
  }
}

TEST(CaptureDamage, ARecordingSurvivesAKillUpToItsLastFrame) {
  std::mt19937 random(1);
  for (int round = 0; round < 12; ++round) {
    const TemporaryFolder folder;
    const fs::path path = folder.path() / "a.h5";
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) record_for_ever(path, ends[1]);
    close(ends[1]);
    std::uint32_t written = 0;
    const auto until = static_cast<std::uint32_t>(5 + random() % 400);
    while (written < until) ASSERT_EQ(read(ends[0], &written, sizeof written), 4);
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
    while (read(ends[0], &written, sizeof written) == 4) {  // frames reported before the kill
    }
    close(ends[0]);
    EXPECT_EQ(listing(folder.path()), std::vector<std::string>{"a.h5.part"});
    const CaptureReader reader(path.string() + ".part");
    EXPECT_FALSE(reader.finished());
    ASSERT_GT(reader.frames(), written) << "frames count from 0";
    for (std::uint32_t i = 0; i <= written; ++i) {
      std::vector<float> values(48 * 64);
      reader.read(0, i, values.data());
      ASSERT_EQ(values, std::vector<float>(48 * 64, static_cast<float>(i)));
    }
  }
}

TEST(CaptureDamage, ACutOffFileIsNamed) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "cut.h5";
  const std::string whole = read_text(recording);
  for (std::size_t length = 0; length < whole.size(); length += length < 20000 ? 997 : 49999) {
    write_text(path, whole.substr(0, length));
    const std::string why = read_whole(path);
    EXPECT_EQ(why.find(path.string() + ": "), 0U) << length << ": " << why;
    if (length > 4096) {
      EXPECT_NE(why.find("it was cut off: it has " + std::to_string(length) + " of "), std::string::npos) << why;
    }
  }
}

/// Content with a few bits flipped within its first bytes.
std::string damaged(std::string content, std::uint32_t seed, std::size_t within) {
  std::mt19937 random(seed);
  const std::size_t flips = 1 + random() % 8;
  for (std::size_t i = 0; i < flips; ++i) {
    char& byte = content[random() % std::min(within, content.size())];
    byte = static_cast<char>(byte ^ 1 << random() % 8);
  }
  return content;
}

/// A recording made by this program, which uses newer structures of the HDF5 format.
std::string own_recording(const fs::path& folder) {
  io::CaptureHeader header;
  header.camera = "test";
  header.width = 64;
  header.height = 48;
  io::CaptureWriter writer(folder / "own.h5", header, {{"distance", TOFGRAPH_TYPE_F32, {48, 64}, "m", "", "", ""}},
                           {1, false});
  std::vector<float> values(48 * 64, 1);
  const tofgraph_view view{
      .type = TOFGRAPH_TYPE_F32, .rank = 2, .data = values.data(), .extent = {48, 64}, .stride = {256, 4}};
  for (int i = 0; i < 3; ++i) writer.append({}, {&view, 1});
  writer.finish();
  return read_text(folder / "own.h5");
}

TEST(CaptureDamage, TurnedBitsNeverCrashAndNeverTakeMuchMemory) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "damaged.h5";
  std::uint32_t refused = 0;
  for (const std::string& whole : {read_text(recording), own_recording(folder.path())}) {
    for (std::uint32_t seed = 0; seed < 100 * effort; ++seed) {
      write_text(path, damaged(whole, seed, seed % 4 == 0 ? whole.size() : 9000));  // most of the structure is intact
      const std::string why = read_whole(path);
      if (why.empty()) continue;
      ++refused;
      ASSERT_EQ(why.find(path.string() + ": "), 0U) << why;
    }
  }
  EXPECT_GT(refused, 50 * effort) << "the damage should be seen";
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    if (memory_is_ours) {
      EXPECT_LT(usage.ru_maxrss, 200 * 1024) << "kB";
    }
  }
}

/// HDF5 prints its errors in each thread that has not disabled this.
TEST(CaptureDamage, HDF5SaysNothingOfItsOwnFromAnyThread) {
  const TemporaryFolder folder;
  std::string content = own_recording(folder.path());
  std::vector<std::size_t> streams;  // compressed frames begin with these bytes
  for (std::size_t at = 0; (at = content.find("\x78\x01", at)) != std::string::npos; ++at) streams.push_back(at);
  ASSERT_EQ(streams.size(), 3U);
  for (std::size_t i = 2; i < 8; ++i) content[streams[1] + i] = '\xff';
  write_text(folder.path() / "damaged.h5", content);
  const CaptureReader reader(folder.path() / "damaged.h5");  // checks the first and the last frame
  testing::internal::CaptureStderr();
  std::string why;
  std::thread([&] {
    why = thrown([&] {
      std::vector<float> frame(48 * 64);
      reader.read(0, 1, frame.data());
    });
  }).join();
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_NE(why.find("damaged.h5: frame 1 of distance: "), std::string::npos) << why;
}

// The check in a process of its own, tested in isolation.

/// Message of a check that runs a shell script.
std::string trial_of(const std::string& script) {
  return thrown([&] { io::run_trial({"/bin/sh", "-c", script}); });
}

TEST(Trial, TellsWhatIsWrong) {
  EXPECT_EQ(trial_of("printf 'this is wrong'"), "this is wrong");
  EXPECT_EQ(trial_of("echo of no interest >&2"), "");
}

TEST(Trial, SurvivesACrash) {
  EXPECT_EQ(trial_of("kill -SEGV $$"), "is damaged: HDF5 crashed when a child process tried to read it");
}

/// A check that is ended by the system implies nothing about the file.
TEST(Trial, BlamesTheFileForCrashesAlone) {
  EXPECT_EQ(trial_of("kill -KILL $$"), "cannot be tried: /bin/sh ended with signal 9");
  EXPECT_EQ(trial_of("printf 'no library' >&2; exit 127"),
            "cannot be tried: /bin/sh ended with exit code 127: no library");
  EXPECT_EQ(thrown([] {
              io::run_trial({config::trial_program().string(), "kind", "file"});
            }),
            "cannot be tried: " + config::trial_program().string() + " ended with exit code 2");
}

TEST(Trial, EndsALoopByTheProcessorsTimeAlone) {
  const pid_t child = fork();
  if (child == 0) {
    config::limit_process({std::size_t{1} << 40U, 1});
    sleep(2);  // under load, a healthy file may take long
    std::atomic<bool> go_on{true};
    while (go_on.load()) {
    }
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) << status;
  EXPECT_EQ(trial_of("kill -XCPU $$"), "is damaged: HDF5 did not finish when a child process tried to read it");
}

TEST(Trial, SaysWhichProgramIsMissing) {
  EXPECT_EQ(thrown([] { io::run_trial({"/nowhere/tofgraph-try"}); }),
            "cannot be tried: /nowhere/tofgraph-try cannot be started: No such file or directory");
}

/// A file that has passed is not checked again while it remains the same file, under any name.
TEST(Trial, IsMadeOnceOfEachStateOfAFile) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "file", count = folder.path() / "count";
  const auto trials = [&] {
    io::run_trial_once(file, "kind", {"/bin/sh", "-c", "echo >>'" + count.string() + "'"});
    return fs::file_size(count);
  };
  write_text(file, "one");
  EXPECT_EQ(trials(), 1U);
  EXPECT_EQ(trials(), 1U);
  fs::last_write_time(file, fs::last_write_time(file) + std::chrono::microseconds(1));
  EXPECT_EQ(trials(), 2U);
  write_text(folder.path() / "other", "two");
  fs::rename(folder.path() / "other", file);
  EXPECT_EQ(trials(), 3U);
  const auto fails = [&] { return thrown([&] { io::run_trial_once(file, "kind", {"/bin/sh", "-c", "echo bad"}); }); };
  EXPECT_EQ(fails(), "");  // because it has passed before
  write_text(file, "three");
  EXPECT_EQ(fails(), "bad\n");
  EXPECT_EQ(fails(), "bad\n");  // a file that failed is checked again
}

/// A capture that passed as a file of arrays, or the reverse, is checked again: the trials read different parts.
TEST(Trial, IsMadeOnceOfEachKind) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "file";
  write_text(file, "one");
  const auto tried = [&](const std::string& kind) {
    return !thrown([&] { io::run_trial_once(file, kind, {"/bin/sh", "-c", "echo bad"}); }).empty();
  };
  io::run_trial_once(file, "arrays", {"/bin/true"});
  EXPECT_FALSE(tried("arrays"));
  EXPECT_TRUE(tried("capture"));
}

/// Files that passed in advance are not checked again; files that failed keep their reason.
TEST(Trial, OfManyFilesIsMadeAhead) {
  const TemporaryFolder folder;
  std::vector<fs::path> files;
  for (int i = 0; i < 40; ++i) {
    files.push_back(folder.path() / std::to_string(i));
    if (i % 7 == 3)
      write_text(files.back(), "damaged");
    else
      fs::copy_file(recording, files.back());
  }
  files.push_back(folder.path() / "none");
  files.push_back(folder.path() / "pipe");  // reading it would block forever
  ASSERT_EQ(mkfifo(files.back().c_str(), 0600), 0);
  io::try_ahead(files);
  const auto again = [&](const fs::path& file) {
    return thrown([&] { io::run_trial_once(file, io::capture_trial, {"/bin/sh", "-c", "echo tried"}); });
  };
  for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(again(files[i]), i % 7 == 3 ? "tried\n" : "") << i;
  EXPECT_EQ(again(files.back()), "tried\n");
  EXPECT_NE(thrown([&] { CaptureReader reader(files[3]); }).find("is not an HDF5 file"), std::string::npos);
}

TEST(Trial, ManyAtOnceInAProcessOfManyThreads) {
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&] {
      for (int k = 0; k < 5; ++k) wrong += thrown([] { CaptureReader reader(recording); }).empty() ? 0 : 1;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST(Trial, RefusesMemory) {
  if (!memory_is_ours) GTEST_SKIP() << "the sanitizer ends the process instead";
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "map.h5").string();
  const hsize_t extent[2] = {5790, 5790};  // nearly as many pixels as can be read, 268 MB; a sparse file
  const hid_t h5 = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t space = H5Screate_simple(2, extent, nullptr), creation = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY);
  H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER);
  H5Dclose(H5Dcreate2(h5, "map", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, creation, H5P_DEFAULT));
  H5Pclose(creation);
  H5Sclose(space);
  H5Fclose(h5);
  const std::string why = thrown([&] { io::read_pixel_map(file, "map"); });
  EXPECT_NE(why.find("needs more memory"), std::string::npos) << why;
}

}  // namespace
}  // namespace tofgraph::tests
