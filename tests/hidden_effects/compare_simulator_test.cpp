// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: PlainCamera.SeesWhatTheSimulatorSees:PlainCamera.SeesTheSameInOtherSettings
// Rooms: simulation plugins
// Two implementations of the same formulas, the plain camera and the simulator, must agree: pixel by pixel, without
// noise, for every effect at its typical amplitude.
#include "simulation/simulation.hpp"
#include "tests/hidden_effects/campaign.hpp"
#include "tests/program.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::hidden {
namespace {

using tests::TemporaryFolder;

/// Compared values of an image.
struct Seen {
  Image distance, amplitude, intensity, null1, null2;
};

Seen decoded(const Camera& camera, const std::array<Image, 4>& c, Image intensity) {
  Seen seen;
  for (std::size_t i = 0; i < camera.pixels(); ++i) {
    seen.distance.push_back(camera.metres_per_radian() * std::atan2(c[3][i] - c[1][i], c[0][i] - c[2][i]));
    seen.amplitude.push_back(std::hypot(c[3][i] - c[1][i], c[0][i] - c[2][i]) / 2);
    seen.null1.push_back((c[0][i] + c[1][i] + c[2][i] + c[3][i]) / 4);
    seen.null2.push_back((c[0][i] - c[1][i] + c[2][i] - c[3][i]) / 4);
  }
  seen.intensity = std::move(intensity);
  return seen;
}

Seen plain(const Physics& physics, const View& view) {
  const Taps taps = expected_taps(physics, view);
  Readout readout(physics, NoiseKind::none);
  std::mt19937_64 unused;
  std::array<Image, 4> c;
  Image intensity(physics.camera.pixels(), 0.0);
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t i = 0; i < intensity.size(); ++i) {
      const double a = readout(taps.a[k][i], unused), b = readout(taps.b[k][i], unused);
      c[k].push_back(a - b);
      intensity[i] += (std::max(0.0, std::round(a)) + std::max(0.0, std::round(b))) / 8;  // as a capture stores them
    }
  return decoded(physics.camera, c, intensity);
}

Physics with(const std::string& effect) {
  Physics physics;
  physics.effects.add_text(effect, 1, 1);
  return physics;
}

/// A condition and the corresponding scene keys.
struct Case {
  View view;
  std::string keys;  ///< scene keys
};

Case board(double distance, double integration_time, const std::string& keys = "") {
  Case one;
  one.view.distance = distance;
  one.view.integration_time = integration_time;
  one.view.time_since_power_on = 300;
  one.view.ambient = true;
  one.keys = "time_since_power_on: 300 s\nambient: lamp\n" + keys;
  return one;
}

void write_map(hid_t file, const char* name, const Image& map) {
  const std::array<hsize_t, 2> extent = {204, 204};
  const hid_t space = H5Screate_simple(2, extent.data(), nullptr);
  const hid_t data = H5Dcreate2(file, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, map.data());
  H5Dclose(data);
  H5Sclose(space);
}

void write_maps(const std::filesystem::path& path, const PixelMaps& maps) {
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  write_map(file, "fixed_pattern", maps.fixed_pattern);
  write_map(file, "slope", maps.fixed_pattern_slope);
  write_map(file, "response", maps.response);
  write_map(file, "dark", maps.dark);
  write_map(file, "dark_rate", maps.dark_rate);
  H5Fclose(file);
}

std::string model_text(const Physics& physics) {
  std::string text = fmt::format("model: 1\ncamera: camcube2\nlight: {}\neffects:{}\n",
                                 physics.light == Light::reference ? "reference" : "physical",
                                 physics.effects.all().empty() ? " []" : "");
  for (const auto& [name, parameters] : catalogue()) {
    if (!physics.effects.has(name)) continue;
    text += "  - {effect: " + name;
    for (const Parameter& parameter : parameters)
      if (const double value = physics.effects.value(name, parameter.name); std::isfinite(value))
        text += fmt::format(", {}: {} {}", parameter.name, value, parameter.unit);
    if (name == "fixed_pattern")
      text += ", map: {file: maps.h5, dataset: fixed_pattern}, slope_map: {file: maps.h5, dataset: slope}";
    if (name == "pixel_response")
      text +=
          ", map: {file: maps.h5, dataset: response}, dark_map: {file: maps.h5, dataset: dark}, "
          "dark_rate_map: {file: maps.h5, dataset: dark_rate}";
    text += "}\n";
  }
  return text;
}

/// Maps of the camera, as numbers and as the file named by models, and the effects; shared by all comparisons.
struct Shared {
  TemporaryFolder folder;
  PixelMaps maps = draw_maps(Camera(), 3);
  graph::PluginRegistry registry{graph::plugin_path({})};

  Shared() {
    std::ranges::transform(maps.fixed_pattern, maps.fixed_pattern_slope.begin(), [](double m) { return 0.3 * m; });
    write_maps(folder.path() / "maps.h5", maps);
  }
};

const Shared& shared() {
  static const Shared all;
  return all;
}

/// Frames that `tofgraph simulate` would write to a capture.
Seen simulated(const Physics& physics, const Case& condition) {
  const std::filesystem::path folder = shared().folder.path();
  tests::write_text(folder / "model.yaml", model_text(physics));
  tests::write_text(
      folder / "scene.yaml",
      fmt::format(
          "scene: 1\ncamera: camcube2\nframes: 1\noutput: [phases, taps]\nnoise: none\nintegration_time: {} "
          "s\n{}\nobjects:\n"
          "  - {{name: board, type: board, distance: {} m, tilt_x: {} rad, tilt_y: {} rad, reflectivity: {}}}\n",
          condition.view.integration_time, condition.keys, condition.view.distance, condition.view.tilt_x,
          condition.view.tilt_y, condition.view.reflectivity));
  config::Diagnostics diagnostics;
  const auto simulation = simulation::Simulation::read(folder / "scene.yaml", shared().registry,
                                                       {.model = folder / "model.yaml"}, diagnostics);
  if (simulation == nullptr) throw std::runtime_error(diagnostics.text());
  const auto condition_frames = simulation->prepare(0);
  const simulation::Frames& frames = condition_frames->frames;
  const std::size_t pixels = physics.camera.pixels();
  std::vector<float> phases(4 * pixels);
  frames.phases(0, phases.data());
  std::array<Image, 4> c;
  for (std::size_t i = 0; i < phases.size(); ++i) c[i / pixels].push_back(static_cast<double>(phases[i]));
  std::vector<std::uint16_t> taps(8 * pixels);
  frames.taps(0, taps.data());
  Image intensity(pixels, 0.0);
  for (std::size_t i = 0; i < taps.size(); ++i) intensity[i % pixels] += taps[i] / 8.0;
  return decoded(physics.camera, c, intensity);
}

/// Largest differences over the image.
struct Difference {
  double distance = 0;                         ///< mm
  double intensity = 0;                        ///< counts
  double amplitude = 0, null1 = 0, null2 = 0;  ///< % of the amplitude

  void take(const Camera& camera, const Seen& a, const Seen& b) {
    const double range = speed_of_light / (2 * camera.modulation_frequency);
    for (std::size_t i = 0; i < a.distance.size(); ++i) {
      distance = std::max(distance, 1e3 * std::abs(std::remainder(a.distance[i] - b.distance[i], range)));
      const auto percent = [&](const Image& x, const Image& y, double of) { return 100 * std::abs(x[i] - y[i]) / of; };
      amplitude = std::max(amplitude, percent(a.amplitude, b.amplitude, a.amplitude[i]));
      intensity = std::max(intensity, std::abs(a.intensity[i] - b.intensity[i]));
      null1 = std::max(null1, percent(a.null1, b.null1, a.amplitude[i]));
      null2 = std::max(null2, percent(a.null2, b.null2, a.amplitude[i]));
    }
  }
};

Difference compare(Physics physics, const std::vector<Case>& cases, const std::string& label) {
  physics.maps = shared().maps;
  Difference difference;
  for (const Case& one : cases) difference.take(physics.camera, plain(physics, one.view), simulated(physics, one));
  fmt::print("| {:<40} | {:>9.4f} | {:>9.4f} | {:>9.4f} | {:>9.4f} | {:>9.4f} |\n", label, difference.distance,
             difference.amplitude, difference.intensity, difference.null1, difference.null2);
  std::fflush(stdout);
  return difference;
}

void expect_alike(const Difference& difference, const std::string& label) {
  EXPECT_LT(difference.distance, 0.02) << label << ": mm";
  EXPECT_LT(difference.amplitude, 0.01) << label << ": %";
  EXPECT_LE(difference.intensity, 0.5) << label << ": counts; four equal taps of eight may round the other way";
  EXPECT_LT(difference.null1, 0.01) << label << ": %";
  EXPECT_LT(difference.null2, 0.01) << label << ": %";
}

TEST(PlainCamera, SeesWhatTheSimulatorSees) {
  const std::vector<Case> two = {board(0.8, 1e-3), board(2.6, 4e-3)};
  fmt::print("| effect | distance, mm | amplitude, % | intensity, counts | N1/a, % | N2/a, % |\n");
  for (const Light light : {Light::reference, Light::physical}) {
    Physics physics;
    physics.light = light;
    const std::string form = light == Light::reference ? "" : " (physical)";
    expect_alike(compare(physics, two, "none" + form), "none" + form);
    for (const Effect& effect : catalogue()) {
      if (effect.name == "temporal_noise") continue;
      Physics changed = physics;
      changed.effects.add_typical(effect.name, 1, 11);
      expect_alike(compare(changed, two, effect.name + form), effect.name + form);
    }
  }
}

TEST(PlainCamera, SeesTheSameWithTheRarerParameters) {
  for (const std::string effect :
       {"wiggling:amplitude=20mm,phase=0.4rad,amplitude5=8mm,phase5=-1rad,amplitude7=3mm,phase7=2rad",
        "integration_time_offset:slope=8mm,linear=1m/s,exponent=0.3",
        "warm_up:drift=10mm,time_constant=720s,droop=3%,slow_drift=5mm,slow_time_constant=3600s,exponent=0.4,"
        "reference_time=1ms",
        "ambient_light:rate=1e5counts/s,suppression=900counts", "beam_profile:exponent=3.5,toe=80mrad",
        "surface_reflectance:lambert=0.4,roughness=0.6rad", "saturation:full_well=1500counts",
        "lens_distortion:k1=-0.44,k2=0.22,p1=0.002,p2=-0.005,k3=0.01", "adc_nonlinearity:quadratic=4%,cubic=8%",
        "stray_light:fraction=8%,width=12px,uniform=0.2", "multipath:strength=20%,extra_path=2.4m",
        "rail_reflection:strength=5%,height=0.25m", "specular:strength=1.5,exponent=20"})
    expect_alike(compare(with(effect), {board(0.8, 1e-3), board(2.6, 4e-3)}, effect.substr(0, 40)), effect);
}

/// A condition's settings other than the board's distance, with the effects that they switch on or change.
struct Setting {
  std::string name;
  std::vector<std::string> effects;
  Case condition;
};

std::vector<Setting> settings() {
  std::vector<Setting> all;
  const auto add = [&](const std::string& name, const std::vector<std::string>& effects, const std::string& keys,
                       const auto& change) {
    all.push_back({name, effects, board(1.3, 2e-3, keys)});
    change(all.back().condition.view);
  };
  add("tilted", {"surface_reflectance", "rail_reflection", "source_amplitude"}, "", [](View& view) {
    view.tilt_x = 0.4;
    view.tilt_y = -0.3;
  });
  for (const int degrees : {90, 180, 30})
    add(fmt::format("roll {} deg", degrees), {"board_tilt", "principal_point", "source_phase"},
        fmt::format("roll: {} deg\n", degrees), [&](View& view) {
          view.roll = degrees * M_PI / 180;
          view.tilt_x = 0.2;
        });
  add("board_tilt, tilted board", {"board_tilt"}, "", [](View& view) {
    view.tilt_x = 0.4;
    view.tilt_y = -0.3;
  });
  add("rail, roll 90 deg", {"rail_reflection"}, "roll: 90 deg\n", [](View& view) { view.roll = M_PI / 2; });
  add("ambient_light, capped", {"crosstalk", "ambient_light"}, "lens: capped\n",
      [](View& view) { view.capped = true; });
  for (const std::size_t source : {0U, 1U})
    add(source == 0 ? "left alone" : "right alone",
        {"source_phase", "source_amplitude", "source_position", "beam_profile:exponent=3,toe=100mrad", "specular"},
        source == 0 ? "sources: left\n" : "sources: right\n", [&](View& view) {
          view.on = {source == 0, source == 1};
        });
  for (const double velocity : {-0.1, 0.0, 0.05}) {
    for (const std::string effect : {"motion", "wiggling"})
      add(fmt::format("velocity {} m/s, {}", velocity, effect), {effect}, fmt::format("velocity: {} m/s\n", velocity),
          [&](View& view) { view.velocity = velocity; });
  }
  add("by laser", {"rail_scale", "rail_offset"}, "reference: laser\n", [](View& view) { view.laser = true; });
  add("capped", {"crosstalk", "stray_light", "rail_reflection", "pixel_response"}, "lens: capped\n", [](View& view) {
    view.capped = true;
    view.integration_time = 50e-3;
  });
  add("covered", {"rail_reflection", "multipath"}, "rail: covered\n", [](View& view) { view.covered = true; });
  return all;
}

TEST(PlainCamera, SeesTheSameInOtherSettings) {
  for (const Light light : {Light::reference, Light::physical})
    for (const Setting& setting : settings()) {
      Physics physics;
      physics.light = light;
      for (const std::string& effect : setting.effects) physics.effects.add_text(effect, 1, 5);
      expect_alike(compare(physics, {setting.condition}, setting.name), setting.name);
    }
}

/// The reference does not specify whether a surface's factor also applies to its gloss: the simulator multiplies both
/// by it, the plain camera adds the gloss. For a board tilted relative to the camera this is 3 % of the amplitude;
/// everything else, and all of it for a surface factor of 1, is equal.
TEST(PlainCamera, GlossOfAMattSurfaceDiffersByThreePercentOfTheAmplitude) {
  Case turned = board(1.3, 2e-3);
  turned.view.tilt_y = -0.3;
  for (const Light light : {Light::reference, Light::physical}) {
    const auto difference = [&](const std::string& surface) {
      Physics physics;
      physics.light = light;
      for (const std::string& effect : {surface, std::string("specular")}) physics.effects.add_text(effect, 1, 5);
      return compare(physics, {turned}, "specular, " + surface);
    };
    expect_alike(difference("surface_reflectance:lambert=0,roughness=0rad"), "specular alone");
    const Difference matt = difference("surface_reflectance");
    EXPECT_NEAR(matt.amplitude, 3.02, 0.02);
    EXPECT_LT(matt.distance, 0.02);
    EXPECT_LT(matt.null1, 0.01);
    EXPECT_LT(matt.null2, 0.01);
  }
}

TEST(PlainCamera, SeesNearlyTheSameWithAllEffectsAtOnce) {
  Physics physics;
  for (const Effect& effect : catalogue())
    if (effect.name != "temporal_noise" && effect.name != "saturation" && effect.name != "specular")
      physics.effects.add_typical(effect.name, 1, 7, Drawn::plain);
  // The reference fixes the order of the levels, not of the effects in a level: products of two small effects remain.
  const Difference all = compare(physics, {board(0.9, 1e-3), board(3.1, 4e-3)}, "all");
  EXPECT_LT(all.distance, 0.3);
  EXPECT_LT(all.amplitude, 0.05);
  EXPECT_LT(all.intensity, 2);
}

}  // namespace
}  // namespace tofgraph::hidden
