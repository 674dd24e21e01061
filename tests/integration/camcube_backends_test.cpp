// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Alone: cameras keep their own time
// Slow: CameraBackends.FaultsOf*:CameraBackends.FramesThat*:CameraBackends.GiveThe*:CameraBackends.NoTime*
// Slow: CameraBackends.RecordingsKeep*:CameraBackends.TakeAnother*:CameraBackends.TheVendorsLibraryIsRefused*
// Rooms: devices
// All camera backends give the same frames; the vendor's backend is tested with a substitute library.
#include "tests/camera_in_software.hpp"
#include "tests/unit/raw_capture.hpp"

#include <elf.h>
#include <gmock/gmock.h>
#include <hdf5.h>

#include <cmath>

namespace tofgraph::tests {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

const std::string stand_in = TOFGRAPH_BINARY_DIR "/tests/pmd/lib/libpmdaccess2.so";
constexpr const char* scene =
    "scene: 1\ncamera: camcube2\nframes: 4\noutput: [taps]\nintegration_time: 1 ms\nseed: 5\n"
    "objects:\n  - {name: board, type: board, distance: 700 mm, tilt_y: 20 deg}\n";

class CameraBackends : public testing::Test {
 protected:
  Outcome run(const std::string& environment, const std::string& pipeline, const std::string& more = "") const {
    return shell(environment + " \"$TOFGRAPH\" run '" + pipeline + "' " + more, folder.path());
  }
  std::string refused(const std::string& environment, const std::string& parameters) const {
    const Outcome outcome = run(environment, "camcube:pmdsdk library=" + stand_in + " " + parameters + " ! null");
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    return outcome.err;
  }
  std::filesystem::path file(const char* name) const { return folder.path() / name; }
  TemporaryFolder folder;
};

TEST_F(CameraBackends, GiveTheSameFramesBitForBit) {
  write_text(file("scene.yaml"), scene);
  ASSERT_EQ(shell("\"$TOFGRAPH\" simulate scene.yaml -o sim.h5", folder.path()).exit_code, 0);
  const auto taps = raw_values<std::uint16_t>(file("sim.h5"), "/frames/taps");
  ASSERT_EQ(taps.size(), 4U * 8 * 204 * 204);
  write_dump(file("dump.raw"), taps, 204 * 204);
  std::vector<std::pair<std::string, std::string>> ways = {
      {"simulated", "\"$TOFGRAPH\" run 'simulated:scene.yaml"},
      {"capture", "\"$TOFGRAPH\" run 'replay:sim.h5"},
      {"dump", "\"$TOFGRAPH\" run 'replay:dump.raw integration_time=\"1 ms\""},
      {"pmdsdk", "PMD_STAND_IN_RATE=2 PMD_STAND_IN_FRAMES=dump.raw \"$TOFGRAPH\" run 'camcube:pmdsdk library=" +
                     stand_in + " timeout=10s integration_time=\"1 ms\""}};
  if (has_software_camera())
    ways.emplace_back("usb",
                      with_software_camera("--rate 2 --frames dump.raw",
                                           "\"$TOFGRAPH\" run 'camcube:usb timeout=10s integration_time=\"1 ms\""));
  // Slow enough for a busy computer, since a live camera does not wait.
  for (const auto& [name, command] : ways) {
    const Outcome outcome = shell(command + " ! capture_writer path=" + name + ".h5' --frames 4", folder.path());
    ASSERT_EQ(outcome.exit_code, 0) << name << outcome.err;
    const auto capture = file((name + ".h5").c_str());
    EXPECT_TRUE(raw_values<std::uint16_t>(capture, "/frames/taps") == taps) << name;
    EXPECT_THAT(raw_values<double>(capture, "/frames/integration_time_s"), ElementsAre(1e-3, 1e-3, 1e-3, 1e-3)) << name;
    EXPECT_THAT(raw_values<double>(capture, "/frames/modulation_frequency_hz"), ElementsAre(20e6, 20e6, 20e6, 20e6))
        << name;
    const auto times = raw_values<std::int64_t>(capture, "/frames/timestamp_ns");
    for (std::size_t i = 1; i < 4; ++i) EXPECT_GT(times[i], times[i - 1]) << name;
    const auto numbers = raw_values<std::uint64_t>(capture, "/frames/frame_number");
    EXPECT_THAT(numbers, ElementsAre(0U, 1U, 2U, 3U)) << name;
  }
}

/// The images stay dark for any time, so that the controller increases the time up to the maximum.
TEST_F(CameraBackends, TakeAnotherIntegrationTimeBetweenFrames) {
  write_dump(file("dump.raw"), std::vector<std::uint16_t>(8U * 204 * 204, 100), 204 * 204);
  const std::string command =
      "\"$TOFGRAPH\" record -o a.h5 --force --frames 40 --set auto_integration_time=true --set "
      "integration_time='1 ms' --camera ";
  std::vector<std::string> ways = {"PMD_STAND_IN_RATE=20 PMD_STAND_IN_FRAMES=dump.raw " + command +
                                   "camcube:pmdsdk --set library=" + stand_in};
  if (has_software_camera())
    ways.push_back(with_software_camera("--rate 20 --frames dump.raw", command + "camcube:usb"));
  for (const std::string& way : ways) {
    const Outcome outcome = shell(way, folder.path());
    ASSERT_LE(outcome.exit_code, 1) << way << outcome.err;  // 1: a busy computer lost frames and reports it
    const auto times = raw_values<double>(file("a.h5"), "/frames/integration_time_s");
    ASSERT_FALSE(times.empty()) << outcome.err;
    EXPECT_DOUBLE_EQ(times.front(), 1e-3) << way;
    EXPECT_EQ(std::count(times.begin(), times.end(), 8e-3) > 0, true) << way << ": at most eight times as long";
    EXPECT_DOUBLE_EQ(times.back(), 50e-3) << way;
  }
}

/// The substitute library has times in steps of 10 us: the controller takes the nearest one, and the run continues.
TEST_F(CameraBackends, TakeTheNearestTimeThatTheCameraHas) {
  const auto brighter = [&](std::uint16_t a) {
    std::vector<std::uint16_t> taps(8U * 204 * 204, 0);
    std::fill(taps.begin(), taps.begin() + 204 * 204, a);  // A of one image: the amplitude is a / 2
    return taps;
  };
  write_dump(file("dump.raw"), brighter(1234), 204 * 204);
  const Outcome outcome = run("PMD_STAND_IN_RATE=40 PMD_STAND_IN_FRAMES=dump.raw",
                              "camcube:pmdsdk library=" + stand_in +
                                  " auto_integration_time=true integration_time=\"1 ms\" ! capture_writer path=a.h5",
                              "--frames 20");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto times = raw_values<double>(file("a.h5"), "/frames/integration_time_s");
  ASSERT_EQ(times.size(), 20U);
  // sqrt(1000 * 8000) / 617 = 4.5842: the images do not change, so that it continues from there to the maximum.
  EXPECT_EQ(std::count_if(times.begin(), times.end(), [](double t) { return std::abs(t - 4.58e-3) < 1e-9; }) > 0, true);
  EXPECT_DOUBLE_EQ(times.back(), 50e-3);
}

/// A computer that stalls for a second: frames dropped from the camera's own queue are missing in the recording.
TEST_F(CameraBackends, FramesThatMadeRoomAreCountedAsLost) {
  const Outcome outcome =
      shell("PMD_STAND_IN_RATE=80 \"$TOFGRAPH\" record --camera camcube:pmdsdk --set library=" + stand_in +
                " --set timeout=10s -o a.h5 --frames 60 & P=$!; until [ -e a.h5.part ]; do sleep 0.02; done; "
                "kill -STOP $P; sleep 1.5; kill -CONT $P; wait $P",
            folder.path());
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("came faster than they were taken"),
                                 HasSubstr("that came from the camera are not in the recording")));
  EXPECT_GT(raw_values<double>(file("a.h5"), "/frames/integration_time_s").size(), 10U) << "what came is there";
}

TEST_F(CameraBackends, TheVendorsLibraryIsFoundBelowItsFolder) {
  std::filesystem::create_directories(file("sdk/lib"));
  std::filesystem::create_directories(file("sdk/plugins"));
  std::filesystem::create_symlink(stand_in, file("sdk/lib/libpmdaccess2.so"));
  write_text(file("sdk/plugins/camcube3.L64.pap"), "");
  const Outcome outcome = run("PMDDIR=$PWD/sdk PMD_STAND_IN_LOG=log.txt",
                              "camcube roi=[0,0,204,204] "
                              "exposure_mode=SMB commands=\"SetSoftOffset 0; processing SetFOV 40\" ! null",
                              "--frames 3");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("serial 4711"), HasSubstr("not verified on hardware")));
  // The corrections of the vendor's software are switched off first.
  EXPECT_EQ(read_text(file("log.txt")),
            "open " + file("sdk/plugins/camcube3.L64.pap").string() +
                " camcubeproc\nSetFPNCalibration Off\nSetLensCalibration Off\n"
                "SetFPPNCalibration Off\nSetLinearityCalibration Off\nSetLensCalibration Off\n"
                "SetROI 0 0 204 204\nSetExposureMode SMB\nSetSoftOffset 0\nSetFOV 40\n"
                "GetSerialNumber\nclose\n");
  const Outcome left =
      run("PMDDIR=$PWD/sdk PMD_STAND_IN_LOG=left.txt", "camcube vendor_calibration=true ! null", "--frames 1");
  ASSERT_EQ(left.exit_code, 0) << left.err;
  EXPECT_THAT(read_text(file("left.txt")), testing::Not(HasSubstr("Calibration")));
  const Outcome told = shell("PMDDIR=$PWD/sdk \"$TOFGRAPH\" explain 'camcube ! null'", folder.path());
  EXPECT_THAT(told.out, HasSubstr("the vendor's calibrations (FPN, FPPN, linearity, lens) are switched off"));
  const Outcome listed = shell("PMDDIR=$PWD/sdk \"$TOFGRAPH\" devices", folder.path());
  EXPECT_THAT(listed.out, HasSubstr("the vendor's library is " + file("sdk/lib/libpmdaccess2.so").string()));
}

TEST_F(CameraBackends, TheVendorsImagesComeWithOurFlags) {
  const Outcome outcome =
      run("", "camcube:pmdsdk library=" + stand_in + " deliver=images ! capture_writer path=a.h5", "--frames 2");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto distance = raw_values<float>(file("a.h5"), "/frames/distance"),
             amplitude = raw_values<float>(file("a.h5"), "/frames/amplitude");
  const auto flags = raw_values<std::uint16_t>(file("a.h5"), "/frames/flags");
  for (std::size_t i = 0; i < 204 * 204; ++i) {  // generated by the substitute: 4 of its 32 flags are known
    ASSERT_EQ(flags[i], i & 15U);
    ASSERT_EQ(std::isnan(distance[i]), (i & 1U) != 0);
    ASSERT_FLOAT_EQ(amplitude[i], 0.5F * static_cast<float>(i));
    if ((i & 1U) != 0) continue;
    ASSERT_FLOAT_EQ(distance[i], 1e-4F * static_cast<float>(i));
  }
}

TEST_F(CameraBackends, TheVendorsLibraryIsRefusedWithTheReason) {
  std::string elf = read_text(stand_in).substr(0, 64);
  elf[18] = static_cast<char>(EM_AARCH64);
  elf[19] = 0;
  write_text(file("other/libpmdaccess2.so"), elf);
  const auto said = [&](const std::string& library) {
    const Outcome outcome = run("", "camcube:pmdsdk library=" + library + " ! null");
    EXPECT_EQ(outcome.exit_code, 2);
    return outcome.err;
  };
  EXPECT_THAT(said("other/libpmdaccess2.so"),
              HasSubstr("is for another architecture: ARM of 64 bits, this program is x86-64"));
  EXPECT_THAT(said("none/libpmdaccess2.so"), HasSubstr("none/libpmdaccess2.so: there is no such file"));
  const Outcome none = run("PMDDIR=$PWD/nowhere", "camcube ! null");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, AllOf(HasSubstr("no camera was found; tried:"), HasSubstr("pmdsdk: the vendor's library"),
                              HasSubstr("nowhere/lib/libpmdaccess2.so: there is no such file"), HasSubstr("usb: "),
                              HasSubstr("file: RECORDING or scene: SCENE.yaml")));
  EXPECT_THAT(refused("", "source_plugin=camcube9"),
              AllOf(HasSubstr("parameter 'source_plugin'"), HasSubstr("source plugin camcube9 not found")));
  EXPECT_THAT(refused("PMD_STAND_IN_FAULT=absent", ""),
              HasSubstr("no camera is connected (code 4098: could not open)"));
  EXPECT_THAT(refused("", "integration_time=\"1.234 ms\""), HasSubstr("the nearest valid value is 1.23 ms"));
  EXPECT_THAT(refused("", "integration_time=\"70 ms\""), HasSubstr("the nearest valid value is 50 ms"));
  EXPECT_THAT(refused("", "modulation_frequency=\"30 MHz\""), HasSubstr("the nearest valid value is 23 MHz"));
  EXPECT_THAT(refused("", "commands=\"SetFoo 1\""), HasSubstr("the camera refuses the command 'SetFoo 1'"));
  EXPECT_THAT(refused("", "roi=[0,0,200,200]"), HasSubstr("the size of the camera's profile, 204 x 204 px"));
}

TEST_F(CameraBackends, AnOlderLibraryServesForWhatItHas) {
  const std::string old = "camcube:pmdsdk library=" TOFGRAPH_BINARY_DIR "/tests/pmd/lib/libpmdaccess2_old.so ";
  const Outcome plain = run("", old + "! null", "--frames 2");
  EXPECT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_THAT(plain.err, HasSubstr("whether these calibrations are on is not known"));
  const Outcome time = run("", old + "integration_time=\"1 ms\" ! null", "--frames 2");
  EXPECT_EQ(time.exit_code, 2);
  EXPECT_THAT(time.err, HasSubstr("has no function pmdSetIntegrationTime"));
  const Outcome images = run("", old + "deliver=images ! null", "--frames 2");
  EXPECT_EQ(images.exit_code, 1);
  EXPECT_THAT(images.err, HasSubstr("has no function pmdGetDistances"));
}

TEST_F(CameraBackends, FaultsOfTheVendorsCamera) {
  const std::string camera = "camcube:pmdsdk library=" + stand_in;
  const std::pair<const char*, const char*> cases[] = {
      {"PMD_STAND_IN_FAULT=disconnect", "the camera was disconnected: the cable was pulled (code 1026: disconnected)"},
      {"PMD_STAND_IN_FAULT=block", "no frame came for 1 s: the camera does not answer"},
      {"PMD_STAND_IN_FAULT=timeout", "no frame came for 1 s: the camera does not answer"},
      {"PMD_STAND_IN_TYPE=0x1007", "of type 0x1007, which is not known to hold taps A and B"},
      {"PMD_STAND_IN_PIXELS=100", "the camera gives 3648 bytes a frame, one of 204 x 204 px has 667904"}};
  for (const auto& [environment, text] : cases) {
    const Outcome outcome = run(environment, camera + " ! null", "--frames 40");
    EXPECT_EQ(outcome.exit_code, 1) << environment;
    EXPECT_THAT(outcome.err, HasSubstr(text)) << environment;
  }
  // The program waits for a call that never returns, and opens no second camera meanwhile.
  const Outcome stuck =
      shell("PMD_STAND_IN_FAULT=block PMD_STAND_IN_LOG=stuck.txt \"$TOFGRAPH\" run '" + camera +
                " reconnect=true timeout=\"0.2 s\" ! null' & pid=$!; sleep 4; kill -TERM $pid; wait $pid",
            folder.path());
  EXPECT_THAT(stuck.err, HasSubstr("has not returned yet: the camera cannot be opened again before"));
  const std::string calls = read_text(file("stuck.txt"));
  EXPECT_EQ(calls.find("open "), calls.rfind("open ")) << calls;
  const Outcome back = run("PMD_STAND_IN_FAULT=disconnect PMD_STAND_IN_RETURNS=0.4",
                           camera + " reconnect=true ! frame_audit path=audit.json", "--frames 40");
  EXPECT_EQ(back.exit_code, 0) << back.err;
  EXPECT_THAT(back.err, AllOf(HasSubstr("waiting for the camera"), HasSubstr("the camera is back")));
  const nlohmann::json found = json_in(file("audit.json"));
  EXPECT_EQ(found["frames"], 40);
  EXPECT_GE(found["lost"], 30);  // 0.4 s at 80 frames/s
  EXPECT_EQ(found["doubled"], 0);
}

TEST_F(CameraBackends, RecordingsKeepTheirPace) {
  write_text(file("scene.yaml"), scene);
  ASSERT_EQ(shell("\"$TOFGRAPH\" simulate scene.yaml -o sim.h5", folder.path()).exit_code, 0);
  const auto seconds = [&](const std::string& pipeline, const std::string& more) {
    const Outcome outcome = run("", pipeline + " ! frame_audit path=audit.json", "--force --stats stats.json " + more);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return json_in(file("stats.json"))["wall_s"].get<double>();
  };
  const double paced = seconds("replay:sim.h5 loop=true", "--frames 41");  // at 80 frames/s
  EXPECT_GT(paced, 0.49);
  EXPECT_LT(paced, 60);
  EXPECT_EQ(json_in(file("audit.json"))["doubled"], 0);
  EXPECT_EQ(json_in(file("audit.json"))["lost"], 0);
  EXPECT_EQ(json_in(file("stats.json"))["edges"][0]["policy"], "drop_oldest");
  const double fast = seconds("replay:sim.h5 loop=true pace=fast", "--frames 41");
  EXPECT_LT(fast, sanitized ? 60 : paced);
  EXPECT_EQ(json_in(file("stats.json"))["edges"][0]["policy"], "block");  // a file can wait
  EXPECT_EQ(json_in(file("audit.json"))["frames"], 41);
  seconds("replay:sim.h5", "");
  EXPECT_EQ(json_in(file("audit.json"))["frames"], 4);  // once, then the end
}

/// Recorded time stamps are unreliable: clocks are set back, and files are damaged.
TEST_F(CameraBackends, NoTimeStampMakesAReplayWait) {
  write_text(file("scene.yaml"), scene);
  ASSERT_EQ(shell("\"$TOFGRAPH\" simulate scene.yaml -o sim.h5", folder.path()).exit_code, 0);
  const std::int64_t hour = 3'600'000'000'000, great = std::numeric_limits<std::int64_t>::max();
  const std::vector<std::int64_t> cases[] = {
      {1000, hour, hour + 12'500'000, hour + 25'000'000}, {great - 1, -great, great, 5}, {hour, 10, 20, 30}};
  for (const std::vector<std::int64_t>& stamps : cases) {
    const hid_t capture = H5Fopen(file("sim.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT),
                set = H5Dopen2(capture, "/frames/timestamp_ns", H5P_DEFAULT);
    H5Dwrite(set, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, stamps.data());
    H5Dclose(set);
    H5Fclose(capture);
    const Outcome outcome =
        run("", "replay:sim.h5 loop=true ! frame_audit path=audit.json", "--force --frames 6 --stats stats.json");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("of its time stamps"));
    EXPECT_LT(json_in(file("stats.json"))["wall_s"].get<double>(), 12);
    EXPECT_EQ(json_in(file("audit.json"))["frames"], 6);
  }
}

TEST_F(CameraBackends, TheSimulatedCameraHonoursItsSettings) {
  write_text(file("scene.yaml"), scene);
  const Outcome outcome =
      run("", "simulated:scene.yaml integration_time=\"2 ms\" frame_rate=\"20 Hz\" ! capture_writer path=a.h5",
          "--frames 9 --stats stats.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_GE(json_in(file("stats.json"))["wall_s"], 0.45);
  EXPECT_EQ(raw_values<double>(file("a.h5"), "/frames/integration_time_s"), std::vector<double>(9, 2e-3));
  const auto times = raw_values<std::int64_t>(file("a.h5"), "/frames/timestamp_ns");
  for (std::size_t i = 1; i < times.size(); ++i) EXPECT_EQ(times[i] - times[i - 1], 50'000'000);
  // Twice the time gives twice the light: the board is the same.
  ASSERT_EQ(run("", "simulated:scene.yaml ! capture_writer path=b.h5", "--frames 1").exit_code, 0);
  const auto mean = [&](const char* name) {
    const auto taps = raw_values<std::uint16_t>(file(name), "/frames/taps");
    double sum = 0;
    for (std::size_t i = 0; i < 8U * 204 * 204; ++i) sum += taps[i];
    return sum / (8 * 204 * 204);
  };
  EXPECT_NEAR(mean("a.h5") / mean("b.h5"), 2, 0.01);
  const Outcome wrong = run("", "simulated:scene.yaml integration_time=\"0.1 ms\" ! null");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("the nearest valid time is 500 us"));
}

TEST_F(CameraBackends, TheLivePipelineGivesTheCloudsOfItsDump) {
  const std::string shipped = "\"$TOFGRAPH\" run " TOFGRAPH_SOURCE_DIR "/pipelines/";
  const Outcome live = shell(shipped + "live_camcube.yaml --set save.path='live_{frame}.pcd'", folder.path()),
                read = shell(shipped +
                                 "raw_dump_to_cloud.yaml --set save.path='file_{frame}.pcd' --set save.sigma=false "
                                 "--set save.flags=false",
                             folder.path());
  ASSERT_EQ(live.exit_code, 0) << live.err;
  ASSERT_EQ(read.exit_code, 0) << read.err;
  EXPECT_GT(read_text(file("live_1.pcd")).size(), 102U * 102 * 12);
  EXPECT_TRUE(read_text(file("live_0.pcd")) == read_text(file("file_0.pcd")));
  EXPECT_TRUE(read_text(file("live_1.pcd")) == read_text(file("file_1.pcd")));
}

TEST_F(CameraBackends, WhatIsNoRecordingIsRefused) {
  write_text(file("short.raw"), std::string(1000, 'x'));
  const auto said = [&](const std::string& pipeline) {
    const Outcome outcome = run("", pipeline + " ! null");
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(said("replay:short.raw"), HasSubstr("1000 bytes, which is not a whole number of frames of 667904"));
  EXPECT_THAT(said("replay:none.h5"), HasSubstr("cannot read " + file("none.h5").string()));
  EXPECT_THAT(said("replay:" TOFGRAPH_SOURCE_DIR "/pipelines/data/o3d303_scene.h5"),
              HasSubstr("has neither taps nor phases"));
  EXPECT_THAT(said("camcube backend=replay"), HasSubstr("a replay needs a recording, e.g. file: board.h5"));
  EXPECT_THAT(said("camcube backend=simulated"), HasSubstr("a simulated camera needs a scene"));
}

}  // namespace
}  // namespace tofgraph::tests
