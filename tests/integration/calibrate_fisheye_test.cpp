// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: *
// Rooms: calibration
// A fisheye camera from its views to a corrected board, using commands only.
#include "io/calibration.hpp"
#include "tests/program.hpp"

#include <fmt/format.h>

#include <regex>

using namespace tofgraph;
using namespace tofgraph::tests;

namespace {

/// Profile of a camera that sees 75 deg to each side. @param lens lines of the lens model
std::string wide_profile(const std::string& lens) {
  std::string text = read_text(std::filesystem::path(TOFGRAPH_SOURCE_DIR) / "devices/profiles/camcube2.yaml");
  for (const auto& [line, by] : {std::pair{"name: camcube2.*", std::string("name: wide")},
                                 {"principal_point: .*", std::string()},
                                 {"distortion: .*", std::string()},
                                 {"field_of_view: .*", std::string()},
                                 {"focal_length: .*", "lens: fisheye\n" + lens}})
    text = std::regex_replace(text, std::regex(line), by);
  return text;
}

std::string scene() {
  std::string text =
      "scene: 1\nname: views\ncamera: wide.yaml\nframes: 4\nintegration_time: 0.5 ms\nsubpixels: 8\nobjects:\n"
      "  - {name: wall, type: board, distance: 2500 mm, reflectivity: 0.3}\n"
      "  - {name: pattern, type: chessboard, columns: 8, rows: 6, square: 30 mm, distance: 180 mm, reflectivity: 0.85, "
      "dark: 0.1}\n"
      "sequence:\n  - keys: [pattern.distance, pattern.center, pattern.tilt_x, pattern.tilt_y]\n    values:\n";
  constexpr int views[][5] = {{180, 0, 0, 0, 0},      {186, 0, 0, 25, 0},      {192, 0, 0, -25, 10},
                              {198, 0, 0, 10, 30},    {240, -90, -117, 0, 0},  {246, -90, -117, -25, 0},
                              {240, 90, -117, 0, 0},  {246, 90, -117, 25, 0},  {240, -117, 130, 0, 0},
                              {255, 117, 130, 20, 0}, {240, 117, 130, -25, 0}, {210, 40, 20, -20, -25}};
  for (const auto& v : views)
    text += fmt::format("      - [{} mm, [{} mm, {} mm], {} deg, {} deg]\n", v[0], v[1], v[2], v[3], v[4]);
  return text;
}

TEST(CalibrateFisheye, FromViewsToACorrectedBoardByCommands) {
  const TemporaryFolder folder;
  const auto done = [&](const std::string& command) {
    const Outcome outcome = shell("\"$TOFGRAPH\" " + command, folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << command << outcome.err;
    return outcome;
  };
  write_text(folder.path() / "wide.yaml", wide_profile("focal_length: 3.2 mm\nprincipal_point: [103.2, 100.4]\n"
                                                       "distortion: [0.03, -0.01, 0.004, -0.001]"));
  write_text(folder.path() / "views.yaml", scene());
  done("simulate views.yaml -o views");
  // Manufacturer's data: no distortion, and an inaccurate focal length.
  write_text(folder.path() / "nominal.yaml",
             wide_profile("focal_length: 6 mm\nprincipal_point: [101.5, 101.5]\ndistortion: [0, 0, 0, 0]"));
  const std::filesystem::path campaign = folder.path() / "views/campaign.yaml";
  write_text(campaign, std::regex_replace(read_text(campaign), std::regex("camera: .*"), "camera: ../nominal.yaml"));
  done("calibrate intrinsics views/campaign.yaml -o lens.yaml");

  io::CalibrationReader file(folder.path() / "lens.yaml", "intrinsics", "wide");
  const io::Calibrated focal = file.need("focal_length", "px", 2, ""), powers = file.need("fisheye", "", 4, "");
  for (const std::size_t i : {0U, 1U}) EXPECT_NEAR(focal.value[i], 80, 0.15);
  // Within 0.1 px up to 60 deg; the individual coefficients are correlated.
  for (double theta = 0.1; theta < 1.05; theta += 0.1) {
    const double t = theta * theta;
    const auto radius = [&](const std::vector<double>& k) {
      return 80 * theta * (1 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3]))));
    };
    EXPECT_NEAR(radius(powers.value), radius({0.03, -0.01, 0.004, -0.001}), 0.1) << theta;
  }

  // The stage and the camera folder give the same correction.
  const std::string capture = "views/captures/0000_180mm_0deg_0deg.h5";
  done("run 'capture_reader file=" + capture + " ! four_phase_decoder ! intrinsics calibration=lens.yaml " +
       "! optimized_bistatic ! statistics path=by_stage.json'");
  done("camera new wide --profile nominal.yaml --folder wide");
  done("camera add ./wide lens.yaml");
  write_text(folder.path() / "pipeline.yaml",
             "pipeline: 1\ncamera: ./wide\nnodes:\n  - {stage: capture_reader, file: " + capture +
                 "}\n  - {stage: four_phase_decoder}\n  - {stage: optimized_bistatic}\n"
                 "  - {stage: statistics, path: by_folder.json}\n");
  done("run pipeline.yaml");
  EXPECT_EQ(read_text(folder.path() / "by_stage.json"), read_text(folder.path() / "by_folder.json"));

  const Outcome refused =
      shell("\"$TOFGRAPH\" calibrate intrinsics views/campaign.yaml -o other.yaml --free k3", folder.path());
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("lens: fisheye, whose k1 to k4 are fitted as it is"), std::string::npos) << refused.err;
}

}  // namespace
