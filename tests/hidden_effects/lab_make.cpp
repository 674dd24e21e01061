// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/lab_camera.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

using namespace tofgraph::hidden;

int main(int argc, char** argv) {
  CLI::App app{
      "Makes the recordings of a camera with everything wrong at once: to calibrate it, and to judge the result."};
  int side = 64;
  std::uint64_t seed = 1;
  bool foreign = false;
  Sensor sensor;
  std::string folder, camera = "lab7", noise = "gaussian";
  app.add_option("--side", side, "px, of the square sensor")->capture_default_str()->check(CLI::Range(32, 512));
  app.add_option("--seed", seed, "of everything that is drawn")->capture_default_str();
  app.add_option("--noise", noise, "heavy: outliers as of Student's t with 3 degrees of freedom; or gaussian")
      ->capture_default_str()
      ->check(CLI::IsMember({"heavy", "gaussian"}));
  app.add_option("--read-noise", sensor.read_noise, "sd of a tap, counts")->capture_default_str();
  app.add_option("--shot-noise", sensor.shot_noise, "variance of a tap per count, counts")->capture_default_str();
  app.add_option("--bad-pixels", sensor.bad_pixels, "their share")->capture_default_str()->check(CLI::Range(0.0, 0.5));
  app.add_option("--camera", camera, "as the campaigns name it")->capture_default_str();
  app.add_flag("--foreign", foreign, "Raw dumps and their layout in place of captures");
  app.add_option("-o,--out", folder, "the folder to make")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    if (std::filesystem::exists(folder)) throw std::runtime_error(folder + " exists already; choose another folder");
    LabCamera(side, seed, noise == "heavy" ? NoiseKind::heavy : NoiseKind::gaussian, sensor)
        .record_all(folder, camera, foreign);
  } catch (const std::exception& failure) {
    fmt::print(stderr, "hidden_effects_lab: {}\n", failure.what());
    return 1;
  }
  return 0;
}
