// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// One folder per camera: created, filled, used by a pipeline, moved, damaged.
#include <gmock/gmock.h>
#include <hdf5.h>
#include <nlohmann/json.hpp>

#include "tests/small_boards.hpp"

#include <fstream>
#include <sstream>

using namespace tofgraph::tests;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

namespace {

const std::string lens =
    "calibration: 1\nkind: intrinsics\ncamera: small\nserial: S1\ninputs: []\nsettings: {}\nvalues:\n"
    "  focal_length: {value: [32.5 px, 32.5 px]}\n  principal_point: {value: [7.5 px, 5.5 px]}\n"
    "  distortion: {value: [0, 0, 0, 0, 0]}\n";

/// An offset calibration of boards measured too far by a constant. @param settings additional settings
std::string offset_of(double constant_mm, const std::string& settings = "") {
  std::ostringstream target, distance, depth, time;
  for (int i = 0; i < 6; ++i) {
    const char* comma = i == 0 ? "" : ", ";
    target << comma << 0;
    distance << comma << 500 + 500 * i;
    depth << comma << 500 + 500 * i + constant_mm;
    time << comma << 1;
  }
  return "calibration: 1\nkind: offset\ncamera: small\nserial: S1\ninputs: []\n"
         "settings: {variant: geometric, targets: [grey]" +
         settings + "}\nvalues:\n  modulation_frequency: {value: 20 MHz}\n  gain: {value: 7.0e6 counts m^2/s}\n" +
         "  falloff: {value: [0, 0]}\n  target: {value: [" + target.str() + "]}\n  distance: {unit: mm, value: [" +
         distance.str() + "]}\n  depth: {unit: mm, value: [" + depth.str() +
         "]}\n  integration_time: {unit: ms, value: [" + time.str() +
         "]}\n  reflectivity: {value: [0.5, 0.5, 0.5, 0.5, 0.5, 0.5]}\n";
}

/// A warm-up calibration with its model beside it, as calibrate writes them.
void write_warm_up(const std::filesystem::path& file, const std::string& drift) {
  write_text(file, "calibration: 1\nkind: warm-up\ncamera: small\nserial: S1\ninputs: []\nsettings: {}\nvalues: {}\n");
  write_text(std::filesystem::path(file).replace_extension(".model.yaml"),
             "model: 1\ncamera: small.yaml\nserial: S1\neffects:\n  - {effect: warm_up, drift: " + drift +
                 ", time_constant: 600 s}\n");
}

class CameraFolder : public testing::Test {
 protected:
  void SetUp() override {
    write_text(path("small.yaml"), small_profile);
    write_text(path("lens.yaml"), lens);
    write_text(path("offset.yaml"), offset_of(28));
    write_text(path("p.yaml"),
               "pipeline: 1\ncamera: lab\nnodes:\n  - {name: read, stage: capture_reader, file: board.h5}\n"
               "  - {name: model, stage: optimized_bistatic}\n  - {stage: statistics, path: s.json}\n");
    record({});
    ASSERT_EQ(tofgraph("camera new lab --profile small.yaml").exit_code, 0);
  }
  void record(SmallBoard board) {
    board.distance = 1.5;
    if (board.serial.empty()) board.serial = "S1";
    board.error = [](std::size_t) { return 28e-3; };
    record_small(path("board.h5"), board);
  }
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  std::filesystem::path lab() const { return path("data/tofgraph/cameras/lab"); }
  Outcome tofgraph(const std::string& arguments) const {
    return shell("export XDG_DATA_HOME=\"$PWD/data\" XDG_CACHE_HOME=\"$PWD/cache\"; $TOFGRAPH " + arguments,
                 folder_.path());
  }
  /// Mean depth of the corrected recording, m.
  double depth() const {
    const Outcome run = tofgraph("run p.yaml --force");
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::ifstream in(path("s.json"));
    const json statistics = json::parse(in);
    for (const json& entry : statistics["inputs"])
      if (entry["channel"] == "depth") return entry["mean"];
    ADD_FAILURE() << statistics.dump(2);
    return 0;
  }
  std::string add(const std::string& arguments) const {
    const Outcome outcome = tofgraph("camera add lab " + arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.err;
  }

  TemporaryFolder folder_;
};

TEST_F(CameraFolder, APipelineTakesTheCalibrationsByTheNameOfTheCamera) {
  EXPECT_NEAR(depth(), 1.528, 2e-3) << "nothing is calibrated";
  add("lens.yaml offset.yaml");
  EXPECT_NEAR(depth(), 1.5, 1e-3);
  const Outcome explained = tofgraph("explain p.yaml --set statistics.path=other.json");
  EXPECT_THAT(explained.out, AllOf(HasSubstr("inserts offset_correction after read"), HasSubstr("32.5 px"),
                                   HasSubstr((lab() / "offset/offset.yaml").string()), HasSubstr("serial S1")));
  const Outcome shown = tofgraph("camera show lab --json");
  const json folder = json::parse(shown.out);
  EXPECT_EQ(folder["serial"], "S1");
  ASSERT_EQ(folder["entries"].size(), 3U);
  std::string hash = shell("sha256sum offset.yaml", folder_.path()).out.substr(0, 64);
  EXPECT_EQ(folder["entries"][2]["files"][0]["sha256"], hash);
}

TEST_F(CameraFolder, AConstantThatOffsetAndModelBothKnowIsTakenOutOnce) {
  write_text(path("model.yaml"),
             "model: 1\ncamera: small\nserial: S1\neffects:\n  - {effect: zero_offset, offset: 28 mm}\n");
  add("model.yaml");
  EXPECT_NEAR(depth(), 1.5, 1e-3);
  EXPECT_THAT(add("offset.yaml"), HasSubstr("zero_offset: excluded from the model, since the offset calibration"));
  EXPECT_NEAR(depth(), 1.5, 1e-3);
  // An offset calibration of boards corrected by the model complements the model.
  write_text(path("after.yaml"), offset_of(0, ", applied: [model_correction]"));
  EXPECT_THAT(add("after.yaml --force"), Not(HasSubstr("zero_offset")));
  EXPECT_NEAR(depth(), 1.5, 1e-3);
}

TEST_F(CameraFolder, AWarmUpThatModelAndCalibrationBothKnowIsTakenOutOnce) {
  record({.time_since_power_on = 36000});
  write_warm_up(path("warm.yaml"), "10 mm");
  // For a warm camera the model's constants sum to 8 + 20 mm, whichever drift is used.
  write_text(path("model.yaml"),
             "model: 1\ncamera: small\neffects:\n  - {effect: zero_offset, offset: 8 mm}\n"
             "  - {effect: warm_up, drift: 20 mm, time_constant: 300 s}\n");
  const std::string notes = add("model.yaml warm.yaml");
  EXPECT_THAT(notes, AllOf(HasSubstr("warm_up: the one of the warm-up calibration is used"), HasSubstr("+10.00 mm")));
  EXPECT_NEAR(depth(), 1.5, 1e-3);
  record({.time_since_power_on = 0});  // 10 mm of drift remain
  EXPECT_NEAR(depth(), 1.5 + 10e-3, 1e-3);
}

TEST_F(CameraFolder, AFolderMayBeMovedAsAWhole) {
  add("lens.yaml offset.yaml");
  std::filesystem::rename(lab(), path("elsewhere"));
  const Outcome gone = tofgraph("run p.yaml --force");
  EXPECT_EQ(gone.exit_code, 2);
  EXPECT_THAT(gone.err, HasSubstr("'lab'"));
  EXPECT_EQ(tofgraph("run p.yaml --force --camera ./elsewhere").exit_code, 0);
  std::filesystem::remove(path("elsewhere/offset/offset.yaml"));
  const Outcome part = tofgraph("run p.yaml --force --camera ./elsewhere");
  EXPECT_EQ(part.exit_code, 2);
  EXPECT_THAT(part.err, HasSubstr("offset.yaml is missing: was part of the folder moved?"));
  std::filesystem::remove(path("elsewhere/camera.yaml"));
  const Outcome none = tofgraph("run p.yaml --force --camera ./elsewhere");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("has no camera.yaml"));
}

TEST_F(CameraFolder, ALayoutNamesItLikeAPipeline) {
  std::string table;
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 16; ++column) table += (column > 0 ? "," : "") + std::to_string(1500 + column);
    table += "\n";
  }
  write_text(path("depth.csv"), table);
  for (const std::string camera : {"lab", "./data/tofgraph/cameras/lab"}) {
    write_text(path("layout.yaml"), "layout: 1\ncamera: " + camera + "\nchannels: {depth: {unit: mm}}\n");
    EXPECT_THAT(tofgraph("check layout.yaml").err, HasSubstr("the layout is valid"));
    const Outcome converted = tofgraph("convert depth.csv -o d.h5 --layout layout.yaml --force");
    EXPECT_EQ(converted.exit_code, 0) << camera << converted.err;
    EXPECT_THAT(tofgraph("info d.h5").out, HasSubstr("camera small, 16 x 12 px"));
  }
  write_text(path("layout.yaml"), "layout: 1\ncamera: lap\nchannels: {depth: {unit: mm}}\n");
  EXPECT_THAT(tofgraph("convert depth.csv -o d.h5 --layout layout.yaml --force").err,
              AllOf(HasSubstr("there is no camera profile 'lap'"), HasSubstr("did you mean 'lab'?")));
}

TEST_F(CameraFolder, AFileThatWasChangedIsRefused) {
  add("offset.yaml");
  write_text(lab() / "offset/offset.yaml", offset_of(27));
  const Outcome run = tofgraph("run p.yaml --force");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("was changed since it was added"));
  EXPECT_EQ(tofgraph("camera show lab").exit_code, 2);
  add("offset.yaml --force");
  EXPECT_NEAR(depth(), 1.5, 1e-3);
}

TEST_F(CameraFolder, AnotherOfAKindNeedsForce) {
  add("offset.yaml");
  write_text(path("second.yaml"), offset_of(20));
  const Outcome refused = tofgraph("camera add lab second.yaml");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("the kind offset already: offset/offset.yaml"), HasSubstr("--force")));
  add("second.yaml --force");
  EXPECT_NEAR(depth(), 1.508, 1e-3);
  EXPECT_FALSE(std::filesystem::exists(lab() / "offset/offset.yaml"));
}

TEST_F(CameraFolder, AnotherDeviceIsRefusedUnlessInsistedOn) {
  std::string other = lens;
  other.replace(other.find("S1"), 2, "S2");
  write_text(path("other.yaml"), other);
  add("offset.yaml");
  const Outcome refused = tofgraph("camera add lab other.yaml");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("is of the camera with the serial S2"));
  EXPECT_THAT(add("other.yaml --other-serial"), HasSubstr("added anyway"));
  record({.serial = "S3"});
  const Outcome run = tofgraph("run p.yaml --force");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("is of the camera with the serial S1, the frames are of S3"));
  EXPECT_EQ(tofgraph("run p.yaml --force --other-serial").exit_code, 0);
}

TEST_F(CameraFolder, AMapOfAnotherSizeIsRefused) {
  const std::string head = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }";
  std::string file = std::string("\x93NUMPY\x01\x00", 8);
  file += static_cast<char>(118);
  file += '\0';
  file += head + std::string(117 - head.size(), ' ') + "\n" + std::string(48, '\0');
  write_text(path("map.npy"), file);
  write_text(path("model.yaml"),
             "model: 1\ncamera: small\neffects: [{effect: fixed_pattern, scale: 1, map: {file: map.npy}}]\n");
  const Outcome refused = tofgraph("camera add lab model.yaml");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("is 3 x 2 px, the camera small has 16 x 12"));
  EXPECT_FALSE(std::filesystem::exists(lab() / "model"));
}

TEST_F(CameraFolder, AnExpiredCalibrationIsUsedWithANote) {
  add("offset.yaml --valid-until 2025-12-31 --temperature 15degC..35degC");
  record({.recorded_at_ns = "1770000000000000000", .temperature_c = 41});  // 2026-02-02
  const Outcome run = tofgraph("run p.yaml --force");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("is valid until 2025-12-31, the recording is from 2026-02-02"),
                             HasSubstr("is for 15 to 35 degC, the recording was made at 41 to 41 degC")));
  record({.recorded_at_ns = "1750000000000000000", .temperature_c = 25});
  EXPECT_THAT(tofgraph("run p.yaml --force").err, Not(HasSubstr("warning")));
}

TEST_F(CameraFolder, ADateThatDoesNotExistIsRefused) {
  for (const std::string date : {"2026-99-99", "2026-02-30", "26-11-26", "2026-11-2 "}) {
    const Outcome refused = tofgraph("camera add lab offset.yaml --valid-until '" + date + "'");
    EXPECT_EQ(refused.exit_code, 2) << date;
    EXPECT_THAT(refused.err, HasSubstr("'" + date + "' is not a date")) << date;
  }
}

TEST_F(CameraFolder, APipelineWithItsOwnCorrectionsTakesTheFilesThatItLeavesOut) {
  add("offset.yaml");
  const Outcome run = tofgraph(
      "run \"capture_reader file=board.h5 ! offset_correction ! optimized_bistatic ! statistics path=s.json\" "
      "--camera lab --force");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const Outcome none = tofgraph("run \"capture_reader file=board.h5 ! null\" --camera lab");
  EXPECT_EQ(none.exit_code, 0);
  EXPECT_THAT(none.err, HasSubstr("the pipeline has no such node: it is not applied"));
}

TEST_F(CameraFolder, NamesThatCannotBeAreRefused) {
  EXPECT_THAT(tofgraph("camera new camcube2 --profile camcube2").err, HasSubstr("is the name of a profile"));
  EXPECT_THAT(tofgraph("camera new a/b --profile camcube2").err, HasSubstr("cannot be a camera"));
  EXPECT_THAT(tofgraph("camera new lab --profile small.yaml").err, HasSubstr("exists and is not empty"));
  EXPECT_THAT(tofgraph("camera show lap").err, HasSubstr("did you mean 'lab'?"));
  EXPECT_THAT(tofgraph("camera add lab small.yaml").err, HasSubstr("expected a calibration"));
}

}  // namespace
