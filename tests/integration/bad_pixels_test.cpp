// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: BadPixels.AllDeadPixelsOfAWholeSensorAreFound
// Rooms: io graph calibration
// Bad pixels from a camera's noise to its pipelines, with captures of an independently simulated camera.
#include <hdf5.h>

#include "tests/dirty_camera.hpp"

#include "io/calibration.hpp"

#include <map>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

constexpr std::uint16_t bad_and_invalid = 1024 | 1;
enum Bit { noisy = 1, stuck = 2, response = 4, dead = 8, hot = 16, unmodulated = 32, listed = 64 };

class BadPixels : public testing::Test {
 protected:
  void use(const DirtyCamera& camera, const std::string& more = {}) {
    write_text(folder.path() / "dirty.yaml", camera.profile(more));
  }
  Outcome run(const std::string& command) const { return shell("\"$TOFGRAPH\" " + command, folder.path()); }
  std::vector<int> map(const std::string& file) const {
    const std::vector<double> values = raw_values<double>(folder.path() / file, "bad");
    return {values.begin(), values.end()};
  }
  void record_noise(DirtyCamera& camera, const std::string& name = "noise") const {
    DirtyCampaign campaign(folder.path(), name);
    for (const double distance : {0.8, 1.6})
      for (const double time : {0.5e-3, 1e-3, 2e-3}) campaign.add(camera, {.distance = distance, .time = time});
  }
  io::Calibrated column(const std::string& file, const std::string& kind, const std::string& key,
                        const std::string& unit) const {
    io::CalibrationReader reader(folder.path() / file, kind, "dirty");
    return reader.column(key, unit, 0, "");
  }
  TemporaryFolder folder;
};

TEST_F(BadPixels, EveryKindIsFoundAndNoGoodPixelIsLost) {
  DirtyCamera camera(48);
  const std::map<PixelKind, std::pair<std::size_t, int>> kinds = {{PixelKind::dead, {35, dead}},
                                                                  {PixelKind::stuck, {10, stuck}},
                                                                  {PixelKind::frozen_tap, {5, stuck}},
                                                                  {PixelKind::noisy, {20, noisy}},
                                                                  {PixelKind::hot, {15, hot}},
                                                                  {PixelKind::full, {5, hot}},
                                                                  {PixelKind::unmodulated, {15, unmodulated}}};
  for (const auto& [kind, of] : kinds) camera.spoil(kind, of.first);
  use(camera);
  record_noise(camera);
  const Outcome outcome = run("calibrate noise noise.yaml -o n.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<int> bad = map("n.maps.h5");
  std::size_t lost = 0;
  for (std::size_t i = 0; i < bad.size(); ++i) {
    if (camera.kind(i) == PixelKind::good)
      lost += bad[i] != 0 ? 1 : 0;
    else
      EXPECT_NE(bad[i] & kinds.at(camera.kind(i)).second, 0)
          << "pixel " << i << " of kind " << static_cast<int>(camera.kind(i)) << " has " << bad[i];
  }
  EXPECT_LE(lost, 2) << "0.1 % of the good ones";
  EXPECT_NE((outcome.out + outcome.err).find("105 of 2304 pixels are bad: 35 dead"), std::string::npos)
      << outcome.out << outcome.err;
  EXPECT_NE((outcome.out + outcome.err).find("bad_pixels: {file: n.maps.h5, dataset: bad}"), std::string::npos);
  // Bad pixels do not affect the fit.
  io::CalibrationReader file(folder.path() / "n.yaml", "noise", "dirty");
  EXPECT_NEAR(file.need("read_noise", "counts", 1, "").value[0], std::sqrt(9 + 1.0 / 12), 0.06);
  EXPECT_NEAR(file.need("shot_noise", "counts", 1, "").value[0], 0.012, 0.0003);
}

TEST_F(BadPixels, AllDeadPixelsOfAWholeSensorAreFound) {
  DirtyCamera camera(204);
  camera.spoil(PixelKind::dead, 624);
  camera.spoil(PixelKind::noisy, 600);
  camera.spoil(PixelKind::hot, 500);
  camera.spoil(PixelKind::unmodulated, 350);
  use(camera);
  DirtyCampaign campaign(folder.path(), "noise");
  for (const double time : {0.5e-3, 1e-3, 2e-3}) campaign.add(camera, {.time = time, .frames = 6});
  const Outcome outcome = run("calibrate noise noise.yaml -o n.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<int> bad = map("n.maps.h5");
  std::size_t found = 0, missed = 0, lost = 0;
  for (std::size_t i = 0; i < bad.size(); ++i) {
    found += camera.kind(i) == PixelKind::dead && (bad[i] & dead) != 0 ? 1 : 0;
    missed += camera.kind(i) != PixelKind::good && bad[i] == 0 ? 1 : 0;
    lost += camera.kind(i) == PixelKind::good && bad[i] != 0 ? 1 : 0;
  }
  std::printf("%zu of 624 dead pixels found, %zu other bad ones missed, %zu good ones lost\n", found, missed, lost);
  EXPECT_EQ(found, 624);
  EXPECT_EQ(missed, 0);
  EXPECT_LE(lost, 39);
}

TEST_F(BadPixels, OneConditionGivesAReport) {
  DirtyCamera camera(48);
  camera.spoil(PixelKind::dead, 35);
  use(camera);
  DirtyCampaign(folder.path(), "noise").add(camera, {.distance = 0.6, .time = 2e-3});
  const Outcome outcome = run("calibrate noise noise.yaml -o n.yaml");
  EXPECT_EQ(outcome.err.find("gnuplot"), std::string::npos) << outcome.err;
  if (outcome.exit_code == 0) {
    EXPECT_TRUE(fs::exists(folder.path() / "n.html"));
    EXPECT_EQ(std::ranges::count_if(map("n.maps.h5"), [](int b) { return b != 0; }), 35);
  } else {
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_NE(outcome.err.find("record at several integration times or distances"), std::string::npos) << outcome.err;
  }
}

TEST_F(BadPixels, OffsetsOfRawCapturesDoNotDependOnDeadPixels) {
  for (const std::size_t count : {std::size_t{2}, std::size_t{35}, std::size_t{624}}) {
    DirtyCamera clean(48), camera(48);
    camera.spoil(PixelKind::dead, count);
    use(camera);
    DirtyCampaign without(folder.path(), "clean"), with(folder.path(), "with");
    for (const double reflectivity : {0.8, 0.4}) {
      const std::string target = reflectivity > 0.5 ? ", target: white" : ", target: grey";
      for (const double distance : {0.75, 1.25, 2.0, 3.0}) {
        const BoardShot shot{
            .distance = distance, .time = 2e-3, .frames = 4, .reflectivity = reflectivity, .drift = 0.02};
        without.add(clean, shot, target);
        with.add(camera, shot, target);
      }
    }
    ASSERT_EQ(run("calibrate offset clean.yaml -o clean_offset.yaml --force").exit_code, 0);
    const Outcome outcome = run("calibrate offset with.yaml -o offset.yaml --force");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::vector<double> depth = column("offset.yaml", "offset", "depth", "m").value;
    const std::vector<double> truth = column("clean_offset.yaml", "offset", "depth", "m").value;
    ASSERT_EQ(depth.size(), truth.size());
    for (std::size_t i = 0; i < depth.size(); ++i) EXPECT_NEAR(depth[i], truth[i], 1.5e-3) << count << " dead pixels";
    EXPECT_NE((outcome.out + outcome.err).find("dead, stuck or without modulation"), std::string::npos) << outcome.err;
  }
}

TEST_F(BadPixels, WarmUpOfRawCapturesIsRight) {
  DirtyCamera camera(48);
  camera.spoil(PixelKind::dead, 35);
  camera.spoil(PixelKind::noisy, 35);
  camera.spoil(PixelKind::unmodulated, 20);
  use(camera);
  DirtyCampaign campaign(folder.path(), "warm");
  for (const double minutes : {0.5, 1., 2., 4., 6., 9., 12., 16., 20., 26., 34., 45., 60., 80.})
    campaign.add(camera, {.distance = 1.9,
                          .time = 4e-3,
                          .frames = 4,
                          .drift = -9e-3 * (1 - std::exp(-minutes / 12)),
                          .time_since_power_on = 60 * minutes});
  const Outcome outcome = run("calibrate warm-up warm.yaml -o w.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<double> drift = column("w.yaml", "warm-up", "drift", "m").value;
  ASSERT_EQ(drift.size(), 1U);
  EXPECT_NEAR(drift[0], -9e-3, 0.6e-3);
}

TEST_F(BadPixels, TheFixedPatternOfTheGoodPixelsIsRight) {
  DirtyCamera camera(48);
  camera.spoil(PixelKind::dead, 35);
  camera.spoil(PixelKind::unmodulated, 20);
  camera.set_pattern(3e-3);
  use(camera);
  DirtyCampaign campaign(folder.path(), "pattern");
  for (const double distance : {0.8, 1.2, 1.6, 2.0})
    for (const char* roll : {"0", "90", "180", "270"})
      campaign.add(camera, {.distance = distance, .time = 4e-3}, std::string(", roll: ") + roll + " deg");
  const Outcome outcome = run("calibrate fixed-pattern pattern.yaml -o p.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<double> found = raw_values<double>(folder.path() / "p.maps.h5", "map");
  double mean = 0, square = 0, good = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (camera.kind(i) == PixelKind::good) {
      mean += found[i] - camera.pattern()[i];
      good += 1;
    }
  for (std::size_t i = 0; i < found.size(); ++i)
    if (camera.kind(i) == PixelKind::good) square += std::pow(found[i] - camera.pattern()[i] - mean / good, 2);
  std::printf("pattern of 3 mm off by %.2f mm\n", 1e3 * std::sqrt(square / good));
  EXPECT_LT(std::sqrt(square / good), 1e-3);
}

TEST_F(BadPixels, AMapInTheProfileIsUsedByCalibrationsAndPipelines) {
  DirtyCamera camera(48);
  camera.spoil(PixelKind::dead, 35);
  use(camera);
  record_noise(camera);
  ASSERT_EQ(run("calibrate noise noise.yaml -o n.yaml").exit_code, 0);
  use(camera, "bad_pixels: {file: n.maps.h5, dataset: bad}\n");
  const Outcome again = run("calibrate noise noise.yaml -o again.yaml");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE((again.out + again.err).find("35 of 2304 pixels are bad: 35 dead, 35 listed before"), std::string::npos)
      << again.out << again.err;
  ASSERT_EQ(run("calibrate response noise.yaml -o r.yaml --force").exit_code, 0);
  const std::vector<double> contrast = raw_values<double>(folder.path() / "r.maps.h5", "contrast");
  for (std::size_t i = 0; i < contrast.size(); ++i)
    EXPECT_EQ(std::isnan(contrast[i]), camera.kind(i) != PixelKind::good) << i;
  // A raw frame gets its flags at the source; the decoder keeps them.
  write_text(folder.path() / "p.yaml",
             "pipeline: 1\ncamera: dirty.yaml\nnodes:\n  - {stage: capture_reader, file: noise0.h5}\n"
             "  - {stage: four_phase_decoder}\n  - {stage: crop, columns: [1, 46]}\n"
             "  - {stage: capture_writer, path: m.h5}\n");
  const Outcome outcome = run("run p.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto flags = raw_values<std::uint16_t>(folder.path() / "m.h5", "/frames/flags");
  const auto distance = raw_values<float>(folder.path() / "m.h5", "/frames/distance");
  for (std::size_t row = 0; row < 48; ++row) {
    for (std::size_t column = 1; column < 47; ++column) {
      const std::size_t cut = row * 46 + column - 1;
      const bool is_bad = camera.kind(row * 48 + column) != PixelKind::good;
      EXPECT_EQ(flags[cut] & bad_and_invalid, is_bad ? bad_and_invalid : 0) << row << " " << column;
      EXPECT_EQ(std::isnan(distance[cut]), is_bad) << row << " " << column;
    }
  }
  EXPECT_NE(provenance_in(folder.path() / "m.h5").find("n.maps.h5"), std::string::npos);
  // Decoded frames without flags get them too.
  ASSERT_EQ(run("run \"capture_reader file=noise0.h5 ! four_phase_decoder ! channels keep=[distance,amplitude] ! "
                "capture_writer path=d.h5\" --camera ./dirty.yaml")
                .exit_code,
            0);
}

TEST_F(BadPixels, AMapThatDoesNotFitIsAnErrorWithItsPlace) {
  DirtyCamera camera(48), larger(64);
  use(larger);
  record_noise(larger, "large");
  ASSERT_EQ(run("calibrate noise large.yaml -o n.yaml").exit_code, 0);
  use(camera, "bad_pixels: {file: n.maps.h5, dataset: bad}\n");
  const Outcome size = run("check dirty.yaml");
  EXPECT_EQ(size.exit_code, 2);
  EXPECT_NE(size.err.find("dirty.yaml:17:13: error: 'bad_pixels': the map in"), std::string::npos) << size.err;
  EXPECT_NE(size.err.find("is 64 x 64 px, the camera 'dirty' has 48 x 48"), std::string::npos) << size.err;
  use(camera, "bad_pixels: {file: none.h5, dataset: bad}\n");
  const Outcome missing = run("check dirty.yaml");
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("there is no file"), std::string::npos) << missing.err;
  use(camera, "bad_pixels: {dataset: bad}\n");
  EXPECT_NE(run("check dirty.yaml").err.find("'file'"), std::string::npos);
}

TEST_F(BadPixels, ARecordedProfileWhoseMapIsNotFoundIsAWarning) {
  DirtyCamera camera(48);
  use(camera);
  const BoardShot shot{.frames = 2};
  const auto taps = camera.taps(shot);
  {
    RawCapture capture(folder.path() / "c.h5");
    capture.text("profile", camera.profile("bad_pixels: {file: moved.maps.h5, dataset: bad}\n"));
    capture.head(48, 48, 1, "tofgraph-capture", "dirty");
    capture.dataset("taps", {2, 4, 2, 48, 48}, taps, {1, 4, 2, 48, 48}).metadata(2, 1e-3);
  }
  const Outcome outcome =
      run("run \"capture_reader file=c.h5 ! four_phase_decoder modulation_frequency=20MHz ! null\"");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("bad pixels of the camera 'dirty' are unknown"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace tofgraph::tests
