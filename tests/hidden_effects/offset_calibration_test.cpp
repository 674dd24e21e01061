// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: OffsetCalibration.Published*:OffsetCalibration.Boxes*:OffsetCalibration.OffsetsOf*
// Rooms: calibration plugins
// Offsets of the plain camera, calibrated from its recordings and removed from others. This test uses none of the
// calibration's formulas.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include <array>
#include <cmath>
#include <functional>

#include "tests/hidden_effects/board_recordings.hpp"
#include "tests/program.hpp"
#include "tests/unit/published_boards.hpp"

namespace tofgraph::hidden {
namespace {

namespace fs = std::filesystem;
using tests::shell;
using tests::TemporaryFolder;

constexpr std::size_t pixels = 204 * 204;

io::Condition condition_of(const std::string& id, const View& view, const std::string& target,
                           const fs::path& capture) {
  io::Condition c;
  c.id = id;
  c.capture = capture;
  c.board_distance = view.distance;
  c.board_tilt_x = c.board_tilt_y = 0;
  c.target = target;
  c.integration_time = view.integration_time;
  return c;
}

void write_campaign(const fs::path& folder, std::vector<io::Condition> conditions) {
  io::Campaign campaign;
  campaign.name = "boards";
  campaign.camera_name = "camcube2";
  campaign.conditions = std::move(conditions);
  io::write_campaign(campaign, folder / "campaign.yaml");
}

void calibrate(const fs::path& folder) {
  const tests::Outcome outcome = shell("\"$TOFGRAPH\" calibrate offset campaign.yaml -o offset.yaml", folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
}

/// Distance after the offset correction, and depth after the non-linearity model.
struct Corrected {
  std::vector<float> distance, depth;
};

Corrected corrected(const fs::path& folder, const DecodedImages& images, double integration_time) {
  Harness offset("offset_correction calibration='" + (folder / "offset.yaml").string() + "'");
  offset.camera("camcube2");
  offset.put<float>("distance", {204, 204}, images.distance);
  offset.put<float>("amplitude", {204, 204}, images.amplitude);
  offset.metadata().integration_time = integration_time;
  offset.run();
  Harness model("optimized_bistatic");
  model.camera("camcube2");
  model.put<float>("distance", {204, 204}, offset.get<float>("distance"));
  model.run();
  return {offset.get<float>("distance"), model.get<float>("depth")};
}

struct Statistics {
  double mean = 0, sd = 0;
};

Statistics statistics(const std::vector<double>& values) {
  Statistics s;
  for (const double v : values) s.mean += v / static_cast<double>(values.size());
  for (const double v : values) s.sd += (v - s.mean) * (v - s.mean) / static_cast<double>(values.size() - 1);
  s.sd = std::sqrt(s.sd);
  return s;
}

/// The corners of a board at 7 m wrap, both here and in the calibration.
bool unambiguous(const std::vector<float>& clean, std::size_t i) { return clean[i] > 0.49F && clean[i] < 7.3F; }

/// Statistics of the differences from a noise-free image.
Statistics noise_of(const std::vector<float>& image, const std::vector<float>& clean, const std::vector<float>& seen) {
  std::vector<double> differences;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (unambiguous(seen, i)) differences.push_back(double{image[i]} - clean[i]);
  }
  return statistics(differences);
}

double mean_depth(const Corrected& result, const std::vector<float>& seen) {
  std::vector<double> depths;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (unambiguous(seen, i)) depths.push_back(result.depth[i]);
  }
  return statistics(depths).mean;
}

// The 84 published offsets and pixel deviations. Half of the frames calibrate, the other half is corrected.
TEST(OffsetCalibration, PublishedOffsetsAreTakenOutOfTheOtherHalfOfTheFrames) {
  const TemporaryFolder folder;
  const Physics physics;
  std::vector<io::Condition> conditions;
  std::vector<std::vector<DecodedImages>> others;
  const auto boards = tests::published_boards();
  std::vector<View> views;
  for (std::size_t i = 0; i < boards.size(); ++i) {
    View& view = views.emplace_back();
    view.distance = boards[i].measured;  // as measured by the camera
    view.reflectivity = boards[i].reflectivity;
    view.integration_time = boards[i].time;
    const DecodedImages clean = decoded_images(physics, view);
    PairedNoise noise(i, boards[i].deviation, 4);
    const std::string id = "board_" + std::to_string(i);
    record(folder.path() / (id + ".h5"), {noise(clean), noise(clean)}, view.integration_time);
    conditions.push_back(condition_of(id, view, boards[i].target, folder.path() / (id + ".h5")));
    conditions.back().board_distance = boards[i].distance;
    others.push_back({noise(clean), noise(clean)});
  }
  write_campaign(folder.path(), conditions);
  calibrate(folder.path());
  double worst_mean = 0, worst_sd = 0;
  for (std::size_t i = 0; i < boards.size(); ++i) {
    const std::vector<float> clean = decoded_images(physics, views[i]).distance;
    std::vector<double> means;
    const std::vector<float> without_noise =
        corrected(folder.path(), decoded_images(physics, views[i]), boards[i].time).distance;
    for (const DecodedImages& frame : others[i]) {
      const Corrected result = corrected(folder.path(), frame, boards[i].time);
      means.push_back(mean_depth(result, clean));
      const double before = noise_of(frame.distance, clean, clean).sd,
                   after = noise_of(result.distance, without_noise, clean).sd;
      worst_sd = std::max(worst_sd, std::abs(after / before - 1));
    }
    const double error = statistics(means).mean - boards[i].distance;
    EXPECT_LT(std::abs(error), 0.05e-3) << boards[i].target << " at " << boards[i].distance << " m";
    worst_mean = std::max(worst_mean, std::abs(error));
  }
  EXPECT_LT(worst_sd, 0.02);
  RecordProperty("worst_mean_um", std::to_string(worst_mean * 1e6));
  RecordProperty("worst_sd_percent", std::to_string(worst_sd * 100));
}

/// A campaign of three boards, each recorded with a different serial number.
void record_boards(const fs::path& folder, const std::array<std::string, 3>& serials) {
  std::vector<io::Condition> conditions;
  for (std::size_t i = 0; i < serials.size(); ++i) {
    View view;
    view.distance = 1 + 0.25 * static_cast<double>(i);
    const fs::path file = folder / (std::to_string(i) + ".h5");
    record(file, {decoded_images({}, view)}, view.integration_time, serials[i]);
    conditions.push_back(condition_of(file.stem(), view, "white", file));
  }
  write_campaign(folder, conditions);
}

TEST(OffsetCalibration, IsOfOneCameraAndRefusesRecordingsOfAnother) {
  const TemporaryFolder folder, other, mixed;
  record_boards(folder.path(), {"C7", "C7", "C7"});
  record_boards(other.path(), {"C8", "C8", "C8"});
  record_boards(mixed.path(), {"C7", "C7", "C8"});
  calibrate(folder.path());
  EXPECT_NE(tests::read_text(folder.path() / "offset.yaml").find("serial: C7\n"), std::string::npos);
  const auto run = [&](const fs::path& capture) {
    return shell("\"$TOFGRAPH\" run \"capture_reader file=" + (capture / "0.h5").string() +
                     " ! offset_correction calibration=offset.yaml ! null\"",
                 folder.path());
  };
  EXPECT_EQ(run(folder.path()).exit_code, 0) << run(folder.path()).err;
  const tests::Outcome refused = run(other.path());
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("is of the camera with the serial C7, the frames are of C8"), std::string::npos)
      << refused.err;
  const tests::Outcome two = shell("\"$TOFGRAPH\" calibrate offset campaign.yaml -o offset.yaml", mixed.path());
  EXPECT_EQ(two.exit_code, 2);
  EXPECT_NE(two.err.find("the capture is of the camera with the serial C8, those before of C7"), std::string::npos)
      << two.err;
}

/// Error of a camera's depth by integration time, reflectivity and distance, m.
double offset_of(double distance, double reflectivity, double time) {
  return 8e-3 * std::log(time / 1e-3) - 10e-3 * std::log(reflectivity) + 15e-3 * std::sin(3.4 * distance);
}

/// Images of a board by a camera with offsets, and the board's position.
using Seen = std::function<DecodedImages(double distance, double reflectivity, double time)>;

Seen plainly(const Physics& physics) {
  return [physics](double distance, double reflectivity, double time) {
    View view;
    view.distance = distance;
    view.reflectivity = reflectivity;
    view.integration_time = time;
    return decoded_images(physics, view);
  };
}

/// Calibrates a camera with boards of six grey levels, ten distances and four integration times; then it measures three
/// boxes, each a third of the image, at distances and reflectivities that were not calibrated.
/// @returns the largest errors of a pixel's distance before and after, m
std::array<double, 2> errors_of_boxes(const Seen& seen) {
  const TemporaryFolder folder;
  std::vector<io::Condition> conditions;
  for (const double reflectivity : {0.85, 0.5, 0.3, 0.18, 0.11, 0.06}) {
    for (double distance = 0.75; distance < 3.01; distance += 0.25) {
      for (const double time : {1e-3, 2e-3, 4e-3, 8e-3}) {
        View view;
        view.distance = distance;
        view.integration_time = time;
        const fs::path file = folder.path() / (std::to_string(conditions.size()) + ".h5");
        PairedNoise noise(conditions.size(), 5e-3, 4);
        const DecodedImages clean = seen(distance, reflectivity, time);
        record(file, {noise(clean), noise(clean)}, time);
        conditions.push_back(condition_of(file.stem(), view, "grey " + std::to_string(reflectivity), file));
      }
    }
  }
  write_campaign(folder.path(), conditions);
  calibrate(folder.path());
  struct Box {
    double distance, reflectivity;
  };
  constexpr double time = 3e-3;
  constexpr std::size_t third = pixels / 3;
  DecodedImages scene;
  std::vector<float> truth;
  for (const Box& box : {Box{1.13, 0.6}, Box{1.62, 0.2}, Box{2.4, 0.8}}) {
    const DecodedImages measured = seen(box.distance, box.reflectivity, time),
                        ideal = plainly({})(box.distance, box.reflectivity, time);
    for (std::size_t i = truth.size(), last = i + third; i < last; ++i) {
      scene.distance.push_back(measured.distance[i]);
      scene.amplitude.push_back(measured.amplitude[i]);
      truth.push_back(ideal.distance[i]);
    }
  }
  const std::vector<float> result = corrected(folder.path(), scene, time).distance;
  std::array<double, 2> worst{};
  for (std::size_t i = 0; i < pixels; ++i) {
    worst[0] = std::max(worst[0], std::abs(double{scene.distance[i]} - truth[i]));
    worst[1] = std::max(worst[1], std::abs(double{result[i]} - truth[i]));
  }
  return worst;
}

TEST(OffsetCalibration, BoxesOfThreeReflectivitiesAreRightToAMillimetrePixelByPixel) {
  const auto [before, after] = errors_of_boxes([](double distance, double reflectivity, double time) {
    DecodedImages images = plainly({})(distance + offset_of(distance, reflectivity, time), reflectivity, time);
    images.amplitude = plainly({})(distance, reflectivity, time).amplitude;
    return images;
  });
  RecordProperty("before_um", std::to_string(before * 1e6));
  RecordProperty("after_um", std::to_string(after * 1e6));
  EXPECT_GT(before, 25e-3);
  EXPECT_LT(after, 1e-3);
}

// A phase offset is the same distance at every pixel; the reference's offset grows with the path. The remaining error
// towards the corners is one twentieth of the offset; for such effects use the stage model_correction.
TEST(OffsetCalibration, OffsetsOfThePhaseAreTakenOutToAnEighth) {
  Physics physics;
  physics.effects.add_text("integration_time_offset:slope=8mm", 1, 1);
  physics.effects.add_text("amplitude_walk:logarithmic=8mrad,inverse=3mrad", 1, 1);
  physics.effects.add_text("wiggling:amplitude=5mm,phase=0.4rad", 1, 1);
  const auto [before, after] = errors_of_boxes(plainly(physics));
  RecordProperty("before_um", std::to_string(before * 1e6));
  RecordProperty("after_um", std::to_string(after * 1e6));
  EXPECT_LT(after, before / 8);
}

}  // namespace
}  // namespace tofgraph::hidden
