// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Alone: cameras keep their own time
// Slow: Each/UsbCameraFault.EndsTheRunInOrder/*:Each/UsbCameraFault.LeavesAGapInTheCounterWhereTheRunGoesOn/*
// Slow: UsbCamera.DoesNot*:UsbCamera.GivesEvery*:UsbCamera.GivesPoints*:UsbCamera.IsAsked*:UsbCamera.IsChosen*
// Slow: UsbCamera.TakesAnother*:UsbCamera.ThatCannot*
// Rooms: devices
// The program with the real libusb and a software camera: the frames it reads, and its messages when the camera fails.
#include "tests/camera_in_software.hpp"

#include <gmock/gmock.h>

namespace tofgraph::tests {
namespace {

using testing::HasSubstr;

/// Time after which a run counts as hanging. The actual time is printed: below 2 s on an idle computer.
constexpr std::chrono::seconds patience(20);

class UsbCamera : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_software_camera()) GTEST_SKIP() << "umockdev is not installed";
    write_dump(folder.path() / "dump.raw", distinct_taps(5), 204 * 204);
  }
  Outcome run(const std::string& options, const std::string& command) const {
    return shell(with_software_camera("--frames dump.raw --report report.json " + options, command), folder.path());
  }
  /// Runs the camera into the sink that audits the stream.
  Outcome audited(const std::string& options, const std::string& parameters, const std::string& more = "") const {
    return run(options, "\"$TOFGRAPH\" run 'camcube:usb " + parameters +
                            " ! frame_audit dump=dump.raw path=audit.json' " + more);
  }
  nlohmann::json audit() const { return json_in(folder.path() / "audit.json"); }
  nlohmann::json report() const { return json_in(folder.path() / "report.json"); }
  TemporaryFolder folder;
};

TEST_F(UsbCamera, GivesEveryFrameOnceAndAsItIs) {
  const Outcome outcome =
      audited("", "integration_time=\"1.5 ms\" modulation_frequency=\"21 MHz\"", "--frames 400 --stats stats.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("not verified on hardware"));
  const nlohmann::json found = audit(), sent = report();
  const int dropped = json_in(folder.path() / "stats.json")["dropped"];
  EXPECT_EQ(found["frames"].get<int>() + dropped, 400);
  EXPECT_EQ(found["wrong"], 0);
  EXPECT_EQ(found["doubled"], 0);
  EXPECT_EQ(sent["integration_time_us"], 1500);
  EXPECT_EQ(sent["modulation_frequency_hz"], 21'000'000);
  if (sanitized) return;  // too slow to keep up
  std::printf("lost %s of 400 frames, %s of them in the camera\n", found["lost"].dump().c_str(),
              sent["frames_overrun"].dump().c_str());
  // A camera that is not polled for 25 ms loses frames itself: this happens on a busy computer.
  EXPECT_LE(found["lost"], sent["frames_overrun"].get<int>() + dropped);
  const double grown = found["memory_at_the_end"].get<double>() - found["memory_after_200_frames"].get<double>();
  EXPECT_LT(grown, 10e6);  // a frame is 0.7 MB
}

TEST_F(UsbCamera, IsListedWithWhatKeepsItFromBeingOpened) {
  const auto listed = [&](const std::string& options) {
    const Outcome outcome = run(options, "\"$TOFGRAPH\" devices --json");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const nlohmann::json two = listed("--cameras 2");
  ASSERT_EQ(two["cameras"].size(), 2U);
  EXPECT_EQ(two["cameras"][0]["serial"], "SOFT1");
  EXPECT_EQ(two["cameras"][0]["name"], "CamCube");
  EXPECT_EQ(two["cameras"][1]["port"], "1-2");
  EXPECT_TRUE(two["cameras"][0]["problem"].is_null());
  EXPECT_EQ(listed("--product c007")["cameras"][0]["name"], "CamBoard nano");
  EXPECT_TRUE(listed("--cameras 0")["cameras"].empty());
}

TEST_F(UsbCamera, ThatOnlyRootMayOpenIsToldWithTheRuleToInstall) {
  if (geteuid() == 0) GTEST_SKIP() << "root may open every device";
  const Outcome listed = run("--mode 0", "\"$TOFGRAPH\" devices --json");
  const std::string problem = nlohmann::json::parse(listed.out)["cameras"][0]["problem"];
  EXPECT_THAT(problem, HasSubstr("permission denied"));
  EXPECT_THAT(problem, HasSubstr("60-tofgraph.rules /etc/udev/rules.d/"));
  const Outcome refused = audited("--mode 0", "");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("60-tofgraph.rules"));
}

TEST_F(UsbCamera, IsChosenByItsSerialNumberOrPort) {
  const Outcome either = audited("--cameras 2", "", "--frames 2");
  EXPECT_EQ(either.exit_code, 2);
  EXPECT_THAT(either.err, HasSubstr("2 cameras are plugged in"));
  EXPECT_THAT(either.err, HasSubstr("device: SOFT1"));
  for (const char* device : {"SOFT2", "1-2"}) {
    const Outcome second = audited("--cameras 2", std::string("device=") + device, "--frames 2 --force");
    EXPECT_EQ(second.exit_code, 0) << second.err;
    EXPECT_THAT(second.err, HasSubstr("port 1-2, serial SOFT2"));
  }
  const Outcome third = audited("--cameras 2", "device=SOFT3", "--frames 2 --force");
  EXPECT_EQ(third.exit_code, 2);
  EXPECT_THAT(third.err, HasSubstr("has the serial number or port 'SOFT3'"));
}

TEST_F(UsbCamera, ThatCannotBeUsedIsRefusedBeforeTheFirstFrame) {
  const std::pair<const char*, const char*> cases[] = {
      {"--fault mute", "the command 'identify' was not answered within 500 ms"},
      {"--fault refuse", "the command 'identify' is refused by the camera"},
      {"--fault stranger", "is answered by 54 99 01 00"},
      {"--product c004", "no camera 1c28:c003 is plugged in; there is 1c28:c004 CamBoard"},
      {"--cameras 0", "no camera 1c28:c003 is plugged in"}};
  for (const auto& [options, text] : cases) {
    const auto start = std::chrono::steady_clock::now();
    const Outcome outcome = audited(options, "");
    EXPECT_EQ(outcome.exit_code, 2) << options;
    EXPECT_THAT(outcome.err, HasSubstr(text)) << options;
    EXPECT_LT(std::chrono::steady_clock::now() - start, patience) << options;
  }
  const Outcome time = audited("", "integration_time=\"70 ms\"");
  EXPECT_EQ(time.exit_code, 2);
  EXPECT_THAT(time.err, HasSubstr("the nearest valid time is 50 ms"));
}

struct FaultCase {
  const char *name, *text;
};

class UsbCameraFault : public UsbCamera, public testing::WithParamInterface<FaultCase> {
 protected:
  std::string options() const { return std::string("--at 24 --returns 0.3 --fault ") + GetParam().name; }
};

TEST_P(UsbCameraFault, EndsTheRunInOrder) {
  const Outcome outcome = audited(options(), "", "--frames 2000");
  const double end = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(GetParam().text));
  const nlohmann::json found = audit();  // everything before it is complete
  EXPECT_THAT(outcome.err, HasSubstr("node 'camcube' (camcube), frame " + found["frames"].dump()));
  EXPECT_EQ(found["wrong"], 0);
  EXPECT_GE(found["frames"], sanitized ? 1 : 19);  // on a slow computer the camera loses some
  const double seconds = end - report()["fault_unix_s"].get<double>();
  std::printf("%s: the program had ended %.2f s after the fault\n", GetParam().name, seconds);
  EXPECT_LT(seconds, patience.count());
}

TEST_P(UsbCameraFault, LeavesAGapInTheCounterWhereTheRunGoesOn) {
  const Outcome outcome = audited(options(), "reconnect=true", "--frames 80 --stats stats.json");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(GetParam().text));
  const nlohmann::json found = audit();
  const int dropped = json_in(folder.path() / "stats.json")["dropped"];  // at a sink that got no processor time
  EXPECT_EQ(found["frames"].get<int>() + dropped, 80);
  EXPECT_EQ(found["doubled"], 0);
  const std::string name = GetParam().name;
  if (name == "twice") return;  // nothing is missing
  EXPECT_GE(found["lost"], 1);
  if (sanitized) return;
  if (name == "unplug") {
    EXPECT_GE(found["lost"], 24);  // 0.3 s at 80 frames/s, plus the time to find it again
  } else if (name != "silent") {
    // The report counts the frames that the camera itself lost because the computer was busy.
    EXPECT_LE(found["lost"], 1 + report()["frames_overrun"].get<int>() + dropped);
    EXPECT_EQ(found["wrong"], 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Each, UsbCameraFault,
                         testing::Values(FaultCase{"unplug", "the camera was unplugged"},
                                         FaultCase{"stall", "the camera stalled; the stall was cleared"},
                                         FaultCase{"short",
                                                   "a transfer brought 1000 bytes, an image of this camera "
                                                   "has 166976"},
                                         FaultCase{"garbage", "has a5 a5 a5 a5 at byte 0, expected 54 46 47 49"},
                                         FaultCase{"half", "half a frame: its image 2 is missing"},
                                         FaultCase{"silent", "no frame came for 1 s: the camera does not answer"},
                                         FaultCase{"twice", "came twice"},
                                         FaultCase{"babble", "more than an image at once"}),
                         [](const auto& fault) { return std::string(fault.param.name); });

/// The time is changed by the reading thread while the transport's thread clears a stall.
TEST_F(UsbCamera, TakesAnotherTimeWhileItStalls) {
  write_dump(folder.path() / "dump.raw", std::vector<std::uint16_t>(8U * 204 * 204, 100), 204 * 204);
  for (const char* at : {"1", "2", "4"}) {
    const Outcome outcome = run(std::string("--fault stall --at ") + at,
                                "\"$TOFGRAPH\" run 'camcube:usb reconnect=true auto_integration_time=true "
                                "integration_time=\"1 ms\" ! frame_audit path=audit.json' --frames 40 --force");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("the stall was cleared"));
    EXPECT_THAT(outcome.err, testing::Not(HasSubstr("ThreadSanitizer"))) << outcome.err;
    EXPECT_EQ(audit()["doubled"], 0);
    EXPECT_EQ(report()["integration_time_us"], 50'000) << "the images stay dark";
  }
}

/// The command has two bytes for the time: times beyond 65 ms are not sent; a reopened camera gets the last time.
TEST_F(UsbCamera, IsAskedForNoTimeThatItsCommandCannotSay) {
  write_dump(folder.path() / "dump.raw", std::vector<std::uint16_t>(8U * 204 * 204, 100), 204 * 204);
  std::string profile = read_text(TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml");
  std::string protocol = read_text(TOFGRAPH_SOURCE_DIR "/devices/camcube/software_camera.yaml");
  const auto at = protocol.find("integration_time: {offset: 12, type: u32le}");
  ASSERT_NE(at, std::string::npos);
  protocol.replace(at, 43, "integration_time: {offset: 12, type: u16le}");
  write_text(folder.path() / "narrow.yaml", protocol);
  const auto range = profile.find("integration_time:");
  ASSERT_NE(range, std::string::npos);
  profile.replace(range, profile.find('\n', range) - range, "integration_time: [0.5 ms, 200 ms]");
  write_text(folder.path() / "long.yaml", profile);
  const Outcome outcome = run("--fault unplug --at 20 --returns 0.2",
                              "\"$TOFGRAPH\" run 'camcube:usb reconnect=true protocol=narrow.yaml "
                              "auto_integration_time=true integration_time=\"1 ms\" ! frame_audit path=audit.json' "
                              "--camera ./long.yaml --frames 40");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("the camera is back"));
  EXPECT_EQ(report()["integration_time_us"], 65'535);
}

TEST_F(UsbCamera, ThatDoesNotGiveItsTransfersBackIsLeftAlone) {
  const auto start = std::chrono::steady_clock::now();
  const Outcome outcome = audited("--fault cling", "", "--frames 20");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(audit()["frames"], 20);
  EXPECT_LT(std::chrono::steady_clock::now() - start, patience);
}

TEST_F(UsbCamera, ThatNeedsMoreMemoryThanThereIsSaysWhichKey) {
  std::string protocol = read_text(TOFGRAPH_SOURCE_DIR "/devices/camcube/software_camera.yaml");
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(protocol.find(from), std::string::npos);
    protocol.replace(protocol.find(from), from.size(), to);
  };
  replace("transfers: 32", "transfers: 64");
  replace("message: image", "message: frame");
  write_text(folder.path() / "greedy.yaml", protocol);
  const Outcome outcome = run("--memory 16", "\"$TOFGRAPH\" run 'camcube:usb protocol=greedy.yaml ! null' --frames 1");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("64 transfers of 667904 bytes need 43 MB, the system gives 16 MB to USB"));
  EXPECT_THAT(outcome.err, HasSubstr("'transfers' may be 23 here"));
  EXPECT_THAT(outcome.err, HasSubstr("usbfs_memory_mb"));
}

TEST_F(UsbCamera, ThatStaysAwayIsWaitedForUntilAnInterrupt) {
  const std::string command =
      with_software_camera("--fault unplug", "\"$TOFGRAPH\" run 'camcube:usb reconnect=true ! null'");
  const Outcome outcome = shell(command +
                                    " 2>said & pid=$!; for _ in $(seq 400); do grep -q 'waiting for' said && break; "
                                    "sleep 0.05; done; kill -TERM $pid; wait $pid",
                                folder.path());
  const std::string said = read_text(folder.path() / "said");
  EXPECT_EQ(outcome.exit_code, 130) << said;
  EXPECT_THAT(said, HasSubstr("waiting for the camera: no camera 1c28:c003 is plugged in"));
  EXPECT_THAT(said, HasSubstr("interrupted: the frames up to here are complete"));
}

TEST_F(UsbCamera, EndsWhenAnotherNodeFails) {
  const Outcome outcome =
      run("",
          "\"$TOFGRAPH\" run 'camcube:usb reconnect=true ! four_phase_decoder ! throws_in_process ! "
          "null' --plugin-path '" TOFGRAPH_BINARY_DIR "/tests/broken'");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("node 'throws_in_process'"));
}

TEST_F(UsbCamera, DoesNotWaitForASlowSink) {
  const Outcome outcome =
      run("",
          "\"$TOFGRAPH\" run 'camcube:usb ! frame_audit dump=dump.raw delay=\"50 ms\" path=audit.json' "
          "--frames 160 --stats stats.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(" dropped"));
  const nlohmann::json found = audit(), stats = json_in(folder.path() / "stats.json");
  EXPECT_EQ(stats["edges"][0]["policy"], "drop_oldest");
  EXPECT_GT(stats["dropped"], 40);
  EXPECT_EQ(found["wrong"], 0);
  EXPECT_EQ(found["doubled"], 0);
  EXPECT_GE(found["last"], 155);  // the newest were kept
  if (sanitized) return;
  EXPECT_EQ(found["frames"].get<int>() + stats["dropped"].get<int>(), 160);
  EXPECT_LT(found["latency_median_s"], 1.0);  // queued frames are bounded: four, plus those in progress
}

TEST_F(UsbCamera, GivesPointsBeforeTheNextFrameIsThere) {
  const Outcome outcome = run("",
                              "\"$TOFGRAPH\" run 'camcube:usb ! four_phase_decoder ! optimized_bistatic ! point_cloud "
                              "! frame_audit path=audit.json' --frames 240 --threads 2");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json found = audit();
  const double median = found["latency_median_s"];
  std::printf("last byte to points: median %.2f ms, 99 %% %.2f ms\n", median * 1e3,
              found["latency_p99_s"].get<double>() * 1e3);
  if (sanitized) return;
  EXPECT_LT(median, 1 / 80.0);  // 2 ms on an otherwise idle computer
}

}  // namespace
}  // namespace tofgraph::tests
