// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Serial numbers are passed on from a recording to derived files, and another device's calibration is rejected.
#include <gmock/gmock.h>
#include <hdf5.h>

#include "tests/plain_boards.hpp"
#include "tests/small_boards.hpp"

using namespace tofgraph::tests;
using testing::HasSubstr;

namespace {

const std::string lens =
    "calibration: 1\nkind: intrinsics\ncamera: small\nserial: L7-099\ninputs: []\nsettings: {}\nvalues:\n"
    "  focal_length: {value: [32 px, 32 px]}\n  principal_point: {value: [7.5 px, 5.5 px]}\n"
    "  distortion: {value: [0, 0, 0, 0, 0]}\n";

class Serial : public testing::Test {
 protected:
  void SetUp() override {
    write_text(path("small.yaml"), small_profile);
    write_text(path("lens.yaml"), lens);
    write_text(path("model.yaml"),
               "model: 1\ncamera: small.yaml\nserial: L7-099\neffects: [{effect: zero_offset, offset: 10 mm}]\n");
    record("own.h5", "L7-042");
  }
  void record(const std::string& name, const std::string& serial) {
    record_small(path(name), {.frames = 4, .serial = serial});
  }
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  Outcome tofgraph(const std::string& arguments) const { return shell("$TOFGRAPH " + arguments, folder_.path()); }
  Outcome run(const std::string& stages, const std::string& options = "") const {
    return tofgraph("run \"" + stages + "\" --camera ./small.yaml " + options);
  }

  TemporaryFolder folder_;
};

TEST_F(Serial, ALensOrAModelOfAnotherDeviceIsRefusedUnlessInsistedOn) {
  for (const char* stage : {"intrinsics calibration=lens.yaml", "model_correction model=model.yaml"}) {
    const std::string stages = "capture_reader file=own.h5 ! " + std::string(stage) + " ! optimized_bistatic ! null";
    const Outcome refused = run(stages);
    EXPECT_EQ(refused.exit_code, 2) << stage;
    EXPECT_THAT(refused.err, HasSubstr("is of the camera with the serial L7-099, the frames are of L7-042"));
    const Outcome used = run(stages, "--other-serial");
    EXPECT_EQ(used.exit_code, 0) << used.err;
    EXPECT_THAT(used.err, HasSubstr("L7-099, the frames are of L7-042: it is used nevertheless"));
  }
}

TEST_F(Serial, ADeviceThatIsNotKnownIsNotRefused) {
  record("unknown.h5", "");
  const Outcome outcome = run("capture_reader file=unknown.h5 ! intrinsics calibration=lens.yaml ! null");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

TEST_F(Serial, IsKeptByARecordingOfAPipeline) {
  ASSERT_EQ(run("capture_reader file=own.h5 ! optimized_bistatic ! capture_writer path=out.h5").exit_code, 0);
  EXPECT_THAT(tofgraph("info out.h5").out, HasSubstr("serial: L7-042"));
}

/// Four-frame captures of a board by a nominal CamCube: the search needs more pixels than the small camera has.
void record_camcube(const std::filesystem::path& file, const std::string& serial) {
  std::vector<float> distance(plain_pixels);
  for (std::size_t i = 0; i < plain_pixels; ++i)
    distance[i] = static_cast<float>(plain_half_path(i % plain_side, i / plain_side, {}));
  write_distances(file, {distance, distance, distance, distance}, std::vector<float>(plain_pixels, 1000.0F), 1e-3,
                  serial);
}

TEST_F(Serial, OfTheModelIsComparedWithTheCapturesByDiagnose) {
  write_text(path("camcube.yaml"), "model: 1\ncamera: camcube2\nserial: L7-099\neffects: []\n");
  record_camcube(path("camcube.h5"), "L7-042");
  std::string campaign = "campaign: 1\ncamera: camcube2\nconditions:\n";
  for (const std::string frame : {"0", "1", "2", "3"})
    campaign += "  - {id: c" + frame + ", capture: camcube.h5, board: {distance: 1 m}, frames: [" + frame + ", " +
                frame + "]}\n";
  write_text(path("campaign.yaml"), campaign);
  const Outcome refused = tofgraph("diagnose --model camcube.yaml --data campaign.yaml -o gap");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("the model is of the camera with the serial L7-099, the captures are of L7-042"));

  record_camcube(path("other.h5"), "L7-099");
  write_text(path("campaign.yaml"), campaign + "  - {id: other, capture: other.h5, board: {distance: 1 m}}\n");
  const Outcome mixed = tofgraph("diagnose --model camcube.yaml --data campaign.yaml -o gap --other-serial");
  EXPECT_EQ(mixed.exit_code, 2);
  EXPECT_THAT(mixed.err, HasSubstr("campaign.yaml:8:"));
  EXPECT_THAT(mixed.err, HasSubstr("the serial L7-099, those before of L7-042"));
}

}  // namespace
