// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// `tofgraph record`, `repair` and `info` as a user runs them, before a simulated camera.
#include <gtest/gtest.h>
#include <hdf5.h>

#include <nlohmann/json.hpp>
#include <set>

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
  const Outcome outcome = run(record + "-o a.h5 --frames 20 --set integration_time='2 ms' --set capture.compression=1");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  expect_words(outcome.err, {"a.h5: 20 frames in", "80.0 frames/s"});
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
  EXPECT_GT(frames, 20U);  // 41 on a machine that has time
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

TEST_F(Record, AKilledRecorderLosesNoFrameThatIsOlderThanASecond) {
  for (const char* moment : {"0.02", "0.11", "0.23", "0.31", "0.37", "0.48", "0.59", "0.63", "0.76", "0.84"}) {
    const Outcome killed = run("rm -f a.h5*; " + record +
                               "-o a.h5 & P=$!; until [ -e a.h5.part ]; do sleep 0.01; done; "
                               "sleep " +
                               std::string(moment) + "; date +%s%N; kill -9 $P; wait $P");
    EXPECT_EQ(killed.exit_code, 137);
    const Outcome repaired = run("\"$TOFGRAPH\" repair a.h5.part");
    if (repaired.err.find("holds no complete frame yet") != std::string::npos) continue;  // it had just begun
    ASSERT_EQ(repaired.exit_code, 0) << repaired.err;
    const auto times = raw_values<std::int64_t>(file("a.h5"), "/frames/timestamp_ns");
    const auto numbers = raw_values<std::uint64_t>(file("a.h5"), "/frames/frame_number");
    const auto taps = raw_values<std::uint16_t>(file("a.h5"), "/frames/taps");
    ASSERT_EQ(numbers.size(), times.size());
    ASSERT_EQ(taps.size(), times.size() * 8 * 204 * 204);
    EXPECT_GT(times.back(), std::stoll(killed.out) - 1'000'000'000);
    for (std::size_t i = 0; i < times.size(); ++i) {
      EXPECT_EQ(numbers[i], i);
      EXPECT_GT(taps[i * 8 * 204 * 204 + 4 * 204 * 204 + 20000], 0) << "frame " << i << " after " << moment << " s";
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

TEST_F(Record, TheIntegrationTimeChangesBetweenFrames) {
  EXPECT_EQ(
      run(record + "-o a.h5 --frames 30 --set auto_integration_time=true --set integration_time='0.5 ms'").exit_code,
      0);
  const auto times = raw_values<double>(file("a.h5"), "/frames/integration_time_s");
  const auto taps = raw_values<std::uint16_t>(file("a.h5"), "/frames/taps");
  EXPECT_DOUBLE_EQ(times.front(), 0.5e-3);
  EXPECT_EQ(std::set<double>(times.begin() + 10, times.end()).size(), 1U) << "it settles";
  // Light and time go together: 8 taps of the middle pixel, whose sum is proportional to the time.
  const auto light = [&](std::size_t frame) {
    double sum = 0;
    for (std::size_t k = 0; k < 8; ++k) sum += taps[(frame * 8 + k) * 204 * 204 + 102 * 204 + 102];
    return sum;
  };
  EXPECT_NEAR(light(29) / light(0), times[29] / times[0], 0.05 * times[29] / times[0]);
  EXPECT_GT(light(29) / 8, 1000);  // mean tap = amplitude of a contrast of 0.5
  EXPECT_LT(light(29) / 8, 8000);
}

TEST_F(Record, InfoShowsGapsAndRecordingsThatWereCutOff) {
  ASSERT_EQ(run(record + "-o a.h5 --frames 6").exit_code, 0);
  const hid_t capture = H5Fopen(file("a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t set = H5Dopen2(capture, "/frames/frame_number", H5P_DEFAULT);
  const std::vector<std::uint64_t> numbers = {0, 1, 5, 6, 2, 3};
  H5Dwrite(set, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
  H5Dclose(set);
  H5Fclose(capture);
  const Outcome info = run("\"$TOFGRAPH\" info a.h5");
  expect_words(info.out, {"3 frames missing, by frame_number, in 2 places", "after frame 1: 3 lost",
                          "after frame 3: the counter went back"});
  EXPECT_EQ(nlohmann::json::parse(run("\"$TOFGRAPH\" info --json a.h5").out)["lost"], 3);
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
  refuses(record + "-o a.h5 --for 3", {"--for", "no unit", "30 s"});
  refuses(record + "-o a.h5 --for '-3 s'", {"must be greater than 0"});
  refuses(record + "-o a.h5 --set integration_tim='1 ms'", {"integration_tim", "did you mean 'integration_time'"});
  refuses(record + "-o a.h5 --set integration_time='0.1 ms'", {"nearest valid time is 500 us"});
  refuses("\"$TOFGRAPH\" repair board.yaml", {"does not end with .part"});
}

}  // namespace
}  // namespace tofgraph::tests
