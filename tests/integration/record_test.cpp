// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Alone: cameras keep their own time
// Slow: Record.AKilled*:Record.ACut*:Record.WhatIs*:Record.WritesThe*
// Rooms: recording io devices
// `tofgraph record`, `repair` and `info` as a user runs them, with a simulated camera.
#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <thread>

#include "tests/program.hpp"
#include "tests/unit/capture_fixture.hpp"
#include "tests/unit/full_disk.hpp"
#include "tests/unit/raw_capture.hpp"

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

class Record : public testing::Test {
 protected:
  void SetUp() override {
    write_text(folder.path() / "board.yaml",
               "scene: 1\ncamera: camcube2\nframes: 1\noutput: taps\n"
               "objects: [{type: board, distance: 1 m, reflectivity: 0.5}]\n");
  }
  Outcome run(const std::string& command) const { return shell(command, folder.path()); }
  std::string file(const std::string& name) const { return (folder.path() / name).string(); }

  TemporaryFolder folder;
  const std::string record = "\"$TOFGRAPH\" record --camera simulated:board.yaml ";
};

TEST_F(Record, WritesTheFramesOfACameraWithItsSettings) {
  const Outcome outcome = run(record +
                              "-o a.h5 --frames 20 --set frame_rate='10 Hz' --set integration_time='2 ms' "
                              "--set capture.compression=1");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  expect_words(outcome.err, {"a.h5: 20 frames in", "10.0 frames/s"});
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(raw_values<double>(file("a.h5"), "/frames/integration_time_s"), std::vector<double>(20, 2e-3));
  EXPECT_EQ(raw_values<std::uint16_t>(file("a.h5"), "/frames/taps").size(), 20U * 8 * 204 * 204);
  EXPECT_EQ(run(record + "-o a.h5 --frames 2").exit_code, 2) << "an existing capture stays";
  EXPECT_EQ(run(record + "-o a.h5 --frames 2 --force").exit_code, 0);
  EXPECT_EQ(raw_values<double>(file("a.h5"), "/frames/integration_time_s").size(), 2U);
}

TEST_F(Record, StopsAfterATime) {
  EXPECT_EQ(run(record + "-o a.h5 --for '500 ms'").exit_code, 0);
  const std::size_t frames = raw_values<double>(file("a.h5"), "/frames/integration_time_s").size();
  EXPECT_GT(frames, 20U);  // 41 on a machine that is not busy
  EXPECT_LT(frames, 80U);
}

TEST_F(Record, AnInterruptLeavesAWholeCapture) {
  const Outcome outcome = run(record +
                              "-o a.h5 & P=$!; until [ -e a.h5.part ]; do sleep 0.02; done; sleep 0.5; "
                              "kill -INT $P; wait $P");
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  expect_words(outcome.err, {"interrupted: the frames up to here are complete"});
  EXPECT_GT(raw_values<double>(file("a.h5"), "/frames/integration_time_s").size(), 5U);
  EXPECT_FALSE(fs::exists(file("a.h5.part")));
}

/// Number of frames that other programs see in an unfinished recording; 0 if it has just begun.
std::size_t frames_seen(const std::string& part) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const hid_t capture = H5Fopen(part.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, H5P_DEFAULT);
  if (capture < 0) return 0;
  const hid_t set = H5Dopen2(capture, "/frames/frame_number", H5P_DEFAULT), space = H5Dget_space(set);
  const hssize_t frames = H5Sget_simple_extent_npoints(space);
  H5Sclose(space);
  H5Dclose(set);
  H5Fclose(capture);
  return frames > 0 ? static_cast<std::size_t>(frames) : 0;
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Kills a recording of two seconds at random times from the first frame on, and as it ends.
TEST_F(Record, AKilledRecorderLosesNoFrameThatWasSeenAndNoneOlderThanASecond) {
  constexpr std::size_t all = 160;
  std::mt19937 random(20);
  std::uniform_real_distribution<double> anywhere(0, 2.2), at_the_end(0, 0.3);
  int cut = 0, whole = 0, gaps = 0;
  std::vector<double> ages;  // of the last frame that was kept, s
  for (int trial = 0; trial < 24; ++trial) {
    run("rm -f a.h5* pid; " + record + "-o a.h5 --frames " + std::to_string(all) +
        " >log 2>&1 & echo $! >pid; until [ -e a.h5.part ]; do sleep 0.01; done");
    const pid_t recorder = std::stoi(read_text(file("pid")));
    const std::string part = file("a.h5.part");
    const bool late = trial % 2 == 1;
    const auto begin = std::chrono::steady_clock::now();
    while (fs::exists(part) && frames_seen(part) < (late ? all - 8 : 1) &&
           std::chrono::steady_clock::now() < begin + std::chrono::seconds(20))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::this_thread::sleep_for(std::chrono::duration<double>(late ? at_the_end(random) : anywhere(random)));
    const std::size_t seen = fs::exists(part) ? frames_seen(part) : 0;
    const std::int64_t killed = now_ns();
    kill(recorder, SIGKILL);
    while (io::CaptureWriter::is_at_work(part)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const bool ended = fs::exists(file("a.h5"));
    ++(ended ? whole : cut);
    if (!ended) {
      const Outcome repaired = run("\"$TOFGRAPH\" repair a.h5.part");
      ASSERT_EQ(repaired.exit_code, 0) << "trial " << trial << repaired.err;
    }
    const auto times = raw_values<std::int64_t>(file("a.h5"), "/frames/timestamp_ns");
    const auto numbers = raw_values<std::uint64_t>(file("a.h5"), "/frames/frame_number");
    const auto taps = raw_values<std::uint16_t>(file("a.h5"), "/frames/taps");
    ASSERT_EQ(numbers.size(), times.size());
    ASSERT_EQ(taps.size(), times.size() * 8 * 204 * 204);
    EXPECT_GE(times.size(), seen) << "trial " << trial;
    if (ended) {
      EXPECT_EQ(numbers.back() + 1, all);
    } else {
      ages.push_back(1e-9 * static_cast<double>(killed - times.back()));
    }
    gaps += numbers.back() + 1 == numbers.size() ? 0 : 1;
    for (std::size_t i = 0; i < times.size(); ++i) {
      ASSERT_GE(numbers[i], i == 0 ? 0 : numbers[i - 1] + 1) << "trial " << trial;
      ASSERT_GT(taps[i * 8 * 204 * 204 + 4 * 204 * 204 + 20000], 0) << "frame " << i << " of trial " << trial;
    }
  }
  ASSERT_GE(cut, 10);
  std::ranges::sort(ages);
  std::printf("%d recordings were cut off, %d had their name; the last frame was at most %.2f s old, median %.2f s\n",
              cut, whole, ages.back(), ages[ages.size() / 2]);
  // On a busy computer the recorder may get no processor time for a second, or the camera's queue may overflow.
  EXPECT_LE(gaps, 6);
  EXPECT_LT(ages[ages.size() * 3 / 4], 1);
  EXPECT_LT(ages.back(), 5);
}

/// Recordings by `record`, by capture_writer, and by a killed recorder.
TEST_F(Record, ACutRecordingIsRepairedAndItsLossIsTold) {
  ASSERT_EQ(run(record + "-o recorded.h5 --frames 20 --set capture.compression=1").exit_code, 0);
  ASSERT_EQ(
      run("\"$TOFGRAPH\" run 'capture_reader file=recorded.h5 ! capture_writer path=written.h5' --camera camcube2")
          .exit_code,
      0);
  ASSERT_EQ(
      run(record + "-o killed.h5 2>err.txt & P=$!; until [ $(stat -c %s killed.h5.part 2>/dev/null || echo 0) -gt "
                   "9000000 ]; do sleep 0.02; done; kill -9 $P; wait $P; [ -e killed.h5.part ]")
          .exit_code,
      0);
  for (const std::string name : {"recorded.h5", "written.h5", "killed.h5.part"}) {
    const std::uintmax_t size = fs::file_size(file(name));
    std::size_t kept = 0;
    for (const int percent : {10, 50, 90}) {
      fs::copy_file(file(name), file("cut.h5"), fs::copy_options::overwrite_existing);
      fs::resize_file(file("cut.h5"), size * static_cast<unsigned>(percent) / 100);
      expect_words(run("\"$TOFGRAPH\" info cut.h5").err,
                   {"it was cut off", "'tofgraph repair' keeps the whole frames"});
      const Outcome repaired = run("\"$TOFGRAPH\" repair cut.h5 -o mended.h5 --force");
      ASSERT_EQ(repaired.exit_code, 0) << name << repaired.err;
      const std::size_t frames = raw_values<double>(file("mended.h5"), "/frames/integration_time_s").size();
      EXPECT_GT(frames, kept) << name << " at " << percent << " %";
      kept = frames;
      std::size_t lost = 0, all = 0;
      const std::string words = "cut.h5 was cut off: ";
      const std::size_t at = repaired.err.find(words);
      ASSERT_NE(at, std::string::npos) << repaired.err;
      ASSERT_EQ(std::sscanf(repaired.err.c_str() + at + words.size(), "%zu of %zu frames are lost", &lost, &all), 2);
      EXPECT_EQ(frames + lost, all) << repaired.err;
      if (name != "killed.h5.part") {
        EXPECT_EQ(all, 20U);
      }
      const auto taps = raw_values<std::uint16_t>(file("mended.h5"), "/frames/taps");
      for (std::size_t i = 0; i < frames; ++i) ASSERT_GT(taps[i * 8 * 204 * 204 + 4 * 204 * 204 + 20000], 0) << i;
    }
  }
}

TEST_F(Record, AFullDiskTellsWhatIsMissingInAFewLines) {
  const SmallDisk disk("6m");
  if (!disk.available()) GTEST_SKIP() << "no right to mount a small disk";
  const std::string out = (disk.path() / "a.h5").string();
  const Outcome outcome = run(record + "-o " + out + " --frames 40");
  EXPECT_EQ(outcome.exit_code, 1);
  const std::size_t written = raw_values<double>(out + ".part", "/frames/integration_time_s").size();
  EXPECT_GT(written, 3U);
  expect_words(outcome.err, {"No space left on device", std::to_string(written) + " frames are written", "not in it",
                             "tofgraph repair " + out + ".part"});
  EXPECT_LT(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 10) << outcome.err;
  const Outcome repaired = run("\"$TOFGRAPH\" repair " + out + ".part -o a.h5");
  EXPECT_EQ(repaired.exit_code, 0) << repaired.err;
  EXPECT_EQ(raw_values<double>(file("a.h5"), "/frames/integration_time_s").size(), written);
}

TEST_F(Record, WhatWasThereBeforeIsNotReportedAsRecorded) {
  const SmallDisk disk("8m");
  if (!disk.available()) GTEST_SKIP() << "no right to mount a small disk";
  const std::string out = (disk.path() / "a.h5").string();
  ASSERT_EQ(run(record + "-o " + out + " --frames 3").exit_code, 0);
  const Outcome outcome = run(record + "-o " + out + " --frames 40 --force");
  EXPECT_EQ(outcome.exit_code, 1);
  const std::size_t written = raw_values<double>(out + ".part", "/frames/integration_time_s").size();
  expect_words(outcome.err, {out + ".part: " + std::to_string(written) + " frames"});
  EXPECT_EQ(outcome.err.find(out + ": 3 frames"), std::string::npos) << outcome.err;
  EXPECT_EQ(raw_values<double>(out, "/frames/integration_time_s").size(), 3U) << "it stays until the new one is whole";
}

TEST_F(Record, WhatIsStillRecordedIsNotRepaired) {
  const Outcome outcome = run(record +
                              "-o a.h5 --frames 60 & P=$!; until [ -e a.h5.part ]; do sleep 0.02; done; "
                              "\"$TOFGRAPH\" repair a.h5.part; echo repair $?; wait $P");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "repair 1\n");
  expect_words(outcome.err, {"a.h5.part is still being recorded"});
  const Outcome copied = run("\"$TOFGRAPH\" repair a.h5 -o b.h5");
  EXPECT_EQ(copied.exit_code, 0) << copied.err;
  EXPECT_EQ(copied.err.find("not needed"), std::string::npos) << copied.err;
}

TEST_F(Record, TheIntegrationTimeChangesBetweenFrames) {
  const Outcome outcome =
      run(record + "-o a.h5 --frames 30 --set auto_integration_time=true --set integration_time='0.5 ms'");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto times = raw_values<double>(file("a.h5"), "/frames/integration_time_s");
  const auto taps = raw_values<std::uint16_t>(file("a.h5"), "/frames/taps");
  EXPECT_DOUBLE_EQ(times.front(), 0.5e-3);
  EXPECT_EQ(std::set<double>(times.begin() + 10, times.end()).size(), 1U) << "it settles";
  // Light and time correspond: the sum of the 8 taps of the centre pixel is proportional to the time.
  const auto light = [&](std::size_t frame) {
    double sum = 0;
    for (std::size_t k = 0; k < 8; ++k) sum += taps[(frame * 8 + k) * 204 * 204 + 102 * 204 + 102];
    return sum;
  };
  EXPECT_NEAR(light(29) / light(0), times[29] / times[0], 0.05 * times[29] / times[0]);
  EXPECT_GT(light(29) / 8, 1000);  // mean tap = amplitude at a contrast of 0.5
  EXPECT_LT(light(29) / 8, 8000);
}

TEST_F(Record, InfoShowsGapsAndRecordingsThatWereCutOff) {
  ASSERT_EQ(run(record + "-o a.h5 --frames 6").exit_code, 0);
  const auto write_numbers = [&](const std::vector<std::uint64_t>& numbers) {  // none: removes the dataset
    const hid_t capture = H5Fopen(file("a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    if (numbers.empty()) {
      H5Ldelete(capture, "/frames/frame_number", H5P_DEFAULT);
    } else {
      const hid_t set = H5Dopen2(capture, "/frames/frame_number", H5P_DEFAULT);
      H5Dwrite(set, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
      H5Dclose(set);
    }
    H5Fclose(capture);
  };
  write_numbers({0, 1, 5, 6, 2, 3});
  const Outcome info = run("\"$TOFGRAPH\" info a.h5");
  expect_words(info.out, {"3 frames missing, by frame_number, in 2 places", "after frame 1: 3 lost",
                          "after frame 3: the counter went back"});
  EXPECT_EQ(nlohmann::json::parse(run("\"$TOFGRAPH\" info --json a.h5").out)["lost"], 3);
  // Without gaps: numbers of the camera's counter, those from 0, and none.
  const std::vector<std::uint64_t> counted = {7, 8, 9, 10, 11, 12}, from_zero = {0, 1, 2, 3, 4, 5};
  const auto expect_no_gap = [&](const std::string& words, bool counter) {
    expect_words(run("\"$TOFGRAPH\" info a.h5").out, {words});
    const auto shown = nlohmann::json::parse(run("\"$TOFGRAPH\" info --json a.h5").out);
    EXPECT_EQ(shown["counter"], counter) << words;
    EXPECT_EQ(shown["lost"], 0) << words;
    EXPECT_TRUE(shown["gaps"].empty()) << words;
  };
  write_numbers(counted);
  expect_no_gap("\nno frame is missing\n", true);
  write_numbers(from_zero);
  expect_no_gap("no gap in the frame numbers; they begin at 0, perhaps counted by the program", false);
  write_numbers({});
  expect_no_gap("\nno frame numbers were recorded: lost frames are unknown\n", false);
  fs::rename(file("a.h5"), file("b.h5.part"));
  expect_words(run("\"$TOFGRAPH\" info b.h5.part").out,
               {"6 frames: still being recorded, or cut off", "tofgraph repair b.h5.part makes a capture"});
}

TEST_F(Record, WrongUsageIsToldBeforeTheFirstFrame) {
  const auto refuses = [&](const std::string& command, const std::vector<std::string>& words) {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 2) << command;
    expect_words(outcome.err, words);
    EXPECT_FALSE(fs::exists(file("a.h5"))) << command;
  };
  refuses("\"$TOFGRAPH\" record --camera nobody:1 -o a.h5", {"there is no camera 'nobody:1'", "camcube:usb"});
  refuses(record + "-o a.h5 --for 3", {"--duration", "no unit", "30 s"});
  refuses(record + "-o a.h5 --for '-3 s'", {"must be greater than 0"});
  refuses(record + "-o a.h5 --set integration_tim='1 ms'", {"integration_tim", "did you mean 'integration_time'"});
  refuses(record + "-o a.h5 --set integration_time='0.1 ms'", {"nearest valid time is 500 us"});
  refuses("\"$TOFGRAPH\" repair board.yaml", {"does not end with .part"});
  refuses(record + "-o a.h5 --still", {"--auto-trigger: error: is for --plan"});
  refuses(record + "-o a.h5 --tolerance '-3 mm'", {"--tolerance: error: is for --plan"});
  refuses(record + "-o /proc/x/y.h5", {"/proc/x/y.h5 cannot be written", "nothing can be made in the folder /proc"});
  refuses("\"$TOFGRAPH\" record --camera camcube:usb -o a.h5", {"--camera:1:", "no camera 1c28:c003 is plugged in"});
  refuses("\"$TOFGRAPH\" record --camera replay:/dev/zero -o a.h5", {"/dev/zero is not a file"});
}

}  // namespace
}  // namespace tofgraph::tests
