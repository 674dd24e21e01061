// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Inspect.TheRightFinding*
// Rooms: inspection io/captures physics
// Findings of `tofgraph inspect` in recordings with one known error, and in recordings without errors.
#include <gmock/gmock.h>

#include "tests/integration/inspected_scenes.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <map>

using namespace tofgraph::tests;
using nlohmann::json;
using testing::HasSubstr;

namespace {

/// A plane given by its normal and its distance from the camera.
InspectedPlane plane(double x, double y, double z, double distance) {
  const double norm = std::sqrt(x * x + y * y + z * z);
  return {{x / norm, y / norm, z / norm}, distance};
}
InspectedPlane square(std::array<double, 3> middle, double x, double y, double z, double half) {
  InspectedPlane made = plane(x, y, z, 0);
  made.offset = made.normal[0] * middle[0] + made.normal[1] * middle[1] + made.normal[2] * middle[2];
  made.middle = middle;
  made.half = half;
  return made;
}

// Scenes and camera used for the evaluation; thresholds were chosen on those of `tuning`.
const std::map<std::string, InspectedScene> judged = {
    {"corner", {plane(1, 0.1, 0.9, 1.2), plane(-1, -0.1, 1.2, 1.9), plane(0.1, 1, 0.4, 0.9)}},
    {"board before a wall", {square({0.15, -0.1, 0.9}, -0.4, 0.35, 1, 0.4), plane(0.25, -0.15, 1, 2.9)}},
    {"box on a table",
     {plane(0, 1, 0.6, 0.8), plane(-0.2, 0, 1, 1.9), square({-0.1, 0.05, 1.0}, -0.6, 0.1, 1, 0.2),
      square({0.3, 0.1, 1.1}, 0.8, 0, 1, 0.2)}},
    {"hall",
     {plane(0, 1, 0.05, 1.3), plane(0, -1, 0.05, 1.6), plane(1, 0, 0, 1.0), plane(-1, 0, 0.15, 1.5),
      plane(0.15, 0, 1, 3.8)}}};
const std::map<std::string, InspectedScene> tuning = {
    {"slanted wall", {plane(0.5, -0.3, 1, 1.4)}},
    {"two walls", {plane(0.8, 0.2, 1, 1.6), plane(-0.9, 0.1, 1, 1.5)}},
    {"boards one before the other",
     {square({-0.2, 0, 1}, 0.4, 0.2, 1, 0.25), square({0.3, 0.1, 1.3}, -0.5, 0, 1, 0.3), plane(0, -0.3, 1, 2.4)}},
    {"ramp", {plane(0, 1, 0.8, 1.1), plane(0.2, 0, 1, 2.5)}}};

const InspectedCamera judged_camera{224, 172, 208.5, 208.4, 117.9, 80.2, {-0.28, 0.09, 0.001, -0.0008, 0}};
const InspectedCamera tuning_camera{176, 144, 160, 160.5, 83.0, 76.1, {-0.33, 0.13, 0, 0.001, 0}, 45e-6, 40e6};

const std::map<std::string, Mistake> mistakes = {
    {"channel", Mistake::range_for_depth},  {"unit", Mistake::millimetres},
    {"lens_missing", Mistake::k1_missing},  {"lens_sign", Mistake::k1_sign},
    {"orientation", Mistake::mirrored},     {"orientation of a turned image", Mistake::turned},
    {"exposures", Mistake::swapped_phases}, {"", Mistake::none}};

class Inspect : public testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  Outcome inspect(const std::string& arguments) const {
    return shell("$TOFGRAPH inspect " + arguments, folder_.path());
  }
  json inspected(const std::string& arguments) const {
    const Outcome outcome = inspect(arguments + " --json");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return json::parse(outcome.out);
  }
  static std::string first_of(const json& result) {
    return result["findings"].empty() ? "" : result["findings"][0]["kind"].get<std::string>();
  }

  struct Score {
    int right = 0, all = 0, invented = 0, clean = 0;
    std::string wrong;
  };
  Score score(const std::map<std::string, InspectedScene>& scenes, const InspectedCamera& camera, unsigned seed) const {
    Score score;
    for (const auto& [name, scene] : scenes) {
      for (const double noise : {0.001, 0.006}) {
        for (const auto& [kind, mistake] : mistakes) {
          InspectedRecording(camera, scene, noise, ++seed).write(path("a.h5"), mistake);
          const json result = inspected("a.h5");
          std::filesystem::remove(path("a.h5"));
          const bool right = first_of(result) == kind.substr(0, kind.find(' '));
          ++score.all;
          score.right += right ? 1 : 0;
          if (mistake == Mistake::none) {
            ++score.clean;
            score.invented += result["findings"].empty() ? 0 : 1;
          }
          if (!right) score.wrong += name + ", " + kind + ", " + std::to_string(noise) + ": " + result.dump() + "\n";
        }
      }
    }
    return score;
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(Inspect, TheRightFindingIsFirstInJudgedScenes) {
  const Score result = score(judged, judged_camera, 2000);
  std::printf("right first in %d of %d, findings in %d of %d clean recordings\n%s", result.right, result.all,
              result.invented, result.clean, result.wrong.c_str());
  EXPECT_EQ(result.all, 64);
  EXPECT_GE(result.right, 61) << "38 of 40";
  EXPECT_EQ(result.invented, 0);
}

TEST_F(Inspect, TheRightFindingIsFirstInScenesOfTuning) {
  const Score result = score(tuning, tuning_camera, 1);
  std::printf("right first in %d of %d, findings in %d of %d clean recordings\n%s", result.right, result.all,
              result.invented, result.clean, result.wrong.c_str());
  EXPECT_EQ(result.all, 64);
  EXPECT_GE(result.right, 61);
  EXPECT_EQ(result.invented, 0);
}

TEST_F(Inspect, AFindingSaysWhereHowMuchAndWhatMendsIt) {
  InspectedRecording(tuning_camera, tuning.at("two walls"), 0.002, 5).write(path("a.h5"), Mistake::range_for_depth);
  const Outcome outcome = inspect("a.h5 -o page.html");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("1. channel: the lengths are range, not depth"));
  EXPECT_THAT(outcome.out, HasSubstr("mend:     as: range"));
  EXPECT_THAT(outcome.out, HasSubstr("2 planes with"));
  const std::string page = read_text(path("page.html"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, HasSubstr("with the first assumption: channel"));
  const Outcome again = inspect("a.h5 -o page.html");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("--force"));
}

/// A part of a ball is nearly flat and was taken for a plane that no lens explains.
TEST_F(Inspect, ABallBeforeAWallHidesNoLens) {
  InspectedRecording recording(judged_camera, {plane(-0.08, 0, 1, 1.9)}, 0.001, 31);
  recording.change = [](std::size_t pixel, std::size_t, float& length, float&) {
    const double u = static_cast<double>(pixel % judged_camera.width) - 60,
                 v = static_cast<double>(pixel / judged_camera.width) - 90, square = (u * u + v * v) / (39.0 * 39.0);
    if (square < 1) length -= static_cast<float>(0.7 + 0.22 * std::sqrt(1 - square));
  };
  recording.write(path("a.h5"), Mistake::k1_missing);
  const json result = inspected("a.h5");
  EXPECT_EQ(first_of(result), "lens_missing") << result.dump();
}

TEST_F(Inspect, WhatASceneCannotDecideIsSaid) {
  // A lens that is symmetric about the image centre, and depths: mirrored images are as flat as others.
  InspectedCamera symmetric = tuning_camera;
  symmetric.cx = (symmetric.width - 1) / 2.0;
  symmetric.cy = (symmetric.height - 1) / 2.0;
  symmetric.k = {-0.3, 0.1, 0, 0, 0};
  InspectedRecording(symmetric, tuning.at("two walls"), 0.002, 6).write(path("a.h5"), Mistake::mirrored);
  const json mirrored = inspected("a.h5");
  EXPECT_EQ(first_of(mirrored), "");
  EXPECT_THAT(mirrored["undecided"].dump(), HasSubstr("mirrored or turned"));
  // A wall parallel to the image has a single depth for any lens.
  InspectedRecording(tuning_camera, {plane(0, 0, 1, 1.5)}, 0.002, 7).write(path("b.h5"), Mistake::k1_sign);
  const json wall = inspected("b.h5");
  EXPECT_EQ(first_of(wall), "");
  EXPECT_THAT(wall["undecided"].dump(), HasSubstr("distortion of the lens"));
  // No plane at all.
  InspectedRecording leaves(tuning_camera, tuning.at("slanted wall"), 0.002, 8);
  leaves.change = [](std::size_t pixel, std::size_t, float& length, float&) {
    length += 0.01F * static_cast<float>(pixel * 2654435761U % 97);
  };
  leaves.write(path("c.h5"), Mistake::range_for_depth);
  EXPECT_THAT(inspected("c.h5")["undecided"].dump(), HasSubstr("no plane was found"));
}

TEST_F(Inspect, BadPixelsStripesAndAmplitudeWalkAreFound) {
  InspectedRecording recording(tuning_camera, tuning.at("slanted wall"), 0.002, 9);
  recording.change = [](std::size_t pixel, std::size_t, float& length, float&) {
    if (pixel % 1009 == 500) length += 0.3F;
  };
  recording.write(path("bad.h5"), Mistake::none);
  const json bad = inspected("bad.h5");
  ASSERT_EQ(first_of(bad), "bad_pixels") << bad;
  std::size_t expected = 0;
  for (std::size_t i = 500; i < 176 * 144; i += 1009) expected += i % 176 < 175 && i / 176 < 140 ? 1 : 0;  // in blocks
  EXPECT_THAT(bad["findings"][0]["text"].get<std::string>(), HasSubstr(std::to_string(expected) + " pixels"));
  recording.change = [](std::size_t pixel, std::size_t, float& length, float&) {
    length += 0.003F * static_cast<float>(std::sin(2.1 * static_cast<double>(pixel / 176)));
  };
  recording.write(path("stripes.h5"), Mistake::none);
  EXPECT_EQ(first_of(inspected("stripes.h5")), "stripes");
  recording.change = [](std::size_t, std::size_t, float& length, float& amplitude) {
    length += 0.004F * std::log2(amplitude / 1000);
  };
  recording.write(path("walk.h5"), Mistake::none);
  const json walk = inspected("walk.h5");
  EXPECT_EQ(first_of(walk), "amplitude");
  EXPECT_NEAR(walk["findings"][0]["size_m"].get<double>(), 0.004, 0.0008);
}

TEST_F(Inspect, FilesOfOtherProgramsAreInspectedLikeCaptures) {
  write_text(path("camera.yaml"), tuning_camera.profile(tuning_camera.k));
  InspectedRecording recording(tuning_camera, tuning.at("slanted wall"), 0.001, 10);
  write_text(path("depth.npy"), recording.npy());
  const Outcome wrong = inspect("depth.npy --camera ./camera.yaml --as depth --unit m");
  EXPECT_EQ(wrong.exit_code, 0) << wrong.err;
  EXPECT_THAT(wrong.out, HasSubstr("1. unit: the lengths are 1000 times too large"));
  EXPECT_THAT(inspect("depth.npy --camera ./camera.yaml --as depth --unit mm").out, HasSubstr("No defect was found"));
  EXPECT_EQ(inspect("depth.npy --camera ./camera.yaml --as depth").exit_code, 2) << "the unit is not guessed";
}

/// Depths seen through a lens with distortion, stated as ranges of a lens without: neither correction alone suffices.
TEST_F(Inspect, TwoWrongStatementsAreFoundTogether) {
  write_text(path("camera.yaml"), tuning_camera.profile({}));
  InspectedRecording recording(tuning_camera, tuning.at("two walls"), 0.002, 12);
  write_text(path("depth.npy"), recording.npy());
  const json result = inspected("depth.npy --camera ./camera.yaml --as range --unit mm");
  ASSERT_EQ(first_of(result), "channel_and_lens") << result;
  const std::string mend = result["findings"][0]["mend"];
  ASSERT_THAT(mend, HasSubstr("as: depth, and in the profile distortion: ["));
  EXPECT_NEAR(std::stod(mend.substr(mend.find('[') + 1)), tuning_camera.k[0], 0.03) << mend;
  EXPECT_THAT(result["findings"][0]["evidence"].get<std::string>(), HasSubstr("noise"));
}

/// Lengths four times too long, a repeated code, and the unit where no limit is known.
TEST_F(Inspect, WrongUnitsOfASmallFactorAndCodesAreReported) {
  const std::string profile = tuning_camera.profile(tuning_camera.k);
  write_text(path("camera.yaml"), profile + "measuring_range: [0.1 m, 3 m]\n");
  InspectedRecording recording(tuning_camera, tuning.at("slanted wall"), 0.002, 13);
  recording.change = [](std::size_t pixel, std::size_t, float& length, float&) {
    if (pixel < 40) length = 60.0F;
  };
  write_text(path("depth.npy"), recording.npy());
  const json far = inspected("depth.npy --camera ./camera.yaml --as depth --unit '4 mm'");
  EXPECT_EQ(first_of(far), "unit");
  EXPECT_THAT(far["findings"][0]["text"].get<std::string>(), HasSubstr("the unambiguous range of the camera"));
  EXPECT_THAT(far["findings"][0]["text"].get<std::string>(), HasSubstr("smaller by a factor of"));
  const Outcome converted =
      shell("$TOFGRAPH convert depth.npy -o d.h5 --camera ./camera.yaml --as depth --unit '4 mm'", path(""));
  EXPECT_THAT(converted.err, HasSubstr("are beyond 3.74741 m, the unambiguous range of the camera"));
  write_text(path("near.yaml"), profile + "measuring_range: [0.1 m, 1.5 m]\n");
  const json beyond = inspected("depth.npy --camera ./near.yaml --as depth --unit mm");
  EXPECT_TRUE(beyond["findings"].empty()) << "measured beyond the range of the data sheet" << beyond;
  recording.write(path("a.h5"), Mistake::none);
  const json codes = inspected("a.h5");
  EXPECT_EQ(first_of(codes), "codes") << codes;
  EXPECT_THAT(codes["findings"][0]["text"].get<std::string>(), HasSubstr("40 pixels"));
  EXPECT_THAT(codes["undecided"].dump(), HasSubstr("whether the unit is right"));
  EXPECT_THAT(codes["facts"].dump(), HasSubstr("below 0.1 mm beside the noise"));
}

TEST_F(Inspect, WhatCannotBeInspectedIsOneError) {
  for (const std::string file : {"missing.h5", "text.txt"}) {
    if (file == "text.txt") write_text(path(file), "no recording\n");
    const Outcome outcome = inspect(file);
    EXPECT_EQ(outcome.exit_code, 2) << file;
    EXPECT_THAT(outcome.err, HasSubstr(file));
  }
  InspectedRecording(tuning_camera, tuning.at("slanted wall"), 0.002, 11).write(path("a.h5"), Mistake::none);
  const Outcome other = inspect("a.h5 --camera camcube2");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("176 x 144 px, the camera 'camcube2' has 204 x 204 px"));
  for (const std::string option : {"--unit mm", "--invalid 0", "--integration-time '1 ms'", "--frame-rate '10 Hz'"}) {
    const Outcome ignored = inspect("a.h5 " + option);
    EXPECT_EQ(ignored.exit_code, 2) << option;
    EXPECT_THAT(ignored.err, HasSubstr(option.substr(0, option.find(' ')) + ": error: a capture states this itself"));
  }
}

}  // namespace
