// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Report.TheTables*:Report.TheProtocol*:Report.ThePrecision*
// Rooms: report calibration
// The command `report`: tables 5.1 to 5.3 of the reference, and known contributions to an error.
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cmath>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

class Report : public testing::Test {
 protected:
  Outcome run(const std::string& command) const { return shell("\"$TOFGRAPH\" " + command, folder.path()); }

  /// Simulates a scene and runs report on it.
  nlohmann::json report(const std::string& scene, const std::string& more = {}) const {
    write_text(folder.path() / "scene.yaml", scene);
    const Outcome simulated = run("simulate scene.yaml -o data --quiet --force");
    EXPECT_EQ(simulated.exit_code, 0) << simulated.err;
    const Outcome reported = run("report data/campaign.yaml -o out --force " + more);
    EXPECT_EQ(reported.exit_code, 0) << reported.err;
    return nlohmann::json::parse(read_text(folder.path() / "out/report.json"));
  }

  TemporaryFolder folder;
};

struct Published {
  const char* sources;
  double optimized, measured, measured_sd, perpendicular, perpendicular_sd, simple;  // mm
};

/// The boards are where the optimized model measured the real ones, nominally 500 mm; the single-source columns of the
/// simple model are relative to the lens centre, 12.8 mm in front of the sensor, as in the tables.
TEST_F(Report, TheTablesOfTheThreeModelsAreThoseOfTheReference) {
  constexpr double unknown = NAN, lens = 12.8;
  const std::array<Published, 3> tables = {{{"both", 505.02, 523.57, 10.89, 513.16, 5.66, 505.07},
                                            {"left", 445.55, 461.27, unknown, unknown, unknown, 432.98 + lens},
                                            {"right", 459.98, 476.13, unknown, unknown, unknown, 447.35 + lens}}};
  for (const Published& t : tables) {
    const std::string scene =
        "scene: 1\ncamera: camcube2\nframes: 2\nnoise: none\nintegration_time: 0.5 ms\nsources: " +
        std::string(t.sources) +
        "\nmodel: {effects: [{effect: rail_offset, offset: " + std::to_string(t.optimized - 500) +
        " mm}]}\nobjects:\n  - {name: board, type: board, distance: 500 mm}\n" +
        "sequence:\n  - {key: board.distance, values: [500 mm]}\n";
    const nlohmann::json condition = report(scene)["conditions"][0];
    const auto mean = [&](const nlohmann::json& m) { return 1e3 * m["mean"].get<double>(); };
    const auto sd = [&](const nlohmann::json& m) { return 1e3 * m["sd"].get<double>(); };
    const nlohmann::json& depth = condition["depth"];
    std::printf("%s: measured %.2f / %.2f, perpendicular %.2f / %.2f, simple %.2f, optimized %.2f\n", t.sources,
                mean(condition["measured_distance"]), sd(condition["measured_distance"]),
                mean(depth["perpendicular_illumination"]), sd(depth["perpendicular_illumination"]),
                mean(depth["simple_bistatic"]), mean(depth["optimized_bistatic"]));
    EXPECT_NEAR(mean(depth["optimized_bistatic"]), t.optimized, 0.01);
    EXPECT_LT(sd(depth["optimized_bistatic"]), 0.01);
    EXPECT_NEAR(mean(depth["simple_bistatic"]), t.simple, 0.1) << t.sources;
    // The real board of table 5.3 was 1.1 mm farther in the mean of the raw distances than the paths imply.
    EXPECT_NEAR(mean(condition["measured_distance"]), t.measured, std::string(t.sources) == "both" ? 1.2 : 0.1);
    if (std::isnan(t.perpendicular)) continue;
    constexpr double noise = 2.77;  // published sd of the corrected depth; independent of the shapes
    EXPECT_NEAR(mean(depth["perpendicular_illumination"]), t.perpendicular, 0.9);
    EXPECT_NEAR(std::hypot(sd(depth["perpendicular_illumination"]), noise), t.perpendicular_sd, 0.25);
    EXPECT_NEAR(std::hypot(sd(condition["measured_distance"]), noise), t.measured_sd, 0.45);
  }
}

TEST_F(Report, PartsOfTheErrorAreToldApart) {
  const nlohmann::json json = report(
      "scene: 1\ncamera: camcube2\nframes: 6\nnoise: profile\nmodel: {effects: [{effect: integration_time_offset, "
      "slope: 20 mm}]}\nobjects:\n  - {name: board, type: board, distance: 1 m}\nsequence:\n"
      "  - {key: board.distance, values: [600 mm, 1000 mm, 1400 mm]}\n"
      "  - {key: board.reflectivity, values: [0.9, 0.45]}\n"
      "  - {key: integration_time, values: [0.5 ms, 1 ms, 2 ms, 4 ms]}\n");
  ASSERT_EQ(json["conditions"].size(), 24U);
  const auto part = [&](const std::string& name) {
    for (const nlohmann::json& line : json["budget"]) {
      if (line["name"] == name) return line["depth"].get<double>();
    }
    return std::nan("");
  };
  // 20 mm ln(t / 1 ms) of the half path is nearly the same in depth: levels -13.9, 0, 13.9, 27.7 mm.
  const double step = 20e-3 * std::log(2.0);
  // Standard deviation of four equal steps about their mean; oblique rays and lamps reduce it by 1.5 to 4 % in depth.
  EXPECT_NEAR(part("integration time") / (step * std::sqrt(1.25)), 0.972, 0.013);
  EXPECT_NEAR(part("mean error"), step / 2, 0.05 * step);
  EXPECT_LT(part("target"), 0.3e-3);
  EXPECT_LT(part("distance"), 0.5e-3);
  EXPECT_LT(part("fixed pattern"), 0.2e-3) << "there is none";
  double noise = 0;
  for (const nlohmann::json& c : json["conditions"]) noise += std::pow(c["noise"].get<double>(), 2) / 24;
  EXPECT_NEAR(part("noise"), std::sqrt(noise), 1e-6);
}

TEST_F(Report, TheTiltOfABoardIsNoError) {
  const nlohmann::json json = report(
      "scene: 1\ncamera: camcube2\nframes: 2\nnoise: none\nobjects:\n  - {name: board, type: board, distance: 1 m, "
      "tilt_y: 10 deg}\nsequence:\n  - {key: board.distance, values: [1000 mm, 1400 mm]}\n");
  EXPECT_LT(json["error"]["rms"].get<double>(), 0.05e-3) << "the depths have a standard deviation of 30 mm";
  for (const nlohmann::json& line : json["budget"]) EXPECT_LT(line["depth"].get<double>(), 0.05e-3) << line["name"];
}

TEST_F(Report, AModelsEffectsAreThoseOfTheMeasuredPixels) {
  write_text(folder.path() / "model.yaml",
             "model: 1\ncamera: camcube2\neffects:\n  - {effect: board_tilt, y: 1 deg}\n");
  const std::string scene =
      "scene: 1\ncamera: camcube2\nframes: 2\nROI\nobjects:\n  - {name: board, type: board, distance: 1 m}\n"
      "sequence:\n  - {key: board.distance, values: [1000 mm, 1400 mm]}\n";
  const auto tilt = [&](const std::string& roi) {
    const nlohmann::json json = report(std::string(scene).replace(scene.find("ROI"), 3, roi), "--model model.yaml");
    return json["effects"][0]["depth"].get<double>();
  };
  const double rms = std::tan(M_PI / 180) * 102 / 320 / std::sqrt(3) * std::sqrt((1 + 1.4 * 1.4) / 2);  // m
  EXPECT_NEAR(tilt("subpixels: 1"), rms, 0.05 * rms) << "a focal length of 320 px, 102 px to the edge";
  EXPECT_LT(tilt("roi: {columns: [92, 111], rows: [92, 111]}"), 0.15 * rms) << "10 px to the edge, in blocks of 8.5 px";
}

TEST_F(Report, AModelsEffectsAreToldInMillimetres) {
  write_text(folder.path() / "model.yaml",
             "model: 1\ncamera: camcube2\neffects:\n  - {effect: zero_offset, offset: 7 mm}\n"
             "  - {effect: rail_offset, offset: 3 mm}\n");
  const nlohmann::json json = report(
      "scene: 1\ncamera: camcube2\nframes: 2\nobjects:\n  - {name: board, type: board, distance: 1 m}\nsequence:\n"
      "  - {key: board.distance, values: [1000 mm, 1400 mm]}\n",
      "--model model.yaml");
  ASSERT_EQ(json["effects"].size(), 2U);
  EXPECT_EQ(json["effects"][0]["name"], "zero_offset");
  EXPECT_NEAR(json["effects"][0]["depth"].get<double>(), 7e-3 / 1.02, 0.15e-3) << "a half path, on rays up to 24 deg";
  EXPECT_NEAR(json["effects"][1]["depth"].get<double>(), 3e-3, 0.01e-3);
}

TEST_F(Report, TheProtocolIsFollowedOrWhatIsMissingIsSaid) {
  const std::string scene =
      "scene: 1\ncamera: camcube2\nframes: 25\nobjects:\n  - {name: board, type: board, distance: 1 m, reflectivity: "
      "0.9}\ntime_since_power_on: TIME\nmodel: {effects: [{effect: rail_offset, offset: 4 mm}]}\nsequence:\n"
      "  - {key: board.distance, values: [1000 mm]}\n";
  const auto with = [&](const char* time) { return std::string(scene).replace(scene.find("TIME"), 4, time); };
  const nlohmann::json warm = report(with("1500 s"))["conditions"][0];
  EXPECT_EQ(warm["against_protocol"], nlohmann::json::array()) << warm["against_protocol"];
  EXPECT_NEAR(warm["centre_error"].get<double>(), 4e-3, 0.2e-3);
  EXPECT_EQ(report(with("600 s"))["conditions"][0]["against_protocol"],
            nlohmann::json::array({"only 10 min since power-on"}));
}

/// The sources' beams leave the corners with a sixth of the light of the middle.
TEST_F(Report, ThePrecisionOfTheProtocolIsThatOfItsSquare) {
  const std::string scene =
      "scene: 1\ncamera: camcube2\nframes: 25\nnoise: profile\nROI\nobjects:\n  - {name: board, type: board, distance: "
      "1 m, reflectivity: 0.9}\ntime_since_power_on: 1500 s\nmodel: {effects: [{effect: beam_profile, exponent: 20}]}\n"
      "sequence:\n  - {key: board.distance, values: [1000 mm]}\n";
  const auto with = [&](const char* roi) { return std::string(scene).replace(scene.find("ROI"), 3, roi); };
  const double whole = 1e3 * report(with("subpixels: 1"))["conditions"][0]["noise"].get<double>();
  const std::string page = read_text(folder.path() / "out/report.html");
  std::size_t at = page.find("precision, mm</th>");
  ASSERT_NE(at, std::string::npos);
  for (int cell = 0; cell < 5; ++cell) at = page.find("<td>", at + 1);
  const double precision = std::stod(page.substr(at + 4));  // mm
  const nlohmann::json square = report(with("roi: {columns: [82, 121], rows: [82, 121]}"));
  EXPECT_NEAR(precision / (1e3 * square["conditions"][0]["noise"].get<double>()), 1, 0.03);
  EXPECT_LT(precision, 0.8 * whole);
}

TEST_F(Report, OutputsAreNotReplacedUnasked) {
  report(
      "scene: 1\ncamera: camcube2\nframes: 2\nobjects:\n  - {name: board, type: board, distance: 1 m}\nsequence:\n"
      "  - {key: board.distance, values: [1000 mm]}\n");
  const Outcome again = run("report data/campaign.yaml -o out");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("already exists"), std::string::npos) << again.err;
  const Outcome none = run("report nothing.yaml -o new");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_FALSE(fs::exists(folder.path() / "new"));
}

}  // namespace
}  // namespace tofgraph::tests
