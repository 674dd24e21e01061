// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Statistics, compared with closed forms, published numbers and the decomposition of another library.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <tofgraph/harness.hpp>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <sstream>

#include "tests/program.hpp"
#include "tests/unit/cameras.hpp"
#include "tests/unit/full_disk.hpp"

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
const float none = std::numeric_limits<float>::quiet_NaN();

class StatisticsStage : public testing::Test {
 protected:
  TemporaryFolder folder;
  fs::path path = folder.path() / "out" / "s.json";
  std::string line(const std::string& more = {}) const { return "statistics path=" + path.string() + " " + more; }

  /// Result of the stage for these frames of one channel.
  json of(const std::string& channel, const std::vector<std::uint64_t>& size,
          const std::vector<std::vector<float>>& frames, const std::string& more = {},
          const tofgraph_camera* camera = nullptr) const {
    Harness stage(line("overwrite=true " + more));
    if (camera != nullptr) stage.camera(test::profile_of(*camera));
    for (const auto& frame : frames) {
      stage.put<float>(channel, size, frame);
      stage.run();
    }
    stage.finish();
    return json::parse(read_text(path)).at("inputs").at(0);
  }
};

void expect_words(const std::string& message, const std::string& words) {
  EXPECT_NE(message.find(words), std::string::npos) << words << " is not in: " << message;
}

TEST_F(StatisticsStage, AnEmptyCloudHasNoPixels) {
  Harness stage(line());
  for (const std::vector<float>& depth : {std::vector<float>{}, {1.0F, 3.0F}, {}}) {  // the size of clouds varies
    stage.put<float>("depth", {1, depth.size()}, depth);
    stage.run();
  }
  stage.finish();
  const json s = json::parse(read_text(path)).at("inputs").at(0);
  EXPECT_EQ(s["count"], 2);
  EXPECT_EQ(s["mean"], 2);
  ASSERT_EQ(s["frames"].size(), 3U);
  for (const std::size_t empty : {0, 2}) {
    EXPECT_EQ(s["frames"][empty]["count"], 0);
    for (const char* key : {"mean", "sd", "rms", "min", "max"}) EXPECT_TRUE(s["frames"][empty][key].is_null()) << key;
  }
}

TEST_F(StatisticsStage, RmsAgainstAReferenceByParts) {
  // A step of 100 mm after the tenth of twenty columns; errors of 2 mm within three pixels of it, 1 mm elsewhere.
  std::vector<float> truth(2 * 20), depth(2 * 20);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const std::size_t column = i % 20;
    truth[i] = column < 10 ? 1.0F : 1.1F;
    depth[i] = truth[i] + (column >= 6 && column <= 13 ? 0.002F : -0.001F);
  }
  depth[0] = none;
  const auto part = [&](const std::string& which) {
    Harness stage(line("overwrite=true reference=true_depth part=" + which));
    stage.put<float>("depth", {2, 20}, depth);
    stage.put<float>("true_depth", {2, 20}, truth, {.unit = "m", .of = "", .applied = "", .from = ""});
    stage.run();
    stage.finish();
    return json::parse(read_text(path)).at("inputs").at(0);
  };
  EXPECT_EQ(part("edge")["count"], 16);
  EXPECT_NEAR(part("edge")["rms"], 0.002, 1e-6);
  EXPECT_EQ(part("flat")["count"], 23);
  EXPECT_NEAR(part("flat")["rms"], 0.001, 1e-6);
  EXPECT_NEAR(part("all")["rms"], std::sqrt((16 * 4e-6 + 23 * 1e-6) / 39), 1e-6);
  EXPECT_EQ(part("all")["rms_against"], "true_depth");

  const json each = part("each");
  EXPECT_EQ(each["count"], 39);
  EXPECT_EQ(each["flat"]["count"], 23);
  EXPECT_NEAR(each["flat"]["rms"], 0.001, 1e-6);
  EXPECT_NEAR(each["edge"]["rms"], 0.002, 1e-6);
  EXPECT_NEAR(each["frames"][0]["edge"]["rms"], 0.002, 1e-6);
  path.replace_extension(".csv");
  Harness stage(line("reference=true_depth part=each"));
  stage.put<float>("depth", {2, 20}, depth);
  stage.put<float>("true_depth", {2, 20}, truth, {.unit = "m", .of = "", .applied = "", .from = ""});
  stage.run();
  stage.finish();
  std::istringstream table(read_text(path));
  std::string heading, pooled;
  std::getline(table, heading);
  std::getline(table, pooled);
  EXPECT_TRUE(heading.ends_with(",rms_m,rms_against,rms_flat_m,rms_edge_m")) << heading;
  double flat = 0, edge = 0;
  ASSERT_EQ(std::sscanf(pooled.c_str() + pooled.find("true_depth"), "true_depth,%lf,%lf", &flat, &edge), 2) << pooled;
  EXPECT_NEAR(flat, 0.001, 1e-6);
  EXPECT_NEAR(edge, 0.002, 1e-6);
}

TEST_F(StatisticsStage, ThereIsNoRmsAgainstAPlaneThatCannotBeFitted) {
  const test::Camera camera = test::camcube2();
  std::vector<float> depth(204 * 204, none);
  for (const std::size_t i : {100, 5000, 30000}) depth[i] = 1 + 1e-5F * static_cast<float>(i);
  const json three = of("depth", {204, 204}, {depth}, "", &camera.view);
  EXPECT_EQ(three["count"], 3);
  EXPECT_EQ(three["rms_against"], "plane");
  EXPECT_TRUE(three["rms"].is_null()) << "any three points lie in a plane: " << three["rms"];
  EXPECT_TRUE(three["frames"][0]["rms"].is_null());
  depth[20000] = 3;
  EXPECT_GT(of("depth", {204, 204}, {depth}, "", &camera.view)["rms"], 0.01);
}

TEST_F(StatisticsStage, ThereIsNoRmsWithALengthOutsideTheLensModel) {
  test::Camera camera = test::camcube2();
  camera.view.distortion[0] = -3;  // folds over at r = 1/3; the corners, at 0.449, have no ray
  const std::vector<float> depth(204 * 204, 2.0F);
  const json s = of("depth", {204, 204}, {depth}, "", &camera.view);
  EXPECT_EQ(s["count"], 204 * 204);
  EXPECT_TRUE(s["rms"].is_null()) << s["rms"];
  EXPECT_NEAR(s["mean"], 2, 1e-9);
}

TEST_F(StatisticsStage, OneToTenIsKnown) {
  std::vector<float> values;
  for (int i = 1; i <= 10; ++i) values.push_back(static_cast<float>(i));
  const json s = of("depth", {2, 5}, {values}, "value='5 m'");
  EXPECT_EQ(s["count"], 10);
  EXPECT_DOUBLE_EQ(s["mean"], 5.5);
  EXPECT_DOUBLE_EQ(s["sd"], std::sqrt(82.5 / 9));    // sum of squares about the mean: n (n^2 - 1) / 12
  EXPECT_DOUBLE_EQ(s["rms"], std::sqrt(85.0 / 10));  // 16 + 9 + 4 + 1 + 0 + 1 + 4 + 9 + 16 + 25
  EXPECT_EQ(s["min"], 1);
  EXPECT_EQ(s["max"], 10);
  EXPECT_EQ(s["rms_against"], "value");
  EXPECT_EQ(s["channel"], "depth");
  EXPECT_EQ(s["name"], "input");
}

TEST_F(StatisticsStage, FramesAreKeptApartAndPooled) {
  const json s = of("range", {1, 2}, {{1, 3}, {none, 11}, {none, none}}, "value='1 m'");
  ASSERT_EQ(s["frames"].size(), 3U);
  EXPECT_EQ(s["frames"][0]["mean"], 2);
  EXPECT_EQ(s["frames"][0]["frame"], 0);
  EXPECT_EQ(s["frames"][1]["count"], 1);
  EXPECT_EQ(s["frames"][1]["mean"], 11);
  EXPECT_TRUE(s["frames"][1]["sd"].is_null()) << "one value has no deviation";
  EXPECT_EQ(s["frames"][2]["count"], 0);
  for (const char* key : {"mean", "sd", "rms", "min", "max"}) EXPECT_TRUE(s["frames"][2][key].is_null()) << key;
  EXPECT_EQ(s["count"], 3);
  EXPECT_DOUBLE_EQ(s["mean"], 5);
  EXPECT_DOUBLE_EQ(s["sd"], std::sqrt((16.0 + 4 + 36) / 2));  // of 1, 3, 11
  EXPECT_DOUBLE_EQ(s["rms"], std::sqrt((0.0 + 4 + 100) / 3));
}

TEST_F(StatisticsStage, TheRegionHasBothEnds) {
  std::vector<float> values(20);
  for (std::size_t i = 0; i < 20; ++i) values[i] = static_cast<float>(i);
  const json s = of("distance", {4, 5}, {values}, "columns=[1,2] rows=[2,3]");
  EXPECT_EQ(s["count"], 4);
  EXPECT_DOUBLE_EQ(s["mean"], (11.0 + 12 + 16 + 17) / 4);
}

TEST_F(StatisticsStage, ManyFramesOfSmallDeviationsKeepTheirDigits) {
  // 7 m with +-1 um: sums of the squared values themselves would lose it.
  const json s = of("depth", {1, 2}, std::vector<std::vector<float>>(1000, {7.0F, 7.0F + 4.76837158203125e-7F}));
  EXPECT_NEAR(s["sd"].get<double>(), 4.76837158203125e-7 / 2 * std::sqrt(2000.0 / 1999), 1e-15);
}

TEST_F(StatisticsStage, ABoardHasThePublishedMeanAndDeviation) {
  // The reference's table of modelled depths: 500 mm, whole sensor: 517.32 mm, sd 10.03 mm.
  const Outcome outcome = shell(
      "\"$TOFGRAPH\" run 'simulator distance=\"500 mm\" noise=none ! four_phase_decoder ! statistics path=s.json' "
      "--camera camcube2",
      folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json s = json::parse(read_text(folder.path() / "s.json"))["inputs"][0];
  EXPECT_NEAR(s["mean"].get<double>(), 517.32e-3, 0.01e-3);
  EXPECT_NEAR(s["sd"].get<double>(), 10.03e-3, 0.01e-3);
  EXPECT_EQ(s["count"], 204 * 204);
  EXPECT_TRUE(s["rms"].is_null()) << "a raw distance is not a point of a plane";
  EXPECT_TRUE(s["rms_against"].is_null());
}

// Plane fit.

constexpr std::uint32_t height = 24, width = 32;

test::Camera small_camera() { return {width, height, 12.8e-3, 400e-6, {{"lamp", {0, 0, 0}, 1}}}; }

TEST_F(StatisticsStage, ATiltedPlaneHasNoRms) {
  const test::Camera camera = small_camera();
  const double normal[] = {0.2, -0.3, std::sqrt(1 - 0.13)}, offset = 1.7;  // m, in the optical frame
  std::vector<float> range, depth;
  for (std::size_t i = 0; i < width * height; ++i) {
    const float* ray = &camera.rays[3 * i];
    const double r = offset / (normal[0] * ray[0] + normal[1] * ray[1] + normal[2] * ray[2]);
    range.push_back(static_cast<float>(r));
    depth.push_back(static_cast<float>(r * ray[2] + 12.8e-3));  // from the sensor plane
  }
  const json of_range = of("range", {height, width}, {range}, "", &camera.view);
  EXPECT_LT(of_range["rms"].get<double>(), 2e-7) << "floats of 2 m";
  EXPECT_EQ(of_range["rms_against"], "plane");
  EXPECT_LT(of("depth", {height, width}, {depth}, "", &camera.view)["rms"].get<double>(), 2e-7);
  EXPECT_GT(of_range["sd"].get<double>(), 0.05) << "which is not the deviation of the values";
}

TEST_F(StatisticsStage, AChessboardOfStepsIsItsStepFromThePlane) {
  const test::Camera camera = small_camera();
  std::vector<float> depth;
  for (std::size_t i = 0; i < width * height; ++i)
    depth.push_back((i % width + i / width) % 2 == 0 ? 2.0F - 0.015625F : 2.0F + 0.015625F);
  // The steps place the points on two parallel planes with the same directions: no other plane is closer.
  EXPECT_NEAR(of("depth", {height, width}, {depth}, "", &camera.view)["rms"].get<double>(), 0.015625, 2e-6);
}

TEST_F(StatisticsStage, TheFittedPlaneIsThatOfAnotherLibrary) {
  const test::Camera camera = small_camera();
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.01);
  std::vector<float> range;
  cv::Mat points;
  for (std::size_t i = 0; i < width * height; ++i) {
    const float* ray = &camera.rays[3 * i];
    range.push_back(i % 17 == 0 ? none : static_cast<float>(1.5 / ray[2] + 0.3 * ray[0] + noise(random)));
    if (!std::isnan(range.back()))
      points.push_back(cv::Mat(cv::Matx13d(ray[0], ray[1], ray[2]) * double{range.back()}));
  }
  cv::Mat centre;
  cv::reduce(points, centre, 0, cv::REDUCE_AVG);
  const cv::SVD decomposition(points - cv::repeat(centre, points.rows, 1), cv::SVD::NO_UV);
  const double expected = decomposition.w.at<double>(2) / std::sqrt(points.rows);
  EXPECT_NEAR(of("range", {height, width}, {range}, "", &camera.view)["rms"].get<double>(), expected, 1e-12);
}

TEST_F(StatisticsStage, NoPlaneWithoutTheFocalLengthInMetres) {
  test::Camera camera = small_camera();
  camera.view.focal_length = std::nan("");
  camera.view.pitch[0] = camera.view.pitch[1] = std::nan("");
  const std::vector<float> values(width * height, 2);
  EXPECT_TRUE(of("depth", {height, width}, {values}, "", &camera.view)["rms_against"].is_null());
  EXPECT_EQ(of("range", {height, width}, {values}, "", &camera.view)["rms_against"], "plane");
}

// Several inputs, formats, errors.

TEST_F(StatisticsStage, InputsCarryTheNamesOfTheirNodes) {
  const std::string nodes =
      "pipeline: 1\ncamera: camcube2\nnodes:\n"
      "  - {name: board, stage: simulator, noise: none, frames: 2}\n"
      "  - {name: decode, stage: four_phase_decoder}\n"
      "  - {name: correct, stage: optimized_bistatic}\n"
      "  - {stage: statistics, inputs: [decode, correct], value: 500 mm, columns: [100, 103], rows: [100, 103]";
  write_text(folder.path() / "p.yaml",
             nodes + ", path: s.csv}\n  - {name: second, stage: statistics, inputs: [correct]}\n");
  const Outcome outcome = shell("\"$TOFGRAPH\" run p.yaml", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream csv(read_text(folder.path() / "s.csv"));
  std::vector<std::string> lines;
  for (std::string text; std::getline(csv, text);) lines.push_back(text);
  ASSERT_EQ(lines.size(), 7U);
  EXPECT_EQ(lines[0], "name,channel,frame,count,mean_m,sd_m,min_m,max_m,rms_m,rms_against");
  EXPECT_EQ(lines[1].substr(0, 23), "decode,distance,all,32,");
  EXPECT_EQ(lines[2].substr(0, 21), "decode,distance,0,16,");
  EXPECT_EQ(lines[4].substr(0, 21), "correct,depth,all,32,");
  EXPECT_EQ(lines[6].substr(0, 19), "correct,depth,1,16,");
  EXPECT_EQ(lines[6].substr(lines[6].rfind(',') + 1), "value");
  expect_words(outcome.out, "mean/mm");
  expect_words(outcome.out, "correct              depth");
}

TEST_F(StatisticsStage, ChecksBeforeTheFirstFrame) {
  const auto why = [&](const std::string& more) {
    return thrown([&] {
      Harness stage(more);
      stage.put<float>("depth", {4, 5}, std::vector<float>(20));
      stage.prepare();
    });
  };
  expect_words(why("statistics columns=[1,5]"),
               "parameter 'columns': 5 is outside of the image, whose columns are 0 to 4");
  expect_words(why("statistics rows=[3,2]"), "parameter 'rows': expected the first and the last, e.g. rows: [90, 113]");
  expect_words(why("statistics rows=[1.5,2]"), "expected the first and the last");
  expect_words(why("statistics path=a.txt"), "'path': ");
  expect_words(why("statistics path=a.txt"), "says nothing about the format: end it in .csv or .json");
  expect_words(why("statistics channel=range"), "'channel': there is no 'range'; what arrives from");
  expect_words(why("statistics value='20 counts'"), "'depth' is in m: write e.g. value: 500 mm");
  write_text(path, "precious");
  expect_words(why(line()), path.string() + " already exists: --force or overwrite: true allows it to be replaced");
}

TEST_F(StatisticsStage, TakesEveryImageInItsOwnUnit) {
  // Values 1, 2, 3, -6 counts: mean 0, sd sqrt(50 / 3), rms from 2 counts sqrt((1 + 0 + 1 + 64) / 4). NaN is ignored.
  Harness stage(line("channel=amplitude value='2 counts'"));
  stage.put<float>("depth", {1, 5}, std::vector<float>(5, 1.0F));
  stage.put<float>("amplitude", {1, 5}, {1, 2, 3, -6, none}, {.unit = "counts"});
  stage.run();
  stage.finish();
  const json all = json::parse(read_text(path)), found = all.at("inputs").at(0);
  EXPECT_EQ(all["unit"], "counts");
  EXPECT_EQ(found["channel"], "amplitude");
  EXPECT_EQ(found["count"], 4);
  EXPECT_NEAR(found["mean"].get<double>(), 0, 1e-12);
  EXPECT_NEAR(found["sd"].get<double>(), std::sqrt(50.0 / 3), 1e-12);
  EXPECT_NEAR(found["rms"].get<double>(), std::sqrt(66.0 / 4), 1e-12);

  // An offset is in m but is not a length: it may be negative.
  const json offset = of("offset", {1, 2}, {{-0.004F, 0.006F}}, "channel=offset");
  EXPECT_EQ(offset["count"], 2);
  EXPECT_NEAR(offset["mean"].get<double>(), 0.001, 1e-9);

  const fs::path csv = folder.path() / "a.csv";
  const Outcome outcome = shell(
      "\"$TOFGRAPH\" run \"simulator frames=1 ! four_phase_decoder ! statistics "
      "channel=amplitude path=a.csv show=true\" --camera camcube2",
      folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string text = read_text(csv);
  EXPECT_EQ(text.substr(0, text.find('\n')),
            "name,channel,frame,count,mean_counts,sd_counts,min_counts,max_counts,rms_counts,rms_against");
  expect_words(outcome.out, "mean/counts");
}

TEST_F(StatisticsStage, AFullDiskIsAnErrorAtTheEnd) {
  const SmallDisk disk("4k");
  if (!disk.available()) GTEST_SKIP() << "no right to mount a small disk";
  Harness stage("statistics path=" + (disk.path() / "s.json").string());
  for (int i = 0; i < 100; ++i) {
    stage.put<float>("depth", {1, 2}, {1, 2});
    stage.run();
  }
  expect_words(thrown([&] { stage.finish(); }), "s.json cannot be written: No space left on device");
  EXPECT_TRUE(listing(disk.path()).empty());
}

}  // namespace
}  // namespace tofgraph::tests
