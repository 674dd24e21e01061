// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Exposures.HavePreviews*
// Rooms: graph cli
// Exposures from the profile to the capture and back, and every way to write them wrongly, as a user sees it.
#include <hdf5.h>

#include "tests/program.hpp"
#include "tests/unit/raw_capture.hpp"

#include <regex>

namespace tofgraph::tests {
namespace {

/// A small camera with these exposures.
std::string profile_with(const std::string& exposures, const std::string& more = "modulation_frequency: 20 MHz\n") {
  return "profile: 1\nname: small\nwidth: 32\nheight: 24\npixel_pitch: 40 um\nfocal_length: 3 mm\n"
         "principal_point: [15.5, 11.5]\n" +
         more +
         "sources:\n  - {name: lamp, position: [0 mm, 0 mm, 0 mm], amplitude: 1}\nframe_rate: 30 Hz\n"
         "gain: 1e8 counts m^2/s\ncontrast: 0.5\nread_noise: 3 counts\nshot_noise: 0.05 counts\n"
         "full_well: 60000 counts\n" +
         exposures;
}
constexpr const char* six =
    "exposures:\n"
    "  - {phase: 0 deg, frequency: 80 MHz}\n  - {phase: 120 deg, frequency: 80 MHz}\n"
    "  - {phase: 240 deg, frequency: 80 MHz}\n  - {phase: 0 deg, frequency: 60 MHz}\n"
    "  - {phase: 120 deg, frequency: 60 MHz}\n  - {phase: 240 deg, frequency: 60 MHz}\n";

class Exposures : public testing::Test {
 protected:
  TemporaryFolder folder;

  Outcome run(const std::string& command) const { return shell("$TOFGRAPH " + command, folder.path()); }
  void write(const std::string& name, const std::string& text) const { write_text(folder.path() / name, text); }
  void expect_error(const std::string& command, const std::vector<std::string>& words, int exit_code = 2) const {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    for (const std::string& word : words)
      EXPECT_NE(outcome.err.find(word), std::string::npos) << "not there: " << word << "\n" << outcome.err;
  }
  void expect_profile_error(const std::string& exposures, const std::vector<std::string>& words,
                            const std::string& more = "modulation_frequency: 20 MHz\n") const {
    write("wrong.yaml", profile_with(exposures, more));
    expect_error("check wrong.yaml", words);
  }
};

TEST_F(Exposures, GoFromTheProfileThroughACaptureToTheDistance) {
  write("small.yaml", profile_with(six, ""));
  const Outcome recorded = run(
      "run 'simulator distance=5.3m integration_time=1ms frames=2 output=taps truth=true ! capture_writer path=six.h5 "
      "channels=[taps,true_depth]' --camera ./small.yaml");
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  const Outcome read =
      run("run 'capture_reader file=six.h5 channels=[taps,true_depth] ! phase_decoder ! optimized_bistatic ! "
          "statistics "
          "channel=depth reference=true_depth path=depth.csv'");
  ASSERT_EQ(read.exit_code, 0) << read.err;
  std::smatch found;
  const std::string table = read_text(folder.path() / "depth.csv");
  ASSERT_TRUE(std::regex_search(table, found, std::regex("all,([0-9]+),([0-9.e-]+),.*,([0-9.e-]+),true_depth")))
      << table;
  EXPECT_EQ(found[1], "1536") << "all pixels of two frames";
  EXPECT_NEAR(std::stod(found[2]), 5.3, 2e-3);
  EXPECT_LT(std::stod(found[3]), 0.02) << "rms, m: noise of about 10 mm, and no wrong wrap";
}

TEST_F(Exposures, AreAttributesOfTheCaptureWhereTheyAreNotTheFour) {
  write("small.yaml", profile_with(six, ""));
  ASSERT_EQ(run("run 'simulator ! capture_writer path=six.h5' --camera ./small.yaml").exit_code, 0);
  const auto numbers = [&](const char* file, const char* name) {
    std::vector<double> values;
    const hid_t h5 = H5Fopen((folder.path() / file).c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    if (H5Aexists(h5, name) > 0) {
      const hid_t attribute = H5Aopen(h5, name, H5P_DEFAULT), space = H5Aget_space(attribute);
      values.resize(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
      H5Aread(attribute, H5T_NATIVE_DOUBLE, values.data());
      H5Sclose(space);
      H5Aclose(attribute);
    }
    H5Fclose(h5);
    return values;
  };
  const std::vector<double> phases = numbers("six.h5", "exposure_phase_rad");
  ASSERT_EQ(phases.size(), 6U);
  EXPECT_NEAR(phases[4], 2 * M_PI / 3, 1e-12);
  EXPECT_EQ(numbers("six.h5", "exposure_frequency_hz"), (std::vector<double>{80e6, 80e6, 80e6, 60e6, 60e6, 60e6}));
  ASSERT_EQ(run("run 'simulator ! capture_writer path=four.h5' --camera camcube2").exit_code, 0);
  EXPECT_TRUE(numbers("four.h5", "exposure_phase_rad").empty());
}

TEST_F(Exposures, AreShown) {
  write("small.yaml", profile_with(six, ""));
  ASSERT_EQ(run("run 'simulator ! capture_writer path=six.h5' --camera ./small.yaml").exit_code, 0);
  const std::string text = "6 exposures: 0, 120, 240 deg at 80 MHz; 0, 120, 240 deg at 60 MHz";
  for (const char* command : {"info six.h5", "describe ./small.yaml", "explain 'capture_reader file=six.h5 ! null'"}) {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find(text), std::string::npos) << command << "\n" << outcome.out;
  }
  EXPECT_NE(run("describe ./small.yaml").out.find("unambiguous to 7.495 m"), std::string::npos);
  EXPECT_NE(run("describe camcube2").out.find("4 exposures: 0, 90, 180, 270 deg; unambiguous to 7.495 m"),
            std::string::npos);
}

TEST_F(Exposures, InfoSaysWhatIsInACapture) {
  ASSERT_EQ(
      run("run 'simulator frames=3 integration_time=2ms ! capture_writer path=four.h5' --camera camcube2").exit_code,
      0);
  const Outcome outcome = run("info four.h5");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* words :
       {"camera camcube2, 204 x 204 px, 3 frames", "phases", "float32 4 x 204 x 204, counts",
        "integration time       2 ms", "modulation frequency   20 MHz", "no gap in the frame numbers; they begin at 0"})
    EXPECT_NE(outcome.out.find(words), std::string::npos) << words << "\n" << outcome.out;
  expect_error("info nothing.h5", {"nothing.h5", "there is no such file"});
}

TEST_F(Exposures, WrongOnesAreToldWhereTheyAreWritten) {
  expect_profile_error("exposures: 4\n", {"wrong.yaml:17:12: error: 'exposures' is '4', expected a list"});
  expect_profile_error("exposures: [{phase: 0 deg}, {phase: 180 deg}]\n",
                       {"wrong.yaml:17:12", "a frame has 2 exposures, expected 3 to 32", "example: exposures: ["});
  expect_profile_error("exposures: [{phase: 0 deg}, {phase: 180 deg}, {phase: 360 deg}]\n",
                       {"wrong.yaml:17:12", "the steps 0, 180, 360 deg are only 2 different ones"});
  expect_profile_error("exposures: [{phase: 0 deg}, {phase: 0.1 deg}, {phase: 0.2 deg}]\n",
                       {"wrong.yaml:17:12", "the phase is undetermined"});
  expect_profile_error("exposures:\n  - {phase: 0 deg}\n  - {phase: 90 deg, frequency: 0 Hz}\n  - {phase: 180 deg}\n",
                       {"wrong.yaml:19:", "'frequency' is '0 Hz', expected more than 0"});
  expect_profile_error("exposures: [{phase: 0 deg}, {phase: 90 deg, frequency: 20 MHz}, {phase: 180 deg}]\n",
                       {"wrong.yaml:17:12", "exposure 1 has the frequency"});
  expect_profile_error(
      "exposures: [{phase: 0 deg, frequency: 30 MHz}, {phase: 120 deg, frequency: 30 MHz}, {phase: 240 deg, frequency: "
      "30 "
      "MHz}]\n",
      {"wrong.yaml:8:",
       "'modulation_frequency' is 20 MHz, which none of the exposures has: 3 exposures: 0, 120, 240 deg at 30 MHz"});
  expect_profile_error("exposures: [{phase: 0 rad}, {phase: 120 rad}, {phase: 240 rad}]\n",
                       {"wrong.yaml:17:", "'phase' is 6875.4935 deg, expected -360 to 360 deg"});
  expect_profile_error("exposures: [{phase: 0 m}, {phase: 120 deg}, {phase: 240 deg}]\n", {"wrong.yaml:17:", "phase"});
  expect_profile_error("exposures: [{phas: 0 deg}, {phase: 120 deg}, {phase: 240 deg}]\n", {"wrong.yaml:17:", "phas"});
}

TEST_F(Exposures, ACaptureThatContradictsItselfIsTold) {
  write("small.yaml", profile_with(six, ""));
  const auto capture = [&](std::vector<double> phases, std::vector<double> frequencies, hsize_t images) {
    const auto file = folder.path() / "odd.h5";
    RawCapture raw(file);
    raw.head(32, 24, 1, "tofgraph-capture", "small");
    raw.dataset("phases", {1, images, 24, 32}, std::vector<float>(images * 24 * 32, 1.0F)).metadata(1, 1e-3);
    if (!phases.empty()) raw.numbers("exposure_phase_rad", phases);
    if (!frequencies.empty()) raw.numbers("exposure_frequency_hz", frequencies);
  };
  const std::string read = "check 'capture_reader file=odd.h5 ! null' --camera ./small.yaml";
  capture({}, {}, 9);
  expect_error(
      read, {"'phases' is float32 9 x 24 x 32, counts, which is 9 images, but the camera's profile has 6 exposures"});
  capture({0, 2, 4}, {}, 9);
  expect_error(read, {"odd.h5", "/frames/phases", "expected 1 x 3 x 24 x 32"});
  capture({0, 2, 4}, {20e6, 20e6}, 3);
  expect_error(read, {"odd.h5", "exposure_phase_rad has 3 values, but exposure_frequency_hz has 2"});
  capture({0, 2, 2}, {}, 3);
  expect_error(read, {"odd.h5", "are only 2 different ones"});
  capture({0, 2, 4}, {20e6, 0, 20e6}, 3);
  expect_error(read, {"odd.h5", "exposure 1 has a frequency of 0 Hz or none"});
  capture({0, 2, 4}, {}, 3);
  const Outcome other = run("run 'capture_reader file=odd.h5 ! null' --camera ./small.yaml");
  EXPECT_EQ(other.exit_code, 0) << other.err;
  EXPECT_NE(other.err.find("the exposures of the capture (3) are not those of the profile 'small'"), std::string::npos)
      << other.err;
}

TEST_F(Exposures, OfACaptureStayThoughAProfileSaysOtherwise) {
  write("four.yaml", profile_with(""));
  write("reversed.yaml",
        profile_with("exposures: [{phase: 0 deg}, {phase: 270 deg}, {phase: 180 deg}, {phase: 90 deg}]\n"));
  {
    RawCapture raw(folder.path() / "own.h5");
    std::vector<float> phases;
    for (const double c : {1000.0, 500.0, -1000.0, -500.0}) phases.insert(phases.end(), 24 * 32, static_cast<float>(c));
    raw.head(32, 24, 1, "tofgraph-capture", "small").numbers("exposure_phase_rad", {0, M_PI / 2, M_PI, 3 * M_PI / 2});
    raw.dataset("phases", {1, 4, 24, 32}, phases).metadata(1, 1e-3);
  }
  ASSERT_EQ(run("run 'capture_reader file=own.h5 ! capture_writer path=again.h5' --camera ./reversed.yaml").exit_code,
            0);
  const std::string decode = " ! four_phase_decoder modulation_frequency=20MHz ! statistics channel=distance path=";
  ASSERT_EQ(run("run 'capture_reader file=own.h5" + decode + "first.csv' --camera ./reversed.yaml").exit_code, 0);
  ASSERT_EQ(run("run 'capture_reader file=again.h5" + decode + "second.csv'").exit_code, 0);
  EXPECT_EQ(read_text(folder.path() / "first.csv"), read_text(folder.path() / "second.csv"));
  EXPECT_NE(run("info again.h5").out.find("0, 90, 180, 270 deg (by the capture)"), std::string::npos);
  // Except if the profile's exposures are requested.
  const std::string reversed = "run 'capture_reader file=own.h5 exposures=camera" + decode;
  ASSERT_EQ(run(reversed + "third.csv' --camera ./reversed.yaml").exit_code, 0);
  EXPECT_NE(read_text(folder.path() / "first.csv"), read_text(folder.path() / "third.csv"));
}

/// The frames state no frequency: the later stages and the capture have that of the decoder.
TEST_F(Exposures, TheFrequencyOfADecoderIsPassedOn) {
  write("small.yaml", profile_with(""));
  {
    RawCapture raw(folder.path() / "own.h5");
    std::vector<float> phases;
    for (const double c : {1000.0, 500.0, -1000.0, -500.0}) phases.insert(phases.end(), 24 * 32, static_cast<float>(c));
    raw.head(32, 24, 1, "tofgraph-capture", "small");
    raw.dataset("phases", {1, 4, 24, 32}, phases).metadata(1, 1e-3);
  }
  for (const std::string decoder : {"four_phase_decoder", "phase_decoder"}) {
    const Outcome decoded = run("run 'capture_reader file=own.h5 ! " + decoder +
                                " modulation_frequency=18MHz ! optimized_bistatic ! non_local_means guide=amplitude ! "
                                "capture_writer path=decoded.h5 channels=[depth]' --camera ./small.yaml --force");
    ASSERT_EQ(decoded.exit_code, 0) << decoded.err;
    const auto stated = raw_values<double>(folder.path() / "decoded.h5", "/frames/modulation_frequency_hz");
    ASSERT_EQ(stated.size(), 1U) << decoder;
    EXPECT_NEAR(stated[0], 18e6, 1e-3) << decoder;
  }
}

TEST_F(Exposures, OfASourceAreItsOwn) {
  std::string small = profile_with("");
  small.replace(small.find("width: 32\nheight: 24"), 20, "width: 6\nheight: 4 ");
  write("small.yaml", small);
  for (const std::string camera : {"", " --camera ./small.yaml"}) {
    const Outcome read = run("run 'five_steps ! phase_decoder ! statistics channel=distance format=csv'" + camera);
    EXPECT_EQ(read.exit_code, 0) << read.err;
    EXPECT_NE(read.out.find("all,24,1.192"), std::string::npos) << "c / (4 pi 20 MHz), m\n" << read.out;
  }
}

TEST_F(Exposures, HavePreviewsAndDistances) {
  const auto scene = [&](const std::string& camera, const std::string& output) {
    write("scene.yaml", "scene: 1\ncamera: " + camera + "\nframes: 1\noutput: " + output +
                            "\nobjects:\n  - {name: board, type: board, distance: 2 m}\n");
  };
  write("three.yaml", profile_with("exposures: [{phase: 0 deg}, {phase: 120 deg}, {phase: 240 deg}]\n"));
  write("small.yaml", profile_with(six, ""));
  for (const std::string camera : {"three.yaml", "small.yaml"}) {
    scene(camera, "distance");
    const Outcome made = run("simulate scene.yaml -o board.h5 --preview board.png --force");
    EXPECT_EQ(made.exit_code, 0) << made.err;
    EXPECT_GT(read_text(folder.path() / "board.png").size(), 10000U);
    const Outcome read = run("run 'capture_reader file=board.h5 ! statistics channel=distance'");
    EXPECT_NE(read.out.find(" 768 "), std::string::npos) << read.out;
  }
  // Outside the lens model there is no distance, also with several frequencies.
  std::string bent = profile_with(six, "");
  bent.replace(bent.find("sources:"), 0, "distortion: [-5, 0, 0, 0, 0]\n");
  write("bent.yaml", bent);
  scene("bent.yaml", "distance");
  ASSERT_EQ(run("simulate scene.yaml -o bent.h5").exit_code, 0);
  const Outcome read = run("run 'capture_reader file=bent.h5 ! statistics channel=distance format=csv'");
  EXPECT_TRUE(std::regex_search(read.out, std::regex("all,520,2\\.0[0-9]*,[0-9.]*,(1\\.99|2\\.0)"))) << read.out;
  write("odd.yaml",
        profile_with("exposures: [{phase: 0 deg, frequency: 20 MHz}, {phase: 120 deg, frequency: 20 MHz}, {phase: 240 "
                     "deg, frequency: 20 MHz}, {phase: 0 deg, frequency: 31.701234 MHz}, {phase: 120 deg, frequency: "
                     "31.701234 MHz}, {phase: 240 deg, frequency: 31.701234 MHz}]\n"));
  scene("odd.yaml", "distance");
  expect_error("check scene.yaml", {"scene.yaml:4:9: error", "no common range"});
  expect_error("simulate scene.yaml -o odd.h5", {"scene.yaml:4:9: error", "no common range"});
}

TEST_F(Exposures, AProfileInACaptureThatIsNoneIsTold) {
  {
    RawCapture raw(folder.path() / "odd.h5");
    raw.head(32, 24, 1, "tofgraph-capture", "small").text("profile", "no profile at all");
    raw.dataset("phases", {1, 4, 24, 32}, std::vector<float>(4 * 24 * 32, 1.0F)).metadata(1, 1e-3);
  }
  expect_error("check 'capture_reader file=odd.h5 ! null'", {"the profile that came with it cannot be used"});
  EXPECT_EQ(run("info odd.h5").exit_code, 0);
}

/// A rail of four distances measured by this camera.
constexpr const char* rail =
    "scene: 1\ncamera: small.yaml\nframes: 2\noutput: taps\nobjects:\n"
    "  - {name: board, type: board, distance: 1 m}\nsequence:\n"
    "  - {key: board.distance, values: [1 m, 1.5 m, 2 m, 2.5 m]}\n";

TEST_F(Exposures, OfSeveralFrequenciesAreNotSearched) {
  write("small.yaml", profile_with(six, ""));
  write("rail.yaml", rail);
  write("ideal.yaml", "model: 1\neffects: []\n");
  const Outcome made = run("simulate rail.yaml -o rail");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::vector<std::string> words = {"a search needs exposures of one frequency",
                                          "6 exposures: 0, 120, 240 deg at 80 MHz"};
  expect_error("diagnose --model ideal.yaml --data rail/campaign.yaml -o found", words);
  const std::string warned = run("check rail/campaign.yaml").err;
  for (const std::string& word : words) EXPECT_NE(warned.find(word), std::string::npos) << warned;
}

TEST_F(Exposures, OfACaptureAreThoseOfTheCampaignsCamera) {
  write("small.yaml", profile_with("exposures:\n  - {phase: 0 deg}\n  - {phase: 120 deg}\n  - {phase: 240 deg}\n"));
  write("rail.yaml", rail);
  write("ideal.yaml", "model: 1\neffects: []\n");
  ASSERT_EQ(run("simulate rail.yaml -o rail").exit_code, 0);
  EXPECT_EQ(run("check rail/campaign.yaml").err.find("warning"), std::string::npos);
  write("small.yaml", profile_with("exposures:\n  - {phase: 0 deg}\n  - {phase: 240 deg}\n  - {phase: 120 deg}\n"));
  expect_error("diagnose --model ideal.yaml --data rail/campaign.yaml -o found",
               {"3 exposures: 0, 120, 240 deg", "the camera 'small' has 3 exposures: 0, 240, 120 deg"});
}

TEST_F(Exposures, WhatNeedsTheFourSaysSo) {
  write("small.yaml", profile_with(six, ""));
  expect_error("gallery --camera ./small.yaml -o g.html", {"the gallery needs four exposures", "6 exposures"});
  expect_error("check 'simulator ! four_phase_decoder ! null' --camera ./small.yaml", {"use phase_decoder for it"});
}

}  // namespace
}  // namespace tofgraph::tests
