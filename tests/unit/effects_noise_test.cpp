// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Noise.OfAll*:TemporalNoise.MultipliesThe*
// Rooms: io simulation
// Noise of frames: for arbitrary exposures, and with the effect that changes it.
#include <gtest/gtest.h>

#include <sstream>

#include "io/captures/capture.hpp"
#include "simulation/frames.hpp"
#include "tests/program.hpp"
#include "tests/unit/effect_exposures.hpp"
#include "tests/unit/effect_fixture.hpp"

using namespace tofgraph;
using namespace tofgraph::test;

namespace {

/// Equal steps at one frequency.
Exposures equal_steps(std::size_t count) {
  std::vector<double> angles(count);
  for (std::size_t k = 0; k < count; ++k) angles[k] = 360.0 * static_cast<double>(k) / static_cast<double>(count);
  return steps(angles);
}

using Images = std::vector<std::vector<double>>;

/// Images that should be standard normal and mutually independent.
void expect_standard(const Images& images) {
  const auto n = static_cast<double>(images[0].size()), five_sigma = 5 / std::sqrt(n);
  for (std::size_t a = 0; a < images.size(); ++a) {
    double sum = 0;
    for (const double z : images[a]) sum += z;
    EXPECT_NEAR(sum / n, 0, five_sigma) << a;
    for (std::size_t b = 0; b <= a; ++b) {
      double product = 0;
      for (std::size_t i = 0; i < images[a].size(); ++i) product += images[a][i] * images[b][i];
      if (a == b)
        EXPECT_NEAR(product / n, 1, five_sigma * std::sqrt(2.0)) << a;
      else
        EXPECT_NEAR(product / n, 0, five_sigma) << a << " and " << b;
    }
  }
}

TEST(Noise, OfAllImagesIsIndependentAndAsGreatAsItShouldBe) {
  constexpr double read = 3, shot_noise = 0.012, factor = 2;
  for (const std::size_t count : {3, 5, 9, 32}) {
    SCOPED_TRACE(count);
    const ExposedCamera camera(equal_steps(count));
    const View view = view_of(camera);
    const Pixels all = whole_image(camera.view());
    const std::size_t n = all.size();
    const ForwardModel model(camera.view(), true, effects("{effect: temporal_noise, factor: 2}", camera.view()));
    const std::vector<double> mean = model.expect(view.tracer, view.acquisition, all).taps;
    const auto variance = [&](std::size_t at) { return factor * factor * (read * read + shot_noise * mean[at]); };
    Images by_samples, by_taps, whole;
    for (const std::uint32_t condition : {0U, 1U}) {
      for (const bool with_taps : {false, true}) {
        const Frames frames(model, view.tracer, view.acquisition, all, {read, shot_noise}, {7, condition}, with_taps);
        ASSERT_EQ(frames.exposures(), count);
        for (const std::uint64_t frame : {0U, 1U}) {
          std::vector<float> phases(count * n);
          frames.phases(frame, phases.data());
          for (std::size_t k = 0; k < count; ++k) {
            std::vector<double>& image = (with_taps ? by_taps : by_samples).emplace_back(n);
            for (std::size_t i = 0; i < n; ++i) {
              const std::size_t a = 2 * k * n + i, b = a + n;
              image[i] = (double{phases[k * n + i]} - (mean[a] - mean[b])) / std::sqrt(variance(a) + variance(b));
            }
          }
        }
        if (!with_taps || condition > 0) continue;
        std::vector<std::uint16_t> taps(2 * count * n);
        frames.taps(0, taps.data());
        for (std::size_t plane = 0; plane < 2 * count; ++plane) {
          std::vector<double>& image = whole.emplace_back(n);
          for (std::size_t i = 0; i < n; ++i) {
            const std::size_t at = plane * n + i;  // rounding to whole counts adds 1/12
            image[i] = (static_cast<double>(taps[at]) - mean[at]) / std::sqrt(variance(at) + 1.0 / 12);
          }
        }
      }
    }
    expect_standard(by_samples);
    expect_standard(by_taps);
    expect_standard(whole);
  }
}

/// Tap noise of recorded frames: variance of a pixel's tap from frame to frame, and its mean, over all pixels and
/// taps.
struct Recorded {
  double mean = 0, variance = 0;
};

Recorded recorded(const std::string& effects, const std::string& integration_time) {
  const tests::TemporaryFolder folder;
  tests::write_text(folder.path() / "model.yaml", "model: 1\ncamera: camcube2\neffects: [" + effects + "]\n");
  tests::write_text(folder.path() / "scene.yaml",
                    "scene: 1\ncamera: camcube2\nframes: 20\noutput: taps\nseed: 5\n"
                    "noise: {read_noise: 3 counts, shot_noise: 0.012 counts}\nintegration_time: " +
                        integration_time +
                        "\nobjects:\n  - {name: board, type: board, distance: 1 m, reflectivity: 0.6}\n");
  const tests::Outcome made =
      tests::shell("$TOFGRAPH simulate scene.yaml --model model.yaml -o out.h5 --quiet", folder.path());
  if (made.exit_code != 0) throw std::runtime_error(made.err);
  const io::CaptureReader capture(folder.path() / "out.h5");
  const std::size_t n = capture.channels().at(0).elements(), frames = capture.frames();
  std::vector<double> sum(n), square(n);
  std::vector<std::uint16_t> taps(n);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    capture.read(0, frame, taps.data());
    for (std::size_t i = 0; i < n; ++i) {
      sum[i] += taps[i];
      square[i] += static_cast<double>(taps[i]) * taps[i];
    }
  }
  Recorded result;
  const auto count = static_cast<double>(frames), all = static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    result.mean += sum[i] / count / all;
    result.variance += (square[i] - sum[i] * sum[i] / count) / (count - 1) / all;
  }
  return result;
}

/// Noise of recorded taps: factor * sqrt(read^2 + shot counts), and rounding to whole counts adds 1/12. There are six
/// million numbers: five standard deviations of their variance are 0.3 %.
TEST(TemporalNoise, MultipliesTheDeviationOfWhatIsRecorded) {
  const auto expect_factor = [](double factor, const std::string& effects) {
    for (const char* integration_time : {"0.1 ms", "10 ms"}) {  // mostly read noise, and mostly shot noise
      SCOPED_TRACE(effects + " at " + integration_time);
      const Recorded seen = recorded(effects, integration_time);
      const double wanted = factor * factor * (9 + 0.012 * seen.mean) + 1.0 / 12;
      EXPECT_NEAR(seen.variance / wanted, 1, 3e-3);
      EXPECT_TRUE(integration_time[0] == '0' ? 0.012 * seen.mean < 0.3 * 9 : 0.012 * seen.mean > 10 * 9) << seen.mean;
    }
  };
  expect_factor(1, "");
  expect_factor(0.5, "{effect: temporal_noise, factor: 0.5}");
  expect_factor(2.5, "{effect: temporal_noise, factor: 2.5}");
  // At any position in the model, also after effects that act on the noisy taps.
  expect_factor(2.5, "{effect: saturation, full_well: 60000 counts}, {effect: temporal_noise, factor: 2.5}");
  EXPECT_EQ(recorded("{effect: temporal_noise, factor: 0}", "10 ms").variance, 0);
}

/// The variance is that of the light without suppression, in the taps and in the samples drawn directly.
TEST(AmbientLight, SuppressedLightKeepsItsShotNoise) {
  constexpr double read = 3, shot_noise = 0.012;
  constexpr std::size_t exposures = 4;
  View view;
  view.acquisition.condition.ambient = "lamp";
  const Tracer board = board_tracer(camcube().focal_length, view.board);
  const Pixels all = whole_image(camcube());
  const std::size_t n = all.size();
  const std::string lamp = "{effect: ambient_light, rate: 1e7 counts/s, suppression: ";  // 10000 counts per tap
  const ForwardModel model(camcube(), true, effects(lamp + "1500 counts}", camcube()));
  const ForwardModel unsuppressed(camcube(), true, effects(lamp + "none}", camcube()));
  const std::vector<double> mean = model.expect(board, view.acquisition, all).taps,
                            light = unsuppressed.expect(board, view.acquisition, all).taps;
  const auto variance = [&](std::size_t at) { return read * read + shot_noise * light[at]; };
  const Frames by_samples(model, board, view.acquisition, all, {read, shot_noise}, {7, 0});
  const Frames by_taps(model, board, view.acquisition, all, {read, shot_noise}, {7, 1}, true);
  std::vector<float> phases(exposures * n);
  by_samples.phases(0, phases.data());
  std::vector<std::uint16_t> taps(2 * exposures * n);
  by_taps.taps(0, taps.data());
  Images images;
  for (std::size_t k = 0; k < exposures; ++k) {
    std::vector<double>& image = images.emplace_back(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t a = 2 * k * n + i, b = a + n;
      image[i] = (double{phases[k * n + i]} - (mean[a] - mean[b])) / std::sqrt(variance(a) + variance(b));
    }
  }
  for (std::size_t plane = 0; plane < 2 * exposures; ++plane) {
    std::vector<double>& image = images.emplace_back(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t at = plane * n + i;
      EXPECT_LT(mean[at], 5000);
      image[i] = (static_cast<double>(taps[at]) - mean[at]) / std::sqrt(variance(at) + 1.0 / 12);
    }
  }
  expect_standard(images);
}

TEST(Frames, DecodeTheDistanceFromAnyExposures) {
  const std::vector<Exposures> sets = {steps({0, 90, 180, 270}, {30e6}), steps({0, 270, 180, 90}, {30e6}),
                                       steps({0, 120, 240}, {30e6}), nine(), three()};
  for (const Exposures& exposures : sets) {
    SCOPED_TRACE(physics::exposures_text(exposures));
    const ExposedCamera camera(exposures);
    const BoardPose board{1.3, 0, 0, 0.85};
    const Acquisition acquisition = acquisition_of(camera.view(), integration_time);
    const Pixels all = superpixels(camera.view(), side, side);
    const ForwardModel model(camera.view(), false, {});  // equal sources: the phase of their mean path
    const Frames frames(model, board_tracer(focal_length, board), acquisition, all, {}, {});
    std::vector<float> distance(pixels), amplitude(pixels);
    frames.distance(0, distance.data(), amplitude.data());
    for (std::size_t i = 0; i < pixels; i += 13) {
      const Hit& hit = frames.hits()[i];
      const double path =
          (physics::norm(hit.point - Vector3{-0.05, 0, 0}) + physics::norm(hit.point - Vector3{0.05, 0, 0})) / 2;
      const double wanted = (path + hit.return_path + focal_length / all.rays[i].z) / 2;
      EXPECT_NEAR(static_cast<double>(distance[i]), wanted, 1e-6);
    }
  }
}

TEST(Frames, DistancesStayBelowTheRange) {
  constexpr std::size_t pixel = 78;
  for (const Exposures& exposures : {steps({0, 90, 180, 270}), three()}) {
    SCOPED_TRACE(physics::exposures_text(exposures));
    const ExposedCamera camera(exposures);
    const Acquisition acquisition = acquisition_of(camera.view(), integration_time);
    const Pixels all = superpixels(camera.view(), side, side);
    const Tracer board = board_tracer(focal_length, {1.3, 0, 0, 0.85});
    const auto distance_with = [&](const std::string& list) {
      const ForwardModel model(camera.view(), false, effects(list, camera.view()));
      std::vector<float> distance(pixels), amplitude(pixels);
      Frames(model, board, acquisition, all, {}, {}).distance(0, distance.data(), amplitude.data());
      return static_cast<double>(distance[pixel]);
    };
    const double plain = distance_with("");
    for (int i = -20; i <= 20; ++i) {  // 0.4 um to both sides of 0, where floats below the range are 0.48 um apart
      std::ostringstream list;
      list.precision(12);
      list << "{effect: zero_offset, offset: " << i * 2e-8 - plain << " m}";
      const double distance = distance_with(list.str());
      EXPECT_GE(distance, 0) << list.str();
      EXPECT_LT(distance, c_light / (2 * own)) << list.str();
    }
  }
}

}  // namespace
