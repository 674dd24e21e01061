// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: FixedPatternRuns.ASubsetIsRight:FixedPatternRuns.WithoutAPatternNothingIsWritten
// Rooms: calibration
// The calibration fixed-pattern over 5 to 30 frames, 3 to 8 distances, with and without rolls and with three amplitudes
// of wiggling, for an independently implemented camera of 51 x 51 px. All 60 runs: build/tests/fixed_pattern_runs_test
// --gtest_also_run_disabled_tests --gtest_filter='*AllSixtyRuns', with other seeds than 100 to 159 by
// TOFGRAPH_PATTERN_SEED, the first of the 60.
#include <hdf5.h>

#include "calibration/calibrate.hpp"
#include "tests/program.hpp"
#include "tests/unit/raw_capture.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <random>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t side = 51, pixels = side * side;
constexpr double focal = 12.8e-3, pitch = 160e-6, centre = 25, lamp = 50e-3, mm = 1e-3;
constexpr double metres_per_radian = 299792458.0 / (4 * std::numbers::pi * 20e6);

struct PatternRun {
  std::size_t frames = 10, distances = 5;
  bool rolls = true;
  double wiggling = 0;  ///< m
  std::uint64_t seed = 1;
  double pattern = 1;    ///< factor on the pattern
  double misplaced = 0;  ///< m, displacement of the second distance's boards
  bool spoilt = false;   ///< 64 pixels of the first board wrap, and the last board has too little light
};

/// True pose of a board.
struct Place {
  double distance = 1, roll = 0, z = 0, tilt_x = 0, tilt_y = 0;
};

/// Half path from both lamps via a board bent by half a millimetre and through the lens to the pixel, m.
double half_path(std::size_t pixel, const Place& board) {
  const double x = (static_cast<double>(pixel % side) - centre) * pitch,
               y = (static_cast<double>(pixel / side) - centre) * pitch, inside = std::hypot(x, y, focal);
  const double c = std::cos(board.roll), s = std::sin(board.roll);
  double path = 0;
  for (int step = 0; step < 40; ++step) {
    const double px = path * x / inside, py = path * y / inside, u = c * px - s * py, v = s * px + c * py;
    const double bent = 0.5 * mm * (u * u - 0.4 * v * v + 0.6 * u * v * v) / 0.36;
    path = (board.distance + board.z + board.tilt_x * v - board.tilt_y * u + bent - focal) * inside / focal;
  }
  const double px = path * x / inside, py = path * y / inside, pz = focal + path * focal / inside;
  return ((std::hypot(px + lamp, py, pz) + std::hypot(px - lamp, py, pz)) / 2 + path + inside) / 2;
}

class FixedPatternRuns : public testing::Test {
 protected:
  struct Outcome {
    double truth = 0, found = 0, error = 0;  ///< m, rms
    std::string refusal;
  };

  Outcome calibrate(const PatternRun& run, bool force = false) {
    std::mt19937_64 random(run.seed);
    std::normal_distribution<double> unit(0, 1);
    std::uniform_real_distribution<double> angle(0, 2 * std::numbers::pi);
    std::vector<double> map(pixels), rows(side), columns(side);
    for (double& r : rows) r = unit(random) * mm;
    for (double& k : columns) k = unit(random) * mm;
    double mean = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      map[i] = run.pattern * (2 * mm * unit(random) + rows[i / side] + columns[i % side]);
      mean += map[i] / static_cast<double>(pixels);
    }
    for (double& m : map) m -= mean;
    const double phase4 = angle(random), phase5 = angle(random), phase8 = angle(random), beside = angle(random);
    const auto error_at = [&](double d) {  // harmonics of the correlation, and multipath light
      const double psi = d / metres_per_radian;
      return run.wiggling * (std::sin(4 * psi + phase4) + 0.36 * std::sin(4 * psi + phase5) +
                             0.14 * std::sin(8 * psi + phase8) + 0.2 * d * d * std::cos(psi + beside));
    };
    const TemporaryFolder folder;
    write_text(folder.path() / "camera.yaml",
               "profile: 1\nname: small\nwidth: 51\nheight: 51\npixel_pitch: 160 um\nfocal_length: 12.8 mm\n"
               "principal_point: [25, 25]\nmodulation_frequency: 20 MHz\nsources:\n"
               "  - {name: left, position: [-50 mm, 0 mm, 0 mm], amplitude: 1}\n"
               "  - {name: right, position: [50 mm, 0 mm, 0 mm], amplitude: 1}\n"
               "gain: 7.0e6 counts m^2/s\ncontrast: 0.5\n");
    std::string text = "campaign: 1\ncamera: camera.yaml\nconditions:\n";
    for (std::size_t k = 0; k < run.distances; ++k) {
      const double distance = run.distances < 6
                                  ? 0.8 + 0.4 * static_cast<double>(k)
                                  : 0.8 + 2.2 * static_cast<double>(k) / static_cast<double>(run.distances - 1);
      for (const double roll : run.rolls ? std::vector<double>{0, 90, 180, 270} : std::vector<double>{0}) {
        const Place board{.distance = distance,
                          .roll = roll * std::numbers::pi / 180,
                          .z = mm * unit(random) + (k == 1 ? run.misplaced : 0),
                          .tilt_x = mm * unit(random),
                          .tilt_y = mm * unit(random)};
        const std::string name = fmt::format("b{}-{}", k, roll);
        RawCapture capture(folder.path() / (name + ".h5"));
        capture.head(side, side, 1, "tofgraph-capture", "small");
        std::vector<float> exact, distances;
        const bool dim = run.spoilt && k + 1 == run.distances;
        for (std::size_t i = 0; i < pixels; ++i) {
          const double d = half_path(i, board);
          exact.push_back(static_cast<float>(d + map[i] + error_at(d) + 28 * mm));
        }
        for (std::size_t f = 0; f < run.frames; ++f) {
          for (const float e : exact)
            distances.push_back(e + static_cast<float>((dim ? 700 : 0.75) * mm * distance * distance * unit(random)));
          for (std::size_t i = 0; k == 0 && roll == 0 && run.spoilt && i < 64; ++i)
            distances[f * pixels + (i / 8) * side + i % 8] += static_cast<float>(std::numbers::pi * metres_per_radian);
        }
        const hsize_t n = run.frames;
        capture.dataset("distance", {n, side, side}, distances, {1, side, side});
        capture.dataset("amplitude", {n, side, side}, std::vector<float>(distances.size(), 500), {1, side, side});
        capture.metadata(run.frames, 1e-3);
        text += fmt::format("  - {{id: {0}, capture: {0}.h5, board: {{distance: {1} mm}}, roll: {2} deg}}\n", name,
                            std::round(1e3 * distance * 1e3) / 1e3, roll);
      }
    }
    write_text(folder.path() / "campaign.yaml", text);
    Outcome outcome;
    for (const double m : map) outcome.truth += m * m / static_cast<double>(pixels);
    outcome.truth = std::sqrt(outcome.truth);
    try {
      const calibration::Result result = calibration::calibrate(
          calibration::kind_of("fixed-pattern"),
          {.campaign = folder.path() / "campaign.yaml", .output = folder.path() / "fp.yaml", .force = force});
      const std::vector<double>& found = result.maps.at(0).values;
      for (std::size_t i = 0; i < pixels; ++i) {
        outcome.found += found[i] * found[i] / static_cast<double>(pixels);
        outcome.error += std::pow(found[i] - map[i], 2) / static_cast<double>(pixels);
      }
      outcome.found = std::sqrt(outcome.found);
      outcome.error = std::sqrt(outcome.error);
    } catch (const std::exception& refused) {
      outcome.refusal = refused.what();
    }
    return outcome;
  }

  /// Expects either a correct result or a refusal.
  void expect_right(const PatternRun& run) {
    const Outcome outcome = calibrate(run);
    const std::string name =
        fmt::format("seed {}: {} frames, {} distances, {}, wiggling {:.0f} mm", run.seed, run.frames, run.distances,
                    run.rolls ? "four rolls" : "no rolls", run.wiggling * 1e3);
    std::printf("%s: truth %.2f mm, found %.2f mm, error %.2f mm %s\n", name.c_str(), outcome.truth * 1e3,
                outcome.found * 1e3, outcome.error * 1e3, outcome.refusal.c_str());
    refusals_ += outcome.refusal.empty() ? 0 : 1;
    if (outcome.refusal.empty()) {
      EXPECT_NEAR(outcome.found, outcome.truth, 0.1 * outcome.truth) << name;
    }
  }

  int refusals_ = 0;
};

/// Run number k of the 60.
PatternRun numbered(std::size_t k, std::uint64_t first = 100) {
  constexpr std::size_t distances[] = {3, 4, 5, 6, 8};
  constexpr std::size_t frames[] = {5, 9, 14, 20, 25, 30, 12};
  constexpr double sizes[] = {0, 4 * mm, 8 * mm};
  return {.frames = frames[k % 7],
          .distances = distances[k % 5],
          .rolls = k % 2 == 0,
          .wiggling = sizes[k / 20],
          .seed = first + k};
}

TEST_F(FixedPatternRuns, ASubsetIsRight) {
  for (const std::size_t k : {5U, 23U, 43U, 50U}) expect_right(numbered(k));
  EXPECT_EQ(refusals_, 0) << "these boards suffice";
}

TEST_F(FixedPatternRuns, DISABLED_AllSixtyRuns) {
  const char* seed = std::getenv("TOFGRAPH_PATTERN_SEED");
  for (std::size_t k = 0; k < 60; ++k) expect_right(seed == nullptr ? numbered(k) : numbered(k, std::stoull(seed)));
  std::printf("%d of 60 refused\n", refusals_);
  EXPECT_LE(refusals_, 6) << "a refusal of everything would be no calibration";
}

TEST_F(FixedPatternRuns, WithoutAPatternNothingIsWritten) {
  const PatternRun none{.frames = 5, .distances = 4, .rolls = true, .pattern = 0};
  const Outcome refused = calibrate(none);
  EXPECT_NE(refused.refusal.find("does not improve conditions that were held out"), std::string::npos)
      << refused.refusal;
  EXPECT_NE(refused.refusal.find("--force"), std::string::npos) << refused.refusal;
  // 4 distances and rolls of 5 frames of 51 x 51 px.
  EXPECT_NE(refused.refusal.find("used: 16 of 16 conditions, 80 frames, "), std::string::npos) << refused.refusal;
  EXPECT_NE(refused.refusal.find("of 41616 pixels in all"), std::string::npos) << refused.refusal;
  EXPECT_EQ(calibrate(none, true).refusal, "") << "with force it is the user's decision";
}

TEST_F(FixedPatternRuns, ABoardHalfAMetreFromItsPlaceIsNamed) {
  const Outcome outcome = calibrate({.frames = 5, .distances = 5, .rolls = false, .misplaced = 0.5});
  EXPECT_NE(outcome.refusal.find("b1-0"), std::string::npos) << outcome.refusal;
}

TEST_F(FixedPatternRuns, ARefusalCountsWhatWasLeftOut) {
  const Outcome outcome = calibrate({.frames = 5, .distances = 5, .rolls = false, .pattern = 0, .spoilt = true});
  // Four boards of 51 x 51 px, without the 64 that wrap; those at the corners of the 64 may count as outliers. The
  // fifth board is not used, and its pixels are not counted.
  EXPECT_NE(outcome.refusal.find("used: 4 of 5 conditions, 20 frames, 10340 of 10404 pixels in all"), std::string::npos)
      << outcome.refusal;
  EXPECT_NE(outcome.refusal.find(" wrapped"), std::string::npos) << outcome.refusal;
  EXPECT_NE(outcome.refusal.find("b4-0: left out: too little light"), std::string::npos) << outcome.refusal;
}

}  // namespace
}  // namespace tofgraph::tests
