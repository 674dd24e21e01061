// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The forward model, compared with explicit sums, and its noise, compared with its formula.
#include <gtest/gtest.h>

#include "io/profile.hpp"
#include "simulation/board.hpp"
#include "simulation/frames.hpp"

#include <array>
#include <cmath>
#include <complex>

using namespace tofgraph;
using namespace tofgraph::simulation;

namespace {

constexpr double c_light = 299792458.0, pi = 3.14159265358979323846;

const tofgraph_camera& camcube2() {
  static const auto camera = io::load_profile(io::find_profile("camcube2", {}));
  return camera->view();
}

/// The parameters of the nominal CamCube 2.0, repeated independently.
struct Plain {
  double f = 12.8e-3, pitch = 40e-6, centre = 101.5, frequency = 20e6, gain = 7e6, contrast = 0.5, half_base = 0.05;
};

struct Point {
  double x, y, z;
};

double length(Point a, Point b) { return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z); }

/// c_k and the mean of the taps of a single pixel that sees a tilted board, summed source by source.
struct Sum {
  std::array<double, 4> samples{};
  double intensity = 0;
};
Sum brute_force(double u, double v, const BoardPose& board, double integration_time, bool physical,
                std::array<bool, 2> on) {
  const Plain p;
  const double xs = (u - p.centre) * p.pitch, ys = (v - p.centre) * p.pitch, sensor = std::hypot(xs, ys, p.f);
  // R_y(b) R_x(a) e_z
  const double a = board.tilt_x, b = board.tilt_y;
  const Point n{std::sin(b) * std::cos(a), -std::sin(a), std::cos(b) * std::cos(a)};
  // The ray (0, 0, f) + s (xs, ys, f) meets n . (P - (0, 0, Z)) = 0.
  const double s = n.z * (board.distance - p.f) / (n.x * xs + n.y * ys + n.z * p.f);
  const Point point{s * xs, s * ys, p.f + s * p.f};
  const double return_path = s * sensor;
  const Point sources[2] = {{-p.half_base, 0, 0}, {p.half_base, 0, 0}};
  double mean = 0, count = 0;
  for (int i = 0; i < 2; ++i) {
    if (!on[i]) continue;
    mean += length(sources[i], point);
    ++count;
  }
  const double travelled = mean / count + return_path + sensor;
  std::complex<double> phasor;
  double strengths = 0;
  for (int i = 0; i < 2; ++i) {
    if (!on[i]) continue;
    const double path = length(sources[i], point);
    double strength = 0.5 * p.gain * board.reflectivity * integration_time / (travelled * travelled);
    if (physical) {
      const double incidence = (n.x * (point.x - sources[i].x) + n.y * (point.y - sources[i].y) + n.z * point.z) / path;
      const double view = p.f / sensor;
      strength =
          0.5 * p.gain * board.reflectivity * integration_time * incidence / (4 * path * path) * std::pow(view, 4);
    }
    phasor +=
        strength * std::exp(std::complex<double>(0, 2 * pi * p.frequency / c_light * (path + return_path + sensor)));
    strengths += strength;
  }
  Sum sum;
  for (int k = 0; k < 4; ++k) sum.samples[k] = std::abs(phasor) * std::cos(std::arg(phasor) + k * pi / 2);
  sum.intensity = strengths / (2 * p.contrast);
  return sum;
}

void expect_brute_force(bool physical, std::array<bool, 2> on) {
  const BoardPose board{0.8, 0.2, -0.3, 0.6};
  const ForwardModel model(camcube2(), physical, {});
  const Pixels pixels = whole_image(camcube2());
  Acquisition acquisition = acquisition_of(camcube2(), 2e-3);
  acquisition.on = {on[0], on[1]};
  const Expectation expectation = model.expect(board_tracer(camcube2().focal_length, board), acquisition, pixels);
  const std::size_t n = pixels.size();
  for (std::size_t i = 0; i < n; i += 137) {
    const Sum sum = brute_force(static_cast<double>(i % 204), static_cast<double>(i / 204), board, 2e-3, physical, on);
    for (std::size_t k = 0; k < 4; ++k) {
      const double a = expectation.taps[2 * k * n + i], b = expectation.taps[(2 * k + 1) * n + i];
      ASSERT_NEAR(a - b, sum.samples[k], 1e-9 * sum.intensity) << i;
      ASSERT_NEAR((a + b) / 2, sum.intensity, 1e-9 * sum.intensity) << i;
    }
  }
}

TEST(ForwardModel, ReferenceLightIsTheSumOverSources) {
  expect_brute_force(false, {true, true});
  expect_brute_force(false, {true, false});
}

TEST(ForwardModel, PhysicalLightIsTheSumOverSources) {
  expect_brute_force(true, {true, true});
  expect_brute_force(true, {false, true});
}

TEST(ForwardModel, OneOfTwoSourcesGivesHalfTheLightAndInterferenceIsSmall) {
  const ForwardModel model(camcube2(), false, {});
  const Pixels pixels = whole_image(camcube2());
  const Tracer board = board_tracer(camcube2().focal_length, {0.5, 0, 0, 0.85});
  const auto amplitude = [&](std::vector<bool> on) {
    Acquisition acquisition = acquisition_of(camcube2(), 1e-3);
    acquisition.on = std::move(on);
    const auto taps = model.expect(board, acquisition, pixels).taps;
    std::vector<double> result;
    const std::size_t n = pixels.size();
    for (std::size_t i = 0; i < n; ++i)
      result.push_back(std::hypot(taps[i] - taps[n + i], taps[2 * n + i] - taps[3 * n + i]));
    return result;
  };
  const auto both = amplitude({true, true}), left = amplitude({true, false}), right = amplitude({false, true});
  double worst = 0;
  for (std::size_t i = 0; i < both.size(); ++i) {
    worst = std::max(worst, 1 - both[i] / (left[i] + right[i]));
    EXPECT_NEAR(left[i] / both[i], 0.5, 0.06);  // D_t of one source differs from the mean of both
  }
  // equations.md section 4: |sum| is 2 A cos(w (D_1 - D_2) / (2 c)); at 500 mm the loss is below 0.002 of it.
  EXPECT_LT(worst, 0.002);
  EXPECT_GT(worst, 1e-6);
}

TEST(ForwardModel, ADeepEdgePixelIsTheMeanOfItsRays) {
  // The left half of the scene is at 1 m, the right half at 2 m; the edge cuts pixel 101 at a quarter.
  const double f = camcube2().focal_length, edge = (101 - 0.5 + 0.25 - 101.5) * 40e-6 / f;
  const Tracer near_side = board_tracer(f, {1, 0, 0, 0.8}), far_side = board_tracer(f, {2, 0, 0, 0.8});
  const Tracer scene = [&](const BoardChange& change, std::span<const Vector3> rays, std::span<Hit> hits) {
    std::vector<Hit> other(rays.size());
    near_side(change, rays, hits);
    far_side(change, rays, other);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (rays[i].x / rays[i].z < edge) continue;
      hits[i] = other[i];
      hits[i].object = 1;
    }
  };
  const ForwardModel model(camcube2(), false, {}, 8), plain(camcube2(), false, {}, 1);
  const Pixels pixels = whole_image(camcube2());
  const Acquisition acquisition = acquisition_of(camcube2(), 1e-3);
  const auto mixed = model.expect(scene, acquisition, pixels).taps;
  const auto first = plain.expect(near_side, acquisition, pixels).taps,
             second = plain.expect(far_side, acquisition, pixels).taps;
  const std::size_t i = 90 * 204 + 101;
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t at = k * pixels.size() + i;
    // 2 of 8 columns of rays are on the near side; within a pixel the light of a board is constant to 1e-3.
    EXPECT_NEAR(mixed[at], 0.25 * first[at] + 0.75 * second[at], 2e-3 * first[at]);
    EXPECT_EQ(mixed[at - 20], plain.expect(scene, acquisition, pixels).taps[at - 20]) << "elsewhere nothing changes";
  }
}

TEST(ForwardModel, AMovingBoardIsSeenElsewhereInEachExposure) {
  const BoardPose still{1.2, 0, 0, 0.85};
  BoardPose moving = still;
  moving.velocity = 0.4;
  const ForwardModel model(camcube2(), false, {});
  const Pixels pixels = superpixels(camcube2(), 12, 12);
  Acquisition acquisition = acquisition_of(camcube2(), 1e-3);
  acquisition.moving = true;
  const double f = camcube2().focal_length;
  const auto taps = model.expect(board_tracer(f, moving), acquisition, pixels).taps;
  acquisition.moving = false;
  const std::size_t n = pixels.size();
  for (std::size_t k = 0; k < 4; ++k) {
    BoardPose there = still;
    there.distance += 0.4 * static_cast<double>(k) / (4 * 80.0);  // 80 frames/s, four images a frame
    const auto alone = model.expect(board_tracer(f, there), acquisition, pixels).taps;
    for (std::size_t i = 0; i < 2 * n; ++i) EXPECT_NEAR(taps[2 * k * n + i], alone[2 * k * n + i], 1e-9 * alone[i]);
  }
}

TEST(ForwardModel, AMovingSceneNeedsTheFrameRate) {
  tofgraph_camera camera = camcube2();
  camera.frame_rate = std::nan("");
  BoardPose board{1.2, 0, 0, 0.85};
  board.velocity = 0.4;
  const Tracer tracer = board_tracer(camera.focal_length, board);
  const ForwardModel model(camera, false, {});
  const Pixels pixels = superpixels(camera, 3, 3);
  Acquisition acquisition = acquisition_of(camera, 1e-3);
  EXPECT_NO_THROW(model.expect(tracer, acquisition, pixels));
  acquisition.moving = true;
  EXPECT_THROW(model.expect(tracer, acquisition, pixels), std::invalid_argument);
}

TEST(ForwardModel, AThousandFramesHaveTheFormulasNoise) {
  const ForwardModel model(camcube2(), false, {});
  const Pixels pixels = superpixels(camcube2(), 12, 12);
  const std::size_t n = pixels.size();
  const physics::TapNoise noise{3, 0.012};
  double last_shot = 0;
  for (const double integration_time : {1e-3, 4e-3}) {
    const Acquisition acquisition = acquisition_of(camcube2(), integration_time);
    const BoardPose board{1.5, 0, 0, 0.85};
    const Frames frames(model, board_tracer(camcube2().focal_length, board), acquisition, pixels, noise, {5, 0});
    std::vector<double> sum(n), squares(n);
    std::vector<float> distance(n), amplitude(n);
    for (std::uint64_t frame = 0; frame < 1000; ++frame) {
      frames.distance(frame, distance.data(), amplitude.data());
      for (std::size_t i = 0; i < n; ++i) {
        sum[i] += distance[i];
        squares[i] += double{distance[i]} * distance[i];
      }
    }
    double ratio = 0, shot_variance = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Sum clean =
          brute_force(pixels.at[2 * i], pixels.at[2 * i + 1], board, integration_time, false, {true, true});
      const double a = std::hypot(clean.samples[0], clean.samples[1]);
      // c/(4 pi f) s/(sqrt(2) a), s^2 = 2 (read^2 + shot I): the two taps of a sample
      const double s = std::sqrt(2 * (9 + 0.012 * clean.intensity));
      const double sigma = c_light / (4 * pi * 20e6) * s / (std::sqrt(2.0) * a);
      const double variance = (squares[i] - sum[i] * sum[i] / 1000) / 999;
      ratio += std::sqrt(variance) / sigma / static_cast<double>(n);
      shot_variance += variance * a * a / static_cast<double>(n);
    }
    EXPECT_NEAR(ratio, 1, 0.01);  // the mean over 144 pixels; 3 % is required
    // variance a^2 = K^2 (read^2 + shot I): four times the light adds three times the shot term
    if (last_shot > 0) {
      const double k = c_light / (4 * pi * 20e6);
      const double mean_light = 7e6 * 0.85 * 1e-3 / 9.0;
      EXPECT_NEAR((shot_variance - last_shot) / (k * k * 0.012 * 3 * mean_light), 1, 0.1);
    }
    last_shot = shot_variance;
  }
}

TEST(Noise, IsStandardNormalAndIndependent) {
  constexpr std::size_t n = 100003;  // no multiple of any vector length
  const std::vector<float> mean(n, 2.0F), deviation(n, 3.0F);
  std::array<std::vector<float>, 4> out;
  std::array<float*, 4> to{};
  for (std::size_t k = 0; k < 4; ++k) {
    out[k].resize(n);
    to[k] = out[k].data();
  }
  const auto all = [](const std::vector<float>& v) {
    return std::array<const float*, 4>{v.data(), v.data(), v.data(), v.data()};
  };
  add_noise({11, 3, 1}, n, all(mean), all(deviation), to);
  const double error = 5 / std::sqrt(static_cast<double>(n));
  for (std::size_t k = 0; k < 4; ++k) {
    double m1 = 0, m2 = 0, m3 = 0, m4 = 0, beyond = 0, cross = 0, next = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double z = (out[k][i] - 2.0) / 3;
      m1 += z / n;
      m2 += z * z / n;
      m3 += z * z * z / n;
      m4 += z * z * z * z / n;
      beyond += std::abs(z) > 2.5758 ? 1.0 / n : 0;
      cross += z * (out[(k + 1) % 4][i] - 2.0) / 3 / n;
      if (i > 0) next += z * (out[k][i - 1] - 2.0) / 3 / n;
    }
    EXPECT_NEAR(m1, 0, error);
    EXPECT_NEAR(m2, 1, 1.5 * error);
    EXPECT_NEAR(m3, 0, 4 * error);
    EXPECT_NEAR(m4, 3, 10 * error);
    EXPECT_NEAR(beyond, 0.01, 0.002);
    EXPECT_NEAR(cross, 0, error);
    EXPECT_NEAR(next, 0, error);
  }
}

TEST(Frames, PhasesAreThoseOfTheTapsWhereBothAreGivenOut) {
  const ForwardModel model(camcube2(), false, {});
  const Pixels pixels = superpixels(camcube2(), 6, 6);
  const Frames frames(model, board_tracer(camcube2().focal_length, {1, 0, 0, 0.85}), acquisition_of(camcube2(), 1e-3),
                      pixels, {3, 0.012}, {7, 2}, true);
  std::vector<std::uint16_t> taps(8 * 36);
  std::vector<float> phases(4 * 36);
  frames.taps(4, taps.data());
  frames.phases(4, phases.data());
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t i = 0; i < 36; ++i) {
      const auto difference =
          static_cast<double>(taps[2 * k * 36 + i]) - static_cast<double>(taps[(2 * k + 1) * 36 + i]);
      EXPECT_NEAR(phases[k * 36 + i], difference, 1.001);  // each tap is rounded
    }
}

TEST(Frames, TapsAreWholeCountsAndRepeatByNumber) {
  const ForwardModel model(camcube2(), false, {});
  const Pixels pixels = superpixels(camcube2(), 6, 6);
  const Frames frames(model, board_tracer(camcube2().focal_length, {1, 0, 0, 0.85}), acquisition_of(camcube2(), 1e-3),
                      pixels, {3, 0.012}, {7, 2});
  std::vector<std::uint16_t> first(8 * 36), again(8 * 36), other(8 * 36);
  frames.taps(4, first.data());
  frames.taps(4, again.data());
  frames.taps(5, other.data());
  EXPECT_EQ(first, again);
  EXPECT_NE(first, other);
}

TEST(ForwardModel, ACappedLensSeesNothing) {
  const ForwardModel model(camcube2(), false, {});
  Acquisition acquisition = acquisition_of(camcube2(), 1e-3);
  acquisition.condition.flags = TOFGRAPH_CONDITION_LENS_CAPPED;
  const auto taps =
      model.expect(board_tracer(camcube2().focal_length, {}), acquisition, superpixels(camcube2(), 3, 3)).taps;
  for (const double tap : taps) EXPECT_EQ(tap, 0);
}

}  // namespace
