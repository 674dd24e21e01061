// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: inspection io physics
// Swapped raw images and a rotated amplitude image: found if the scene determines the order, otherwise reported as
// undecided.
#include <gmock/gmock.h>

#include "tests/integration/inspected_scenes.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

using namespace tofgraph::tests;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

namespace {

InspectedPlane plane(double x, double y, double z, double distance) {
  const double norm = std::sqrt(x * x + y * y + z * z);
  return {{x / norm, y / norm, z / norm}, distance};
}

/// Unambiguous range of 6.246 m, a quarter of which is 1.56 m.
constexpr double frequency = 24e6;
const InspectedCamera wide{176, 144, 160, 160.5, 83.0, 76.1, {-0.33, 0.13, 0, 0.001, 0}, 45e-6, frequency};
const InspectedCamera narrow{176, 144, 1900, 1900, 87.5, 71.5, {}, 45e-6, frequency};
constexpr const char* right_order = "exposures: [{phase: 0 deg}, {phase: 270 deg}, {phase: 180 deg}, {phase: 90 deg}]";

class InspectOrders : public testing::Test {
 protected:
  json inspected(const InspectedCamera& camera, const InspectedScene& scene, Mistake mistake, double noise = 0.002,
                 double falloff = 0) const {
    InspectedRecording recording(camera, scene, noise, 3);
    recording.patches = false;
    recording.falloff = falloff;
    recording.write(folder_.path() / "a.h5", mistake, "phases");
    const Outcome outcome = shell("$TOFGRAPH inspect a.h5 --json", folder_.path());
    std::filesystem::remove(folder_.path() / "a.h5");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return json::parse(outcome.out);
  }
  TemporaryFolder folder_;
};

TEST_F(InspectOrders, AWallBeforeAWideLensShowsTheRightOrder) {
  for (const InspectedScene& scene : {InspectedScene{plane(0.5, -0.3, 1, 1.4)}, InspectedScene{plane(0, 0, 1, 1.4)},
                                      InspectedScene{plane(0, 0, 1, 2.6)}, InspectedScene{plane(0.2, 0.3, 1, 2.2)}}) {
    for (const double falloff : {0.0, 3.0, 8.0}) {  // falling illumination mimics another distance
      SCOPED_TRACE(testing::Message() << scene[0].normal[0] << " " << scene[0].offset << " m, falloff " << falloff);
      const json result = inspected(wide, scene, Mistake::reversed_phases, 0.002, falloff);
      ASSERT_FALSE(result["findings"].empty()) << result;
      EXPECT_EQ(result["findings"][0]["kind"], "exposures") << result;
      EXPECT_EQ(result["findings"][0]["mend"], right_order) << result;
      EXPECT_TRUE(inspected(wide, scene, Mistake::none, 0.002, falloff)["findings"].empty());
    }
  }
}

TEST_F(InspectOrders, AUniformWallBeforeANarrowLensCannotDecide) {
  for (const double noise : {0.002, 0.01}) {
    const json result = inspected(narrow, {plane(0.02, 0.01, 1, 1.4)}, Mistake::reversed_phases, noise);
    EXPECT_EQ(result["findings"].dump().find("exposures"), std::string::npos) << result;
    // The path of the light: 1.4 m from the lamp beside the lens, 1.4 m back, and the focal length of 85.5 mm from the
    // lens to the sensor; half of it is 1.444 m at the median pixel. The distances of the other orders are candidates,
    // too.
    EXPECT_THAT(result["undecided"].dump(),
                AllOf(HasSubstr("the order of the raw images"), HasSubstr(std::string(right_order) + " (1.444 m"),
                      HasSubstr("(4.80"), HasSubstr("half of the path of the light"), HasSubstr("as stated"),
                      HasSubstr("A known distance decides")))
        << result;
  }
}

/// If brighter surfaces appear farther away the stated order is wrong; the right one of the others is undetermined.
TEST_F(InspectOrders, ASlantedWallBeforeANarrowLensNamesTheCandidates) {
  const json result = inspected(narrow, {plane(0, 1, 0.08, 0.112)}, Mistake::reversed_phases);
  ASSERT_FALSE(result["findings"].empty()) << result;
  const std::string mend = result["findings"][0]["mend"];
  EXPECT_THAT(mend, HasSubstr(right_order)) << result;
  if (mend != right_order) {
    EXPECT_THAT(mend, HasSubstr("cannot be decided from this scene"));
    EXPECT_THAT(result["undecided"].dump(), HasSubstr("A known distance decides"));
  }
}

/// The wall at 2.6 m appears at 3.65 m and bent. The order that adds a quarter of the range bends it by less than a
/// wall is uneven.
TEST_F(InspectOrders, TwoOrdersThatKeepAWallFlatAreBothNamed) {
  const InspectedCamera medium{176, 144, 1400, 1400, 87.5, 71.5, {}, 45e-6, frequency};
  const InspectedScene wall = {plane(0.02, 0.01, 1, 2.6)};
  const json result = inspected(medium, wall, Mistake::reversed_phases);
  ASSERT_FALSE(result["findings"].empty()) << result;
  EXPECT_EQ(result["findings"][0]["kind"], "exposures") << result;
  EXPECT_THAT(std::string(result["findings"][0]["mend"]),
              AllOf(HasSubstr("cannot be decided from this scene"), HasSubstr(std::string(right_order) + " (2.6"),
                    testing::Not(HasSubstr("as stated"))));
  EXPECT_THAT(result["undecided"].dump(),
              AllOf(HasSubstr("A known distance decides"), testing::Not(HasSubstr("range or depth"))));
  EXPECT_EQ(inspected(medium, wall, Mistake::none)["findings"].dump().find("exposures"), std::string::npos);
}

/// A surface of reflectivity 1 amplifies the light 4 million counts m^2/s, of which the profile states a sixth. Orders
/// with a sixth of the light would put it near the camera.
TEST_F(InspectOrders, AWrongGainIsNoEvidenceOfAnotherOrder) {
  InspectedCamera camera = narrow;
  camera.gain = 4e6 / 6;
  const json result = inspected(camera, {plane(0.02, 0.01, 1, 1.9)}, Mistake::none);
  EXPECT_EQ(result["findings"].dump().find("exposures"), std::string::npos) << result;
  EXPECT_THAT(result["undecided"].dump(), AllOf(HasSubstr("the order of the raw images"), HasSubstr("as stated"),
                                                HasSubstr("times brighter than white"), HasSubstr("the gain")))
      << result;
}

/// The wall at 1.9 m appears at 4.35 m: bent, and 5 times brighter than white.
TEST_F(InspectOrders, ABentWallThatIsTooBrightShowsTheRightOrder) {
  const InspectedCamera camera{176, 144, 1400, 1400, 87.5, 71.5, {}, 45e-6, frequency, 4e6};
  const json result = inspected(camera, {plane(0.02, 0.01, 1, 1.9)}, Mistake::reversed_phases);
  ASSERT_FALSE(result["findings"].empty()) << result;
  EXPECT_EQ(result["findings"][0]["mend"], right_order) << result;
  EXPECT_THAT(std::string(result["findings"][0]["evidence"]),
              HasSubstr("no other order agrees with the amplitudes and keeps planes flat"));
}

TEST_F(InspectOrders, ATurnedAmplitudeIsFoundByTheEdgesOfDepth) {
  InspectedPlane board = plane(-0.4, 0.35, 1, 0);
  board.middle = {0.15, -0.1, 0.9};
  board.offset =
      board.normal[0] * board.middle[0] + board.normal[1] * board.middle[1] + board.normal[2] * board.middle[2];
  board.half = 0.2;
  for (const bool turned : {false, true}) {
    for (const double noise : {0.001, 0.006}) {
      InspectedRecording recording(wide, {board, plane(0.25, -0.15, 1, 2.9)}, noise, 4);
      recording.turned_amplitude = turned;
      recording.write(folder_.path() / "a.h5", Mistake::none);
      const json result = json::parse(shell("$TOFGRAPH inspect a.h5 --json", folder_.path()).out);
      std::filesystem::remove(folder_.path() / "a.h5");
      EXPECT_EQ(result["findings"].size(), turned ? 1U : 0U) << result;
      if (!turned || result["findings"].empty()) continue;
      EXPECT_EQ(result["findings"][0]["kind"], "amplitude_orientation") << result;
      EXPECT_EQ(result["findings"][0]["text"], "the amplitude is turned by 180 deg relative to the lengths");
      EXPECT_EQ(result["findings"][0]["mend"],
                "in the layout, channel amplitude: reversed: row column (an axis already listed is taken out instead)");
    }
  }
}

/// Each layout is wrong, and right after the change that is proposed.
TEST_F(InspectOrders, TheProposedOrientationAddsToWhatTheLayoutStates) {
  const InspectedCamera square{144, 144, 160, 160, 71.5, 71.5, {}, 45e-6, frequency};
  InspectedPlane board = plane(-0.4, 0.35, 1, 0);
  board.middle = {0.15, -0.1, 0.9};
  board.offset =
      board.normal[0] * board.middle[0] + board.normal[1] * board.middle[1] + board.normal[2] * board.middle[2];
  board.half = 0.2;
  InspectedRecording recording(square, {board, plane(0.25, -0.15, 1, 2.9)}, 0.001, 4);
  std::string bytes;
  for (std::size_t frame = 0; frame < 8; ++frame) {
    auto [depth, amplitude] = recording.images();
    for (const std::vector<float>* image : {&depth, &amplitude})
      bytes.append(reinterpret_cast<const char*>(image->data()), 4 * image->size());
  }
  write_text(folder_.path() / "a.raw", bytes);
  write_text(folder_.path() / "camera.yaml", square.profile(square.k));
  const auto findings = [&](const std::string& amplitude) {
    write_text(folder_.path() / "layout.yaml",
               "layout: 1\ncamera: ./camera.yaml\narrays:\n  z: {type: float32, shape: [144, 144]}\n"
               "  a: {type: float32, shape: [144, 144]}\nchannels:\n  depth: {array: z, axes: row column, unit: m}\n"
               "  amplitude: {array: a, " +
                   amplitude + "}\n");
    const Outcome outcome = shell("$TOFGRAPH inspect a.raw --layout layout.yaml --json", folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return json::parse(outcome.out)["findings"];
  };
  EXPECT_TRUE(findings("axes: row column").empty());
  const std::string removed = " (an axis already listed is taken out instead)",
                    exchanged = "exchange row and column in axes and in reversed";
  const std::pair<const char*, std::string> cases[] = {
      {"axes: row column, reversed: column", "reversed: column" + removed},
      {"axes: row column, reversed: row column", "reversed: row column" + removed},
      {"axes: column row", exchanged},
      // Exchanged: axes: row column, reversed: row; the change of `row` then leaves nothing reversed.
      {"axes: column row, reversed: column", exchanged + ", then reversed: row" + removed},
      {"axes: column row, reversed: row", exchanged + ", then reversed: column" + removed},
      {"axes: column row, reversed: row column", exchanged + ", then reversed: row column" + removed}};
  for (const auto& [layout, mend] : cases) {
    const json found = findings(layout);
    ASSERT_EQ(found.size(), 1U) << layout << found;
    EXPECT_EQ(found[0]["kind"], "amplitude_orientation");
    EXPECT_EQ(found[0]["mend"], "in the layout, channel amplitude: " + mend) << layout;
  }
}

}  // namespace
