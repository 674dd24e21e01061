// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Effects on geometry and light, compared with closed forms, direct sums, and differently constructed cameras.
#include <gtest/gtest.h>

#include "tests/program.hpp"
#include "tests/unit/effect_fixture.hpp"

using namespace tofgraph;
using namespace tofgraph::test;

namespace {

/// The point seen by a pixel, computed explicitly: x, y, z in the sensor frame, and the board's normal towards z.
struct Place {
  double x, y, z, nx, ny, nz, view;
};
Place place(const View& view, std::size_t i) {
  const double f = 12.8e-3;
  const double xs = (view.pixels.at[2 * i] - 101.5) * 40e-6, ys = (view.pixels.at[2 * i + 1] - 101.5) * 40e-6;
  const double a = view.board.tilt_x, b = view.board.tilt_y;
  const double nx = std::sin(b) * std::cos(a), ny = -std::sin(a), nz = std::cos(b) * std::cos(a);
  const double s = nz * (view.board.distance - f) / (nx * xs + ny * ys + nz * f);
  return {s * xs, s * ys, f + s * f, nx, ny, nz, f / std::hypot(xs, ys, f)};
}

/// Single source: left (x = -50 mm) or right. With physical light a source's contribution does not depend on the other.
View one(View view, bool right) {
  view.acquisition.on = {!right, right};
  return view;
}

/// With the light of each source multiplied by a factor that depends on the pixel.
template <class Factor> void expect_factors(const std::string& list, const View& view, Factor&& factor) {
  for (const bool right : {false, true}) {
    const auto ideal = seen("", one(view, right)), real = seen(list, one(view, right));
    for (std::size_t i = 0; i < ideal.size(); ++i) {
      const double expected = factor(place(view, i), right ? 0.05 : -0.05);
      EXPECT_NEAR(real[i].amplitude() / ideal[i].amplitude(), expected, 1e-6 * (1 + expected)) << i;
      EXPECT_NEAR(real[i].light() / ideal[i].light(), expected, 1e-6 * (1 + expected)) << i;
      EXPECT_NEAR(turned(real[i], ideal[i]), 0, 1e-9);
    }
  }
}

TEST(SourceAmplitude, WeightsTheSources) {
  const View view;
  const auto left = seen("", one(view, false)), right = seen("", one(view, true));
  const auto real = seen("{effect: source_amplitude, ratio: 20 %}", view);
  for (std::size_t i = 0; i < real.size(); ++i) {
    const Complex sum = 0.9 * left[i].phasor() + 1.1 * right[i].phasor();
    EXPECT_LT(std::abs(real[i].phasor() - sum), 1e-9 * std::abs(sum));
  }
}

TEST(SourcePhase, TurnsTheSourcesApart) {
  const View view;
  const auto left = seen("", one(view, false)), right = seen("", one(view, true));
  const auto real = seen("{effect: source_phase, difference: 100 mrad}", view);
  for (std::size_t i = 0; i < real.size(); ++i) {
    const Complex sum = std::polar(1.0, -0.05) * left[i].phasor() + std::polar(1.0, 0.05) * right[i].phasor();
    EXPECT_LT(std::abs(real[i].phasor() - sum), 1e-9 * std::abs(sum));
    EXPECT_NEAR(real[i].light(), left[i].light() + right[i].light(), 1e-9 * real[i].light());
  }
  const auto single = seen("{effect: source_phase, difference: 100 mrad}", one(view, true));
  EXPECT_NEAR(turned(single[5], right[5]) * metres_per_radian, 0.05 * metres_per_radian, 1e-9);
}

TEST(SourcePosition, IsACameraWithItsSourcesElsewhere) {
  View view;
  const auto real = seen("{effect: source_position, separation: 4 mm, shift: 3 mm, depth: -2 mm}", view);
  tofgraph_camera moved = camcube();
  tofgraph_light lights[] = {camcube().lights[0], camcube().lights[1]};
  lights[0].position[0] = -0.050 - 0.004 + 0.003;
  lights[1].position[0] = 0.050 + 0.004 + 0.003;
  for (tofgraph_light& light : lights) light.position[2] = -0.002;
  moved.lights = lights;
  view.camera = &moved;
  const auto expected = seen("", view);
  for (std::size_t i = 0; i < real.size(); ++i)
    EXPECT_LT(std::abs(real[i].phasor() - expected[i].phasor()), 1e-9 * expected[i].amplitude());
}

TEST(LensDistortion, IsACameraWithAnotherLens) {
  View view;
  view.pixels = whole_image(camcube());
  const auto real = seen(
      "{effect: lens_distortion, k1: -0.1, k2: 0.02, p1: 0.001, p2: -0.002, k3: 0.01}, {effect: principal_point, x: "
      "1.5 px, "
      "y: -2 px}",
      view);
  tofgraph_camera other = camcube();
  const double distortion[] = {-0.1, 0.02, 0.001, -0.002, 0.01};
  std::copy(std::begin(distortion), std::end(distortion), other.distortion);
  other.principal_point[0] += 1.5;
  other.principal_point[1] -= 2;
  view.camera = &other;
  view.pixels = whole_image(other);
  const auto expected = seen("", view);
  for (std::size_t i = 0; i < real.size(); i += 17)
    EXPECT_LT(std::abs(real[i].phasor() - expected[i].phasor()), 1e-9 * expected[i].amplitude());
}

TEST(LensDistortion, IsRefusedForALensWithoutItsCoefficients) {
  const std::string k3 = "{effect: lens_distortion, k3: 0.1}";
  EXPECT_NO_THROW(effects(k3, camcube()));
  tofgraph_camera other = camcube();
  for (const unsigned lens : {TOFGRAPH_LENS_FISHEYE + 0U, TOFGRAPH_LENS_RAYS + 0U}) {
    other.lens_model = lens;
    EXPECT_THROW(effects(k3, other), config::ConfigurationError) << lens;
    EXPECT_NO_THROW(effects("{effect: lens_distortion}", other)) << lens;
  }
}

TEST(Rail, MovesTheBoardUnlessALaserReadIt) {
  View view;
  const std::string list =
      "{effect: rail_scale, scale: 0.2 %}, {effect: rail_offset, offset: 5 mm}, {effect: board_tilt, x: 5 mrad, y: -3 "
      "mrad}";
  for (const bool laser : {false, true}) {
    view.acquisition.condition.flags = laser ? TOFGRAPH_CONDITION_LASER : 0;
    const auto real = seen(list, view);
    View there = view;
    if (!laser) there.board.distance = 1.002 * there.board.distance + 0.005;
    // The effect rotates the board in its current pose: R_y(-0.003) R_x(0.005) n.
    const Vector3 n = physics::board(1, there.board.tilt_x, there.board.tilt_y).normal;
    const double y = std::cos(0.005) * n.y - std::sin(0.005) * n.z, z = std::sin(0.005) * n.y + std::cos(0.005) * n.z;
    const Vector3 turned{std::cos(-0.003) * n.x + std::sin(-0.003) * z, y,
                         -std::sin(-0.003) * n.x + std::cos(-0.003) * z};
    there.board.tilt_x = -std::asin(turned.y);
    there.board.tilt_y = std::atan2(turned.x, turned.z);
    const auto expected = seen("", there);
    for (std::size_t i = 0; i < real.size(); ++i)
      EXPECT_LT(std::abs(real[i].phasor() - expected[i].phasor()), 1e-9 * expected[i].amplitude());
  }
}

TEST(BeamProfile, IsAPowerOfTheAngleAtTheSource) {
  expect_factors("{effect: beam_profile, exponent: 3, toe: 5 deg}", {}, [](const Place& p, double x) {
    const double toe = (x > 0 ? 1 : -1) * 5 * pi / 180;
    const double dx = p.x - x, length = std::hypot(dx, p.y, p.z);
    return std::pow((std::sin(toe) * dx + std::cos(toe) * p.z) / length, 3);
  });
}

TEST(BeamProfile, OfASourceInTheMiddleHasNoToe) {
  View view;
  tofgraph_camera central = camcube();
  tofgraph_light lights[] = {camcube().lights[0], camcube().lights[1]};
  for (tofgraph_light& light : lights) light.position[0] = 0;
  central.lights = lights;
  view.camera = &central;
  const auto straight = seen("{effect: beam_profile, exponent: 3}", view),
             toed = seen("{effect: beam_profile, exponent: 3, toe: 20 deg}", view);
  for (std::size_t i = 0; i < straight.size(); ++i) EXPECT_EQ(toed[i].c, straight[i].c);
}

TEST(Vignetting, IsAPowerOfTheAngleAtTheCamera) {
  expect_factors("{effect: vignetting, exponent: 4}", {}, [](const Place& p, double) { return std::pow(p.view, 4); });
}

TEST(SurfaceReflectance, IsOrenAndNayarsFormula) {
  // In spherical angles about the normal, as in the paper.
  const auto factor = [](const Place& p, double x) {
    const double s2 = 0.4 * 0.4, a = 1 - 0.5 * s2 / (s2 + 0.33), b = 0.45 * s2 / (s2 + 0.09);
    const double n[] = {-p.nx, -p.ny, -p.nz};
    double l[] = {x - p.x, -p.y, -p.z}, v[] = {-p.x, -p.y, 12.8e-3 - p.z};
    const auto unit = [](double(&w)[3]) {
      const double length = std::hypot(w[0], w[1], w[2]);
      for (double& each : w) each /= length;
    };
    unit(l);
    unit(v);
    const auto dot = [](const double* u, const double* w) { return u[0] * w[0] + u[1] * w[1] + u[2] * w[2]; };
    const double theta_l = std::acos(dot(n, l)), theta_v = std::acos(dot(n, v));
    double tl[3], tv[3];
    for (int i = 0; i < 3; ++i) {
      tl[i] = l[i] - std::cos(theta_l) * n[i];
      tv[i] = v[i] - std::cos(theta_v) * n[i];
    }
    const double cos_phi = dot(tl, tv) / (std::hypot(tl[0], tl[1], tl[2]) * std::hypot(tv[0], tv[1], tv[2]));
    return a + b * std::max(0.0, cos_phi) * std::sin(std::max(theta_l, theta_v)) * std::tan(std::min(theta_l, theta_v));
  };
  View view;
  view.board = {1.3, 0.5, -0.4, 0.6};
  expect_factors("{effect: surface_reflectance, roughness: 0.4 rad}", view, factor);
  view.physical = false;  // the reference light is independent of angles: (1 - l) + l cos(theta_i) f_on
  expect_factors("{effect: surface_reflectance, lambert: 0.7, roughness: 0.4 rad}", view,
                 [&](const Place& p, double x) {
                   const double cosine = (p.nx * (p.x - x) + p.ny * p.y + p.nz * p.z) / std::hypot(p.x - x, p.y, p.z);
                   return 0.3 + 0.7 * cosine * factor(p, x);
                 });
}

TEST(Specular, IsASpotAtTheMirror) {
  View view;
  view.board = {0.8, 0, 0, 0.5};
  expect_factors("{effect: specular, strength: 0.3, exponent: 40}", view, [](const Place& p, double x) {
    double h[3];
    const double light[] = {x - p.x, -p.y, -p.z}, eye[] = {-p.x, -p.y, 12.8e-3 - p.z};
    const double ll = std::hypot(light[0], light[1], light[2]), le = std::hypot(eye[0], eye[1], eye[2]);
    for (int i = 0; i < 3; ++i) h[i] = light[i] / ll + eye[i] / le;
    const double cosine = -h[2] / std::hypot(h[0], h[1], h[2]);
    return 1 + 0.3 / 0.5 * std::pow(cosine, 40);
  });
}

TEST(Multipath, IsOneMorePath) {
  const View view;
  const auto ideal = seen("", view), real = seen("{effect: multipath, strength: 5 %, extra_path: 0.8 m}", view);
  const double delta = 2 * pi * 20e6 * 0.8 / c_light;
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    EXPECT_NEAR(turned(real[i], ideal[i]), std::atan2(0.05 * std::sin(delta), 1 + 0.05 * std::cos(delta)), 1e-9);
    EXPECT_NEAR(real[i].light(), 1.05 * ideal[i].light(), 1e-9 * ideal[i].light());
  }
}

TEST(RailReflection, IsTheSumOverMirroredSources) {
  View view;
  view.board = {1.2, 0, 0, 0.7};
  const auto real = seen("{effect: rail_reflection, strength: 4 %, height: 300 mm}", view);
  const auto left = seen("", one(view, false)), right = seen("", one(view, true));
  for (std::size_t i = 0; i < real.size(); ++i) {
    const Place p = place(view, i);
    const double sensor = 12.8e-3 / p.view, return_path = (p.z - 12.8e-3) / p.view;
    Complex sum = left[i].phasor() + right[i].phasor();
    for (const double x : {-0.05, 0.05}) {
      const double path = std::hypot(p.x - x, p.y - 0.6, p.z) + return_path + sensor;
      sum += 0.04 * (x < 0 ? left : right)[i].amplitude() * std::polar(1.0, 2 * pi * 20e6 / c_light * path);
    }
    EXPECT_LT(std::abs(real[i].phasor() - sum), 1e-9 * std::abs(sum));
  }
  view.acquisition.condition.flags = TOFGRAPH_CONDITION_RAIL_COVERED;
  const auto covered = seen("{effect: rail_reflection, strength: 4 %}", view), bare = seen("", view);
  EXPECT_EQ(covered[40].c, bare[40].c);
}

TEST(Crosstalk, AddsTheSamePhasorEverywhere) {
  View view;
  const auto ideal = seen("", view),
             real = seen("{effect: crosstalk, real: 3000 counts/s, imaginary: -2000 counts/s}", view);
  const Complex added(6, -4);  // in 2 ms
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    EXPECT_LT(std::abs(real[i].phasor() - ideal[i].phasor() - added), 1e-9 * ideal[i].amplitude());
    EXPECT_NEAR(real[i].light() - ideal[i].light(), std::abs(added), 1e-9 * ideal[i].light()) << "contrast 0.5";
  }
  view.acquisition.condition.flags = TOFGRAPH_CONDITION_LENS_CAPPED;
  const auto capped = seen("{effect: crosstalk, real: 3000 counts/s, imaginary: -2000 counts/s}", view);
  EXPECT_LT(std::abs(capped[3].phasor() - added), 1e-12);
}

TEST(StaticReflection, HasThePhaseOfItsPathAndIsGoneWithACappedLens) {
  View view;
  const auto ideal = seen("", view),
             real = seen("{effect: static_reflection, strength: 5000 counts/s, distance: 0.3 m}", view);
  const Complex added = std::polar(10.0, 0.3 / metres_per_radian);  // in 2 ms
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    EXPECT_LT(std::abs(real[i].phasor() - ideal[i].phasor() - added), 1e-9 * ideal[i].amplitude());
    EXPECT_NEAR(real[i].light() - ideal[i].light(), 10, 1e-9 * ideal[i].light()) << "contrast 0.5";
  }
  view.acquisition.condition.flags = TOFGRAPH_CONDITION_LENS_CAPPED;
  EXPECT_LT(std::abs(seen("{effect: static_reflection, strength: 5000 counts/s}", view)[3].phasor()), 1e-12);
}

TEST(PhaseEffects, TurnByTheirFormulas) {
  View view;
  view.board = {4, 0, 0, 0.5};
  view.acquisition.condition.time_since_power_on = 500;
  const auto ideal = seen("", view);
  const auto turn = [&](const std::string& list, std::size_t i) { return turned(seen(list, view)[i], ideal[i]); };
  for (const std::size_t i : {0UL, 66UL, 143UL}) {
    const double a = ideal[i].amplitude(), psi = ideal[i].phase() < 0 ? ideal[i].phase() + 2 * pi : ideal[i].phase();
    EXPECT_NEAR(turn("{effect: amplitude_walk, logarithmic: 8 mrad, inverse: 0.3 mrad}", i),
                8e-3 * std::log(a / 1000) + 0.3e-3 * 1000 / a, 1e-9);
    EXPECT_NEAR(turn("{effect: modulation_frequency, error: 500 ppm}", i), 500e-6 * psi, 1e-8);
    EXPECT_NEAR(turn("{effect: integration_time_offset, linear: 3 m/s}", i), 3 * 1e-3 / metres_per_radian, 1e-12);
    EXPECT_NEAR(turn("{effect: integration_time_offset, slope: 8 mm}", i), 8e-3 * std::log(2.0) / metres_per_radian,
                1e-9);
    EXPECT_NEAR(turn("{effect: warm_up, drift: 10 mm, time_constant: 700 s}", i),
                10e-3 * (1 - std::exp(-500.0 / 700)) / metres_per_radian, 1e-9);
  }
  EXPECT_NEAR(turn("{effect: warm_up, drift: 10 mm, time_constant: 700 s, slow_drift: -4 mm, slow_time_constant: 1 h, "
                   "exponent: 0.5, reference_time: 8 ms}",
                   9),
              (10e-3 * (1 - std::exp(-500.0 / 700)) - 4e-3 * (1 - std::exp(-500.0 / 3600))) * 0.5 / metres_per_radian,
              1e-9)
      << "a quarter of the reference time, to the power of a half";
  const auto drooped = seen("{effect: warm_up, droop: 3 %, time_constant: 700 s}", view);
  EXPECT_NEAR(drooped[9].amplitude() / ideal[9].amplitude(), 1 - 0.03 * (1 - std::exp(-500.0 / 700)), 1e-9);
  view.acquisition.condition.time_since_power_on = std::nan("");
  EXPECT_NEAR(turn("{effect: warm_up, drift: 10 mm}", 9), 10e-3 / metres_per_radian, 1e-9) << "not known: warm";
}

/// A board ends within pixel 101: its centre sees nothing, its right quarter the board.
TEST(PhaseEffects, TakeTheDistanceOfAllLightOfAnEdgePixel) {
  View view;
  view.pixels = whole_image(camcube());
  const double end = (101.25 - 101.5) * 40e-6 / 12.8e-3;
  const Tracer board = board_tracer(camcube().focal_length, {1, 0, 0, 0.8});
  view.tracer = [=](const BoardChange& change, std::span<const Vector3> rays, std::span<Hit> hits) {
    board(change, rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (rays[i].x / rays[i].z < end) hits[i] = Hit{};
    }
  };
  const auto ideal = seen("", view), real = seen("{effect: modulation_frequency, error: 1 %}", view);
  const std::size_t whole = 90 * 204 + 102, cut = whole - 1;
  EXPECT_NEAR(ideal[cut].amplitude() / ideal[whole].amplitude(), 0.25, 1e-3);
  EXPECT_NEAR(turned(real[whole], ideal[whole]), 0.01 * ideal[whole].phase(), 1e-6);
  EXPECT_NEAR(turned(real[cut], ideal[cut]), 0.01 * ideal[cut].phase(), 1e-6);
}

TEST(IntegrationTimeOffset, ReadsATable) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "table.csv";
  tests::write_text(file, "integration_time_ms,offset_mm\n0.5,1\n8,5\n1,3\n");
  const auto offset = [&](double time) {
    View view;
    view.acquisition = acquisition_of(camcube(), time);
    return turned(seen("{effect: integration_time_offset, table: " + file.string() + "}", view)[0], seen("", view)[0]) *
           metres_per_radian * 1e3;
  };
  EXPECT_NEAR(offset(0.1e-3), 1, 1e-6);
  EXPECT_NEAR(offset(1e-3), 3, 1e-6);
  EXPECT_NEAR(offset(2e-3), 3 + 2.0 / 3, 1e-6) << "linear in the logarithm: 2 is a third of the way from 1 to 8";
  EXPECT_NEAR(offset(50e-3), 5, 1e-6);
  tests::write_text(file, "0.5,1\noops\n");
  EXPECT_THROW(offset(1e-3), std::exception);
}

/// Two halves at two distances, so that neighbours matter.
View halves(std::size_t rows, std::size_t columns) {
  View view;
  view.pixels = superpixels(camcube(), rows, columns);
  const Tracer near_board = board_tracer(camcube().focal_length, {1, 0, 0, 0.9}),
               far_board = board_tracer(camcube().focal_length, {2, 0, 0, 0.3});
  view.tracer = [=](const BoardChange& change, std::span<const Vector3> rays, std::span<Hit> hits) {
    std::vector<Hit> other(rays.size());
    near_board(change, rays, hits);
    far_board(change, rays, other);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (rays[i].x + 0.3 * rays[i].y > 0) hits[i] = other[i];
    }
  };
  return view;
}

TEST(StrayLight, IsTheDirectSumOverAllPixels) {
  const View view = halves(17, 23);
  const auto ideal = seen("", view),
             real = seen("{effect: stray_light, fraction: 4 %, width: 30 px, uniform: 0.4}", view);
  const double spacing = view.pixels.spacing, width = 30 / spacing;
  double norm = 0;  // over an infinite line
  for (int i = -200; i <= 200; ++i) norm += std::exp(-i * i / (2 * width * width));
  for (std::size_t i = 0; i < ideal.size(); i += 5) {
    Complex sum, everywhere;
    for (std::size_t j = 0; j < ideal.size(); ++j) {
      const double dx = static_cast<double>(j % 23) - static_cast<double>(i % 23);
      const double dy = static_cast<double>(j / 23) - static_cast<double>(i / 23);
      sum += std::exp(-(dx * dx + dy * dy) / (2 * width * width)) / (norm * norm) * ideal[j].phasor();
      everywhere += ideal[j].phasor() / static_cast<double>(ideal.size());
    }
    const Complex expected = ideal[i].phasor() + 0.04 * (0.6 * sum + 0.4 * everywhere);
    EXPECT_LT(std::abs(real[i].phasor() - expected), 1e-9 * std::abs(expected));
  }
}

TEST(MixedPixels, IsTheDirectSumOverNeighbours) {
  View view = halves(20, 20);
  view.pixels.spacing = 1.5;  // an image of larger pixels
  const auto ideal = seen("", view), real = seen("{effect: mixed_pixels, blur: 1.2 px}", view);
  const double width = 1.2 / 1.5;
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    Complex sum;
    double weights = 0;
    for (std::size_t j = 0; j < ideal.size(); ++j) {
      const double dx = static_cast<double>(j % 20) - static_cast<double>(i % 20);
      const double dy = static_cast<double>(j / 20) - static_cast<double>(i / 20);
      const double weight = std::exp(-(dx * dx + dy * dy) / (2 * width * width));
      sum += weight * ideal[j].phasor();
      weights += weight;
    }
    EXPECT_LT(std::abs(real[i].phasor() - sum / weights), 1e-9 * ideal[i].amplitude());
  }
  const View coarse = halves(12, 12);
  EXPECT_EQ(seen("{effect: mixed_pixels, blur: 0.7 px}", coarse)[70].c, seen("", coarse)[70].c) << "17 px apart";
}

}  // namespace
