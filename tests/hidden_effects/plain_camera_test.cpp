// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: PlainCamera.PhaseSteps*:PlainCamera.TurnsOf*
// Rooms: diagnosis simulation
// The plain camera, compared with published numbers and closed forms (equations.md, effects.md section 2).
#include "tests/hidden_effects/plain_camera.hpp"

#include "tests/hidden_effects/plain_geometry.hpp"
#include "tests/unit/thesis_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

namespace tofgraph::hidden {
namespace {

/// Decoded samples of a pixel.
struct Decoded {
  double phase, amplitude, intensity, null1, null2;
};

Decoded decoded(const Taps& taps, std::size_t i) {
  std::array<double, 4> c{};
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    c[k] = taps.a[k][i] - taps.b[k][i];
    sum += taps.a[k][i] + taps.b[k][i];
  }
  return {std::atan2(c[3] - c[1], c[0] - c[2]), std::hypot(c[3] - c[1], c[0] - c[2]) / 2, sum / 8,
          (c[0] + c[1] + c[2] + c[3]) / 4, (c[0] - c[1] + c[2] - c[3]) / 4};
}

View board(double distance, double integration_time = 2e-3) {
  View view;
  view.distance = distance;
  view.integration_time = integration_time;
  return view;
}

Physics with(const std::string& effect, Light light = Light::reference) {
  Physics physics;
  physics.light = light;
  if (!effect.empty()) physics.effects.add_text(effect, 1, 1);
  return physics;
}

/// Calls check(ideal, changed) for pixels across the image, for boards over a full cycle of 1.87 m.
template <class Check> void for_some_pixels(const std::string& effect, const Check& check) {
  for (const double z : {0.7, 1.1, 1.9, 2.6}) {
    const Taps ideal = expected_taps(with(""), board(z)), changed = expected_taps(with(effect), board(z));
    for (std::size_t i = 0; i < ideal.a[0].size(); i += 977) check(decoded(ideal, i), decoded(changed, i));
  }
}

double turned(double phase, double by) { return std::remainder(phase - by, 2 * M_PI); }

TEST(PlainCamera, SeesThePublishedDistances) {
  const Camera camera;
  for (const test::ModelledBoard& published : test::modelled_boards()) {
    const Taps taps = expected_taps(with(""), board(published.depth));
    const double near = published.mean / camera.metres_per_radian();  // beyond 7.49 m the phase wraps
    const test::Statistics seen =
        test::over_window(published.half_width, published.half_height, [&](std::size_t row, std::size_t column) {
          return camera.metres_per_radian() * (near + turned(decoded(taps, row * 204 + column).phase, near));
        });
    EXPECT_NEAR(seen.mean, published.mean, 0.005e-3) << published.depth;
    EXPECT_NEAR(seen.deviation, published.deviation, 0.007e-3) << published.depth;
  }
}

TEST(PlainCamera, LightOfBothForms) {
  const Camera camera;
  const std::size_t center = 102 * 204 + 102;
  const double z = 1.0, off = std::hypot(0.05, z), path = off + z;  // near the axis, source 50 mm beside it
  const Taps reference = expected_taps(with(""), board(z)),
             physical = expected_taps(with("", Light::physical), board(z));
  const double light = camera.gain * 0.85 * 2e-3;
  EXPECT_NEAR(decoded(reference, center).amplitude, light / (path * path), 1e-4 * light);
  EXPECT_NEAR(decoded(physical, center).amplitude, light * (z / off) / (4 * off * off), 1e-4 * light);
  EXPECT_NEAR(decoded(reference, center).intensity, decoded(reference, center).amplitude,
              1e-9 * light);  // contrast 0.5
  View left = board(z);
  left.on = {true, false};
  EXPECT_NEAR(decoded(expected_taps(with(""), left), center).amplitude, light / (path * path) / 2, 1e-4 * light);
}

TEST(PlainCamera, WigglingTurnsByTheClosedForm) {
  const double m = 5e-3 / Camera().metres_per_radian();
  for_some_pixels("wiggling:amplitude=5mm,phase=0.4rad", [&](const Decoded& ideal, const Decoded& seen) {
    const std::complex<double> factor = 1.0 + std::polar(m, -(4 * ideal.phase + 0.4));
    EXPECT_NEAR(turned(seen.phase, ideal.phase), std::arg(factor), 1e-12);
    EXPECT_NEAR(seen.amplitude, ideal.amplitude * std::abs(factor), 1e-9 * ideal.amplitude);
  });
  for_some_pixels("wiggling:amplitude5=5mm,phase5=0.4rad", [&](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(turned(seen.phase, ideal.phase), std::arg(1.0 + std::polar(m, 4 * ideal.phase + 0.4)), 1e-12);
  });
}

TEST(PlainCamera, EvenHarmonicShowsInN2Alone) {
  for_some_pixels("even_harmonic:ratio=0.02", [](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(turned(seen.phase, ideal.phase), 0, 1e-12);
    EXPECT_NEAR(seen.null2, ideal.amplitude * 0.02 * std::cos(2 * ideal.phase), 1e-9 * ideal.amplitude);
    EXPECT_NEAR(seen.null1, 0, 1e-9 * ideal.amplitude);
  });
}

TEST(PlainCamera, PhaseStepsAndGainsToFirstOrder) {
  const double d = 1e-5, tolerance = 1e-9;
  for_some_pixels("phase_step_error:step1=0.01mrad", [&](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(turned(seen.phase, ideal.phase), d / 4 + d / 4 * std::cos(2 * ideal.phase), tolerance);
  });
  for_some_pixels("phase_step_error:step2=0.01mrad", [&](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(turned(seen.phase, ideal.phase), d / 4 - d / 4 * std::cos(2 * ideal.phase), tolerance);
  });
  for_some_pixels("phase_gain:gain3=10ppm", [&](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(turned(seen.phase, ideal.phase), d / 4 * std::sin(2 * ideal.phase), tolerance);
    EXPECT_NEAR(seen.intensity / ideal.intensity, 1 + d / 4, tolerance);
  });
}

TEST(PlainCamera, TapMismatchShowsInN1Alone) {
  for_some_pixels("tap_mismatch:ratio=0.02", [](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(turned(seen.phase, ideal.phase), 0, 1e-12);
    EXPECT_NEAR(seen.null1, 0.02 * ideal.intensity, 1e-9 * ideal.intensity);
  });
}

TEST(PlainCamera, MultipathTurnsByTheClosedForm) {
  const double delta = 2 * M_PI * 20e6 * 0.5 / speed_of_light;
  for_some_pixels("multipath:strength=3%,extra_path=0.5m", [&](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(turned(seen.phase, ideal.phase), std::atan2(0.03 * std::sin(delta), 1 + 0.03 * std::cos(delta)), 1e-12);
    EXPECT_NEAR(seen.intensity, 1.03 * ideal.intensity, 1e-9 * ideal.intensity);
  });
}

TEST(PlainCamera, RailReflectionOnTheAxis) {
  const std::size_t center = 102 * 204 + 102;
  const double z = 2, dl = std::sqrt(z * z + 0.64) - z, delta = 2 * M_PI * 20e6 * dl / speed_of_light;
  const Decoded ideal = decoded(expected_taps(with(""), board(z)), center);
  const Decoded seen = decoded(expected_taps(with("rail_reflection:strength=3%,height=0.4m"), board(z)), center);
  EXPECT_NEAR(turned(seen.phase, ideal.phase), std::atan2(0.03 * std::sin(delta), 1 + 0.03 * std::cos(delta)), 2e-5);
  EXPECT_NEAR(seen.intensity, 1.03 * ideal.intensity, 1e-9 * ideal.intensity);
}

TEST(PlainCamera, CappedLensShowsTheCrosstalk) {
  View view = board(2, 10e-3);
  view.capped = true;
  const Decoded seen = decoded(expected_taps(with("crosstalk:real=1500counts/s,imaginary=800counts/s"), view), 7);
  EXPECT_NEAR(seen.phase, std::atan2(800, 1500), 1e-12);
  EXPECT_NEAR(seen.amplitude, 17, 1e-9);  // 10 ms x hypot(1500, 800)
  EXPECT_NEAR(seen.intensity, 17, 1e-9);
}

TEST(PlainCamera, SourcePhase) {
  const Physics changed = with("source_phase:difference=50mrad");
  View view = board(1.5);
  const std::size_t pixel = 60 * 204 + 30;
  for (const auto& [on, turn] : {std::pair{std::array{true, false}, -0.025}, {std::array{false, true}, 0.025}}) {
    view.on = on;
    const Decoded ideal = decoded(expected_taps(with(""), view), pixel),
                  seen = decoded(expected_taps(changed, view), pixel);
    EXPECT_NEAR(turned(seen.phase, ideal.phase), turn, 1e-12);
  }
}

TEST(PlainCamera, TurnsOfThePhase) {
  const double k = Camera().metres_per_radian();
  for_some_pixels("integration_time_offset:slope=8mm", [&](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(k * turned(seen.phase, ideal.phase), 8e-3 * std::log(2.0), 1e-12);
  });
  for_some_pixels("integration_time_offset:slope=8mm,exponent=0.3", [&](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(k * turned(seen.phase, ideal.phase), 8e-3 * (std::pow(2.0, 0.3) - 1) / 0.3, 1e-12);
  });
  for_some_pixels("integration_time_offset:linear=0.4m/s", [&](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(k * turned(seen.phase, ideal.phase), 0.4 * (2e-3 - 1e-3), 1e-12);
  });
  for_some_pixels("amplitude_walk:logarithmic=8mrad,inverse=3mrad", [&](const Decoded& ideal, const Decoded& seen) {
    const double relative = ideal.amplitude / 1000;
    EXPECT_NEAR(turned(seen.phase, ideal.phase), 8e-3 * std::log(relative) + 3e-3 / relative, 1e-12);
  });
  for_some_pixels("warm_up:drift=10mm,droop=3%", [&](const Decoded& ideal, const Decoded& seen) {
    EXPECT_NEAR(k * turned(seen.phase, ideal.phase), 10e-3, 1e-12);  // an unknown time: warmed up
    EXPECT_NEAR(seen.intensity, 0.97 * ideal.intensity, 1e-9 * ideal.intensity);
  });
}

TEST(PlainCamera, WarmsUpInTwoTimes) {
  View early = board(1.1);
  early.time_since_power_on = 600;
  const double drift = std::sqrt(2.0) *  // for 2 ms relative to 1 ms
                       (10e-3 * (1 - std::exp(-600.0 / 720)) + 3e-3 * (1 - std::exp(-600.0 / 7200)));
  const Taps ideal = expected_taps(with(""), early);
  const Taps seen =
      expected_taps(with("warm_up:drift=10mm,time_constant=720s,slow_drift=3mm,slow_time_constant=7200s,exponent=0.5,"
                         "reference_time=1ms"),
                    early);
  for (std::size_t i = 0; i < ideal.a[0].size(); i += 977)
    EXPECT_NEAR(Camera().metres_per_radian() * turned(decoded(seen, i).phase, decoded(ideal, i).phase), drift, 1e-12);
}

TEST(PlainCamera, QuadraticConverterOnlyCompresses) {
  const Physics physics = with("adc_nonlinearity:quadratic=3%");
  Readout readout(physics, NoiseKind::none);
  std::mt19937_64 unused;
  Taps taps = expected_taps(physics, board(0.7));
  const Decoded ideal = decoded(taps, 5000);
  for (std::size_t k = 0; k < 4; ++k)
    for (std::vector<Image>* tap : {&taps.a, &taps.b}) (*tap)[k][5000] = readout((*tap)[k][5000], unused);
  const Decoded seen = decoded(taps, 5000);
  EXPECT_NEAR(turned(seen.phase, ideal.phase), 0, 1e-12);
  EXPECT_NEAR(seen.amplitude, ideal.amplitude * (1 - 0.03 * 2 * ideal.intensity / 30000), 1e-6);
}

TEST(PlainCamera, MotionIsStepsOfPhaseAndLight) {
  // c_k of a board at Z + k d: phase increases by k d / K, light decreases by 2 k d / Z.
  const double z = 5, d = 1e-4, k = Camera().metres_per_radian();
  const std::size_t center = 102 * 204 + 102;
  const Taps taps = expected_taps(with("motion:displacement=0.1mm"), board(z)),
             still = expected_taps(with(""), board(z));
  const Decoded ideal = decoded(still, center);
  for (std::size_t i = 0; i < 4; ++i) {
    const double n = static_cast<double>(i), a = ideal.amplitude * (1 - 2 * n * d / z);
    EXPECT_NEAR(taps.a[i][center] - taps.b[i][center], a * std::cos(ideal.phase + n * (M_PI / 2 + d / k)),
                2e-7 * ideal.amplitude);
  }
}

TEST(PlainCamera, StrayLightWithoutWidthIsTheMean) {
  const SensorLight ideal = light_on_sensor(with(""), board(1), 0);
  const SensorLight seen = light_on_sensor(with("stray_light:fraction=3%,uniform=1,width=35px"), board(1), 0);
  std::complex<double> mean{};
  for (const auto& phasor : ideal.phasor) mean += phasor / static_cast<double>(ideal.phasor.size());
  EXPECT_NEAR(std::abs(seen.phasor[4711] - ideal.phasor[4711] - 0.03 * mean), 0, 1e-9 * std::abs(mean));
}

TEST(PlainCamera, RaysGoBackToTheirPixels) {
  Physics physics = with("lens_distortion:k1=-0.44,k2=0.2,p1=0.002,p2=-0.005,k3=0");
  physics.effects.add("principal_point", {{"x", 1.2}, {"y", -2}});
  const std::vector<Ray> rays = rays_of(physics);
  for (const int pixel : {0, 203, 20808, 41615}) {
    const Vector u = rays[static_cast<std::size_t>(pixel)].direction;
    const double x = u.x / u.z, y = u.y / u.z, r2 = x * x + y * y, radial = 1 - 0.44 * r2 + 0.2 * r2 * r2;
    const double seen_x = x * radial + 2 * 0.002 * x * y - 0.005 * (r2 + 2 * x * x);
    const double seen_y = y * radial + 0.002 * (r2 + 2 * y * y) - 2 * 0.005 * x * y;
    EXPECT_NEAR(seen_x * 320 + 102.7, pixel % 204, 1e-9);  // 12.8 mm / 40 um = 320 px
    EXPECT_NEAR(seen_y * 320 + 99.5, pixel / 204, 1e-9);
  }
}

TEST(PlainCamera, NoiseHasThePublishedSize) {
  const Physics physics;
  const Camera camera;
  const Taps taps = expected_taps(physics, board(2));
  const std::size_t pixel = 9000;
  const Decoded ideal = decoded(taps, pixel);
  for (const NoiseKind kind : {NoiseKind::gaussian, NoiseKind::heavy}) {
    Readout readout(physics, kind);
    std::mt19937_64 random(4);
    double squares = 0;
    const int repeats = 40000;
    for (int i = 0; i < repeats; ++i) {
      std::array<double, 4> c{};
      for (std::size_t k = 0; k < 4; ++k) c[k] = readout(taps.a[k][pixel], random) - readout(taps.b[k][pixel], random);
      squares += std::pow(turned(std::atan2(c[3] - c[1], c[0] - c[2]), ideal.phase), 2);
    }
    // equations.md, section 2: s / (sqrt(2) a), with s of a difference of two taps of mean I.
    const double s = std::sqrt(2 * (9 + 0.012 * ideal.intensity));
    EXPECT_NEAR(std::sqrt(squares / repeats) / (s / (std::sqrt(2.0) * ideal.amplitude)), 1,
                kind == NoiseKind::gaussian ? 0.02 : 0.1);
  }
}

}  // namespace
}  // namespace tofgraph::hidden
