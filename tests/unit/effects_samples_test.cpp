// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Effects.OffChanges*
// Rooms: simulation
// Effects on samples and taps, compared with closed forms and numerically correlated waveforms.
#include <gtest/gtest.h>
#include <hdf5.h>

#include "tests/program.hpp"
#include "tests/unit/effect_fixture.hpp"

#include <random>

using namespace tofgraph;
using namespace tofgraph::test;

namespace {

/// Two boards: an edge, two distances.
Tracer two_boards() {
  const Tracer near_board = board_tracer(camcube().focal_length, {1, 0, 0, 0.8}),
               far_board = board_tracer(camcube().focal_length, {2.2, 0, 0, 0.3});
  return [=](const BoardChange& change, std::span<const Vector3> rays, std::span<Hit> hits) {
    far_board(change, rays, hits);
    std::vector<Hit> other(rays.size());
    near_board(change, rays, other);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (rays[i].x < 0.02 || rays[i].y > 0.1) continue;
      hits[i] = other[i];
      hits[i].object = 1;
    }
  };
}

TEST(Effects, OffChangesNothingBitForBit) {
  const graph::PluginRegistry catalogue(graph::plugin_path({}));
  View view;
  view.pixels = whole_image(camcube());
  view.tracer = two_boards();
  view.acquisition.condition.ambient = "lamp";
  view.acquisition.condition.time_since_power_on = 300;
  for (const bool physical : {false, true}) {
    view.physical = physical;
    const std::vector<double> ideal = expected("", view).taps;
    int count = 0;
    for (const graph::PluginFile& file : catalogue.files()) {
      if (file.kind != "effect") continue;
      const Expectation off = expected("{effect: " + file.name + "}", view);
      EXPECT_EQ(off.taps, ideal) << file.name;
      EXPECT_EQ(off.noise_factor, 1) << file.name;
      ++count;
    }
    EXPECT_EQ(count, 36);
  }
}

TEST(Effects, EveryParameterSaysWhatASearchNeeds) {
  const graph::PluginRegistry catalogue(graph::plugin_path({}));
  for (const graph::PluginFile& file : catalogue.files()) {
    if (file.kind != "effect") continue;
    const graph::Plugin& d = catalogue.load(file);
    EXPECT_NE(std::string(d.effect->touches), "") << file.name;
    for (std::uint64_t i = 0; i < d.parameter_count; ++i) {
      const tofgraph_parameter& p = d.parameters[i];
      if (std::isnan(p.typical)) continue;
      EXPECT_TRUE(p.minimum <= p.typical && p.typical <= p.maximum) << file.name << "." << p.name;
      if (!std::isnan(p.off)) {
        EXPECT_TRUE(p.minimum <= p.off && p.off <= p.maximum && p.off != p.typical) << file.name << "." << p.name;
      }
    }
  }
}

/// Light with harmonics, correlated with a gate that also has harmonics, by a sum over one period.
std::array<double, 4> correlate(double phase, int order, double light_harmonic, double gate_harmonic, double angle) {
  std::array<double, 4> c{};
  constexpr int steps = 4096;
  for (int k = 0; k < 4; ++k) {
    for (int i = 0; i < steps; ++i) {
      const double t = 2 * pi * i / steps;
      const double light = std::cos(t - phase) + light_harmonic * std::cos(order * (t - phase) - angle);
      const double gate = std::cos(t + k * pi / 2) + gate_harmonic * std::cos(order * (t + k * pi / 2));
      c[k] += 2 * light * gate / steps;
    }
  }
  return c;
}

TEST(Wiggling, IsTheCorrelationOfRealWaveforms) {
  const double m = 0.1 * 0.12;
  for (const int order : {3, 5, 7}) {
    const std::string suffix = order == 3 ? "" : std::to_string(order);
    const std::string list = "{effect: wiggling, amplitude" + suffix + ": " +
                             std::to_string(1e3 * m * metres_per_radian) + " mm, phase" + suffix + ": 0.7 rad}";
    for (const double distance : {0.6, 1.4, 2.9, 4.1, 6.2}) {
      View view;
      view.board = {distance, 0, 0, 0.8};
      const auto ideal = seen("", view), real = seen(list, view);
      for (std::size_t i = 0; i < ideal.size(); i += 11) {
        const auto c = correlate(ideal[i].phase(), order, 0.1, 0.12, 0.7);
        for (std::size_t k = 0; k < 4; ++k)
          EXPECT_NEAR(real[i].c[k], ideal[i].amplitude() * c[k], 1e-6 * ideal[i].amplitude()) << order;
        EXPECT_NEAR(real[i].light(), ideal[i].light(), 1e-9 * ideal[i].light());
        if (order == 3) {  // dPsi = -m3 sin(4 Psi + psi3) to first order
          EXPECT_NEAR(turned(real[i], ideal[i]), -m * std::sin(4 * ideal[i].phase() + 0.7), 2 * m * m);
        }
      }
    }
  }
}

TEST(EvenHarmonic, IsSeenInN2Alone) {
  const View view;
  const auto ideal = seen("", view), real = seen("{effect: even_harmonic, ratio: 0.03}", view);
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    const double a = ideal[i].amplitude();
    EXPECT_NEAR(real[i].null2(), 0.03 * a * std::cos(2 * ideal[i].phase()), 1e-9 * a);
    EXPECT_NEAR(real[i].null1(), 0, 1e-9 * a);
    EXPECT_NEAR(turned(real[i], ideal[i]), 0, 1e-12);
    EXPECT_NEAR(real[i].amplitude(), a, 1e-9 * a);
  }
}

TEST(PhaseStepError, TakesEachSampleAtItsOwnStep) {
  const View view;
  const auto ideal = seen("", view),
             real = seen("{effect: phase_step_error, step1: 10 mrad, step2: -4 mrad, step3: 7 mrad}", view);
  const double steps[] = {0, 0.010, -0.004, 0.007};
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(real[i].c[k],
                  ideal[i].amplitude() * std::cos(ideal[i].phase() + static_cast<double>(k) * pi / 2 + steps[k]),
                  1e-9 * ideal[i].amplitude());
    // dPsi = sum/4 + [(d1 + d3) - (d0 + d2)]/4 cos 2 Psi
    const double first_order = 0.013 / 4 + (0.017 + 0.004) / 4 * std::cos(2 * ideal[i].phase());
    EXPECT_NEAR(turned(real[i], ideal[i]), first_order, 2e-4);
  }
}

TEST(PhaseGain, GivesEachImageItsOwnLight) {
  const View view;
  const auto ideal = seen("", view),
             real = seen("{effect: phase_gain, gain1: 1 %, gain2: -0.5 %, gain3: 0.25 %}", view);
  const double gains[] = {1, 1.01, 0.995, 1.0025};
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(real[i].c[k], gains[k] * ideal[i].c[k], 1e-9 * ideal[i].amplitude());
      EXPECT_NEAR(real[i].intensity[k], gains[k] * ideal[i].intensity[k], 1e-9 * ideal[i].light());
    }
  }
}

TEST(TapMismatch, MakesN1FollowTheLight) {
  const View view;
  const auto ideal = seen("", view), real = seen("{effect: tap_mismatch, ratio: 4 %}", view);
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    EXPECT_NEAR(real[i].null1(), 0.04 * ideal[i].light(), 1e-9 * ideal[i].light());
    EXPECT_NEAR(real[i].null2(), 0, 1e-9 * ideal[i].light());
    EXPECT_NEAR(turned(real[i], ideal[i]), 0, 1e-12) << "no error of the distance while it is constant";
  }
}

TEST(Motion, IsABoardElsewhereInEachImage) {
  for (const double velocity : {std::nan(""), 0.0, 0.2}) {
    View view;
    view.board = {1.1, 0, 0, 0.6};
    view.acquisition.condition.velocity = velocity;
    const auto real = seen("{effect: motion, displacement: 2 mm}", view);
    const double step = std::isnan(velocity) ? 2e-3 : 2e-3 * velocity / 0.1;
    for (std::size_t k = 0; k < 4; ++k) {
      View there = view;
      there.board.distance += step * static_cast<double>(k);
      const auto alone = seen("", there);
      for (std::size_t i = 0; i < real.size(); ++i) {
        EXPECT_NEAR(real[i].c[k], alone[i].c[k], 1e-9 * alone[i].light());
        EXPECT_NEAR(real[i].intensity[k], alone[i].intensity[k], 1e-9 * alone[i].light());
      }
    }
  }
}

TEST(AdcNonlinearity, IsItsPolynomial) {
  const View view;
  const auto ideal = expected("", view).taps;
  const auto real = expected("{effect: adc_nonlinearity, quadratic: 4 %, cubic: 3 %}", view).taps;
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    const double a = ideal[i], fs = 30000;
    EXPECT_NEAR(real[i], a - 0.04 * a * a / fs - 0.03 * a * a * a / (fs * fs), 1e-9 * a + 1e-9);
  }
}

TEST(AdcNonlinearity, ASquareMakesNoErrorOfTheDistance) {
  const View view;
  const auto ideal = seen("", view), real = seen("{effect: adc_nonlinearity, quadratic: 10 %}", view);
  for (std::size_t i = 0; i < ideal.size(); ++i) EXPECT_NEAR(turned(real[i], ideal[i]), 0, 1e-12);
}

TEST(Saturation, ClipsEachTap) {
  const View view;
  const auto ideal = expected("", view).taps;
  const double limit = 0.8 * *std::max_element(ideal.begin(), ideal.end());
  const auto real = expected("{effect: saturation, full_well: " + std::to_string(limit) + " counts}", view).taps;
  for (std::size_t i = 0; i < ideal.size(); ++i) EXPECT_NEAR(real[i], std::min(ideal[i], limit), 1e-3);
}

TEST(Saturation, ClipsAllLightWhereverItIsListed) {
  View view;
  view.acquisition.condition.ambient = "lamp";
  const std::string clip = "{effect: saturation, full_well: 1000 counts}",
                    lamp = "{effect: ambient_light, rate: 2e6 counts/s}";  // 2000 counts per tap in 2 ms
  for (const std::string& list : {lamp + ", " + clip, clip + ", " + lamp}) {
    for (const double tap : expected(list, view).taps) EXPECT_EQ(tap, 1000) << list;
  }
}

TEST(AmbientLight, FillsBothTapsWhereItIsLit) {
  View view;
  const auto ideal = expected("", view).taps;
  EXPECT_EQ(expected("{effect: ambient_light, rate: 2e5 counts/s}", view).taps, ideal) << "it is dark";
  view.acquisition.condition.ambient = "lamp";
  for (const double tap : expected("{effect: ambient_light, rate: 2e5 counts/s, label: sun}", view).taps)
    EXPECT_TRUE(std::isfinite(tap));
  EXPECT_EQ(expected("{effect: ambient_light, rate: 2e5 counts/s, label: sun}", view).taps, ideal);
  const auto lit = expected("{effect: ambient_light, rate: 2e5 counts/s, label: lamp}", view).taps;
  for (std::size_t i = 0; i < ideal.size(); ++i) EXPECT_NEAR(lit[i], ideal[i] + 2e5 * 2e-3 / 2, 1e-9 * lit[i]);
}

/// A black board returns almost nothing: a current in the pixels gives phasor 6 counts and, at a contrast of 0.5,
/// light of 6 counts to each tap. A - B is 6, 0, -6, 0 counts in the four images, small enough for mental
/// arithmetic.
TEST(AmbientLight, SuppressionTakesTheCommonPartOfAPixelsTaps) {
  View view;
  view.board.reflectivity = 0;
  view.acquisition.condition.ambient = "lamp";
  const std::string inside = "{effect: crosstalk, real: 3000 counts/s}";
  const auto expect_taps = [&](const std::string& effects, const std::array<double, 8>& wanted) {
    const std::vector<double> taps = expected(effects, view).taps;
    const std::size_t n = view.pixels.size();
    ASSERT_EQ(taps.size(), 8 * n);
    for (std::size_t i = 0; i < taps.size(); ++i) EXPECT_NEAR(taps[i], wanted[i / n], 1e-5) << effects << " " << i / n;
  };
  const std::array<double, 8> dark = {9, 3, 6, 6, 3, 9, 6, 6};  // A, B of each image
  expect_taps(inside, dark);
  // 100 counts per millisecond on each tap, for 2 ms: the mean of the taps is 206.
  const std::string lit = inside + ", {effect: ambient_light, rate: 2e5 counts/s, suppression: ";
  expect_taps(lit + "none}", {209, 203, 206, 206, 203, 209, 206, 206});
  expect_taps(lit + "150 counts}", {153, 147, 150, 150, 147, 153, 150, 150});
  expect_taps(lit + "207 counts}", {209, 203, 206, 206, 203, 209, 206, 206});
  expect_taps(lit + "2 counts}", {5, -1, 2, 2, -1, 5, 2, 2});
  view.acquisition.condition.flags |= TOFGRAPH_CONDITION_LENS_CAPPED;
  expect_taps(lit + "150 counts}", dark);
}

/// Writes an image of random numbers.
std::vector<double> write_map(const std::filesystem::path& file, const char* dataset, double size,
                              hsize_t columns = 204) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, size);
  std::vector<double> values(204 * columns);
  for (double& value : values) value = normal(random);
  const hid_t opened = std::filesystem::exists(file) ? H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT)
                                                     : H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hsize_t extent[] = {204, columns};
  const hid_t space = H5Screate_simple(2, extent, nullptr);
  const hid_t data = H5Dcreate2(opened, dataset, H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  H5Dclose(data);
  H5Sclose(space);
  H5Fclose(opened);
  return values;
}

TEST(FixedPattern, TurnsEachPixelByItsMap) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "maps.h5";
  const auto offsets = write_map(file, "offsets", 5e-3), slopes = write_map(file, "slopes", 1e-3);
  View view;
  view.pixels = whole_image(camcube());
  view.board = {3, 0, 0, 0.8};
  const std::string path = "{file: " + file.string() + ", dataset: ";
  const auto ideal = seen("", view),
             real = seen("{effect: fixed_pattern, scale: 2, map: " + path + "offsets}, slope_map: " + path + "slopes}}",
                         view);
  for (std::size_t i = 0; i < ideal.size(); i += 7) {
    const double distance =
        ideal[i].phase() < 0 ? (ideal[i].phase() + 2 * pi) * metres_per_radian : ideal[i].phase() * metres_per_radian;
    const double error = 2 * (offsets[i] + slopes[i] * (distance - 2));
    EXPECT_NEAR(turned(real[i], ideal[i]) * metres_per_radian, error, 1e-7);
  }
}

TEST(PixelResponse, ScalesAndDarkensTaps) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "maps.h5";
  const auto gains = write_map(file, "gains", 0.02), dark = write_map(file, "dark", 4),
             rate = write_map(file, "rate", 100);
  View view;
  view.pixels = whole_image(camcube());
  const auto part = [&](const char* dataset) { return "{file: " + file.string() + ", dataset: " + dataset + "}"; };
  const auto ideal = expected("", view).taps,
             real = expected("{effect: pixel_response, scale: 1, map: " + part("gains") +
                                 ", dark_map: " + part("dark") + ", dark_rate_map: " + part("rate") + "}",
                             view)
                        .taps;
  const std::size_t n = view.pixels.size();
  for (std::size_t i = 0; i < ideal.size(); i += 13) {
    const std::size_t p = i % n;
    EXPECT_NEAR(real[i], ideal[i] * (1 + gains[p]) + dark[p] + rate[p] * 2e-3, 1e-6);
  }
}

TEST(Maps, ThatDoNotFitAreRefused) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "maps.h5";
  write_map(file, "small", 1, 100);
  const auto problem = [&](const std::string& list) {
    try {
      effects(list, camcube());
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  const std::string named = "{effect: fixed_pattern, scale: 1, map: {file: " + file.string() + ", dataset: ";
  EXPECT_NE(problem(named + "small}}").find("is 100 x 204 px, the camera camcube2 has 204 x 204"), std::string::npos)
      << problem(named + "small}}");
  EXPECT_NE(problem(named + "absent}}").find("no dataset 'absent'"), std::string::npos) << problem(named + "absent}}");
  EXPECT_NE(problem("{effect: fixed_pattern, scale: 1}").find("without a map"), std::string::npos);
}

}  // namespace
