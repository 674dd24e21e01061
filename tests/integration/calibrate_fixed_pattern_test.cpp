// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: FixedPattern.FiveDistances*:FixedPattern.ItsGrowth*:FixedPattern.Wiggling*:FixedPattern.Crosstalk*
// Rooms: calibration
// The calibration fixed-pattern, compared with known patterns of the independent camera in tests/plain_boards.hpp.
#include <hdf5.h>

#include "tests/plain_boards.hpp"
#include "tests/program.hpp"

#include <numbers>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

constexpr double mm = 1e-3, degree = std::numbers::pi / 180;
constexpr std::size_t frames = 25;

double noise_at(double distance) { return 3 * mm * distance * distance; }  // of a frame: inverse to the light

/// 0.5 mm between the centre of the board and its edges, and a twist.
double warp(double x, double y) { return 0.5 * mm * (x * x - 0.4 * y * y + 0.6 * x * y * y) / (0.6 * 0.6); }

class FixedPattern : public testing::Test {
 protected:
  struct Setup {
    double slope = 0;              ///< m/m, growth of the pattern with distance
    double jitter = 0;             ///< board misplacement in units of 1 mm and 1 mrad
    double wiggling = 0;           ///< m, depends on the distance of each pixel
    double crosstalk = 0;          ///< m, at the amplitude of the middle of a board at 1 m
    double offset = 20 * mm;       ///< m, of all pixels, scatters from distance to distance
    double without_amplitude = 0;  ///< m, distance whose captures have no amplitudes
    bool shaped = true;
    std::vector<double> distances = {0.8, 1.2, 1.6, 2.0, 2.4};
    std::vector<double> rolls = {0, 90, 180, 270};
  };

  explicit FixedPattern() : map_(plain_pixels), slopes_(plain_pixels) {
    std::normal_distribution<double> pixel(0, 2 * mm), line(0, 1 * mm), unit(0, 1);
    std::vector<double> rows(plain_side), columns(plain_side);
    for (double& r : rows) r = line(random_);
    for (double& c : columns) c = line(random_);
    for (std::size_t i = 0; i < plain_pixels; ++i) {
      const double x = static_cast<double>(i % plain_side) / 101.5 - 1,
                   y = static_cast<double>(i / plain_side) / 101.5 - 1;
      map_[i] =
          pixel(random_) + rows[i / plain_side] + columns[i % plain_side] + 1.5 * mm * (x * x + y * y) + 1 * mm * x;
      slopes_[i] = unit(random_);
    }
    without_mean(map_);
    without_mean(slopes_);
  }

  static void without_mean(std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    for (double& v : values) v -= sum / static_cast<double>(values.size());
  }

  std::vector<float> frame(const std::vector<double>& mean, double sd) {
    std::normal_distribution<double> noise(0, sd);
    std::vector<float> image;
    for (const double m : mean) image.push_back(static_cast<float>(m + noise(random_)));
    return image;
  }

  /// Light of a pixel relative to that of the middle of a board at 1 m.
  static double light_of(std::size_t i, double distance) {
    const double x = (static_cast<double>(i % plain_side) - 101.5) / 320,
                 y = (static_cast<double>(i / plain_side) - 101.5) / 320;
    return std::pow(1 + x * x + y * y, -3) / (distance * distance);  // cos^4 of the lens, cos^2 of the distance
  }

  std::vector<double> mean_of(const PlainBoard& board, const Setup& setup, double offset) const {
    constexpr double turn = 2 * std::numbers::pi / 7.49481;  // rad/m
    std::vector<double> mean(plain_pixels);
    for (std::size_t i = 0; i < plain_pixels; ++i) {
      const double d = plain_half_path(i % plain_side, i / plain_side, board);
      mean[i] = d + map_[i] + setup.slope * slopes_[i] * (d - 2) + offset + setup.wiggling * std::sin(4 * turn * d) +
                setup.crosstalk / light_of(i, board.distance) * std::cos(turn * d - 1);
    }
    return mean;
  }

  void record(const Setup& setup) {
    std::normal_distribution<double> unit(0, 1);
    std::string text = "campaign: 1\ncamera: camcube2\nconditions:\n";
    for (const double distance : setup.distances) {
      const double offset = setup.offset * std::sin(5 * distance);
      const double milliseconds = setup.crosstalk != 0 && distance > 1.5 ? 4 : 1;
      std::vector<float> amplitude(plain_pixels, 500);
      for (std::size_t i = 0; setup.crosstalk != 0 && i < plain_pixels; ++i)
        amplitude[i] = static_cast<float>(2000 * milliseconds * light_of(i, distance));
      if (distance == setup.without_amplitude) amplitude.clear();
      for (const double roll : setup.rolls) {
        PlainBoard board{.distance = distance,
                         .roll = roll * degree,
                         .z = setup.jitter * mm * unit(random_),
                         .tilt_x = setup.jitter * mm * unit(random_),
                         .tilt_y = setup.jitter * mm * unit(random_)};
        if (setup.shaped) board.shape = warp;
        const std::vector<double> mean = mean_of(board, setup, offset);
        std::vector<std::vector<float>> images;
        for (std::size_t f = 0; f < frames; ++f) images.push_back(frame(mean, noise_at(distance)));
        const std::string name =
            std::to_string(static_cast<int>(1e3 * distance)) + "-" + std::to_string(static_cast<int>(roll));
        write_distances(folder.path() / (name + ".h5"), images, amplitude, milliseconds * 1e-3);
        text += "  - {id: b" + name + ", capture: " + name + ".h5, board: {distance: " + std::to_string(distance) +
                " m}, roll: " + std::to_string(roll) + " deg}\n";
      }
    }
    write_text(folder.path() / "campaign.yaml", text);
  }

  Outcome run(const std::string& command) const { return shell("\"$TOFGRAPH\" " + command, folder.path()); }

  static double rms(const std::vector<double>& a, const std::vector<double>& b, double scale = 1) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(a[i] - scale * b[i], 2);
    return std::sqrt(sum / static_cast<double>(a.size()));
  }
  std::vector<double> found(const char* dataset) const {
    return raw_values<double>(folder.path() / "fp.maps.h5", dataset);
  }

  std::mt19937_64 random_{7};
  std::vector<double> map_, slopes_;
  TemporaryFolder folder;
};

/// Standard uncertainty from the noise of all frames with everything else known: 1 / sqrt(sum of the weights).
double allowed(const std::vector<double>& distances, std::size_t rolls) {
  double weight = 0;
  for (const double d : distances) weight += static_cast<double>(rolls * frames) / std::pow(noise_at(d), 2);
  return 1 / std::sqrt(weight);
}

TEST_F(FixedPattern, FiveDistancesAndFourRollsGiveItToTheNoise) {
  const Setup setup{};
  record(setup);
  const Outcome outcome = run("calibrate fixed-pattern campaign.yaml -o fp.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const double error = rms(found("map"), map_), noise = allowed(setup.distances, setup.rolls.size());
  std::printf("map: error %.3f times what the noise allows\n", error / noise);
  EXPECT_LT(error, 1.2 * noise);
  EXPECT_GT(error, 0.9 * noise) << "better than the noise allows: something is wrong with the test";
  // The map contains nothing of the warp.
  const std::vector<double> map = found("map");
  std::vector<double> shape(plain_pixels), difference(plain_pixels);
  for (std::size_t i = 0; i < plain_pixels; ++i) {
    const double x = (static_cast<double>(i % plain_side) - 101.5) / 320 * 1.6,
                 y = (static_cast<double>(i / plain_side) - 101.5) / 320 * 1.6;
    shape[i] = warp(x, y);
    difference[i] = map[i] - map_[i];
  }
  without_mean(shape);
  double product = 0, square = 0;
  for (std::size_t i = 0; i < plain_pixels; ++i) {
    product += difference[i] * shape[i];
    square += shape[i] * shape[i];
  }
  std::printf("warp in the map: %.3f\n", product / square);
  EXPECT_LT(std::abs(product / square), 0.03) << "share of the warp at 1.6 m";
  EXPECT_NE(outcome.err.find("no growth with the distance"), std::string::npos) << outcome.err;

  // A new board, corrected: only noise remains.
  const std::vector<double> mean = mean_of({.distance = 1.4}, {}, 0);
  write_distances(folder.path() / "new.h5", {frame(mean, noise_at(1.4))}, std::vector<float>(plain_pixels, 500), 1e-3);
  const Outcome corrected =
      run("run \"capture_reader file=new.h5 ! model_correction model=fp.model.yaml ! capture_writer path=out.h5\" "
          "--camera camcube2");
  ASSERT_EQ(corrected.exit_code, 0) << corrected.err;
  const std::vector<float> before = raw_values<float>(folder.path() / "new.h5", "/frames/distance"),
                           after = raw_values<float>(folder.path() / "out.h5", "/frames/distance");
  double left = 0, had = 0;
  for (std::size_t i = 0; i < plain_pixels; ++i) {
    const double truth = plain_half_path(i % plain_side, i / plain_side, {.distance = 1.4});
    left += std::pow(after[i] - truth, 2);
    had += std::pow(before[i] - truth, 2);
  }
  EXPECT_LT(std::sqrt(left / plain_pixels), 1.1 * noise_at(1.4));
  EXPECT_GT(std::sqrt(had / plain_pixels), 1.05 * noise_at(1.4)) << "there was something to undo";
}

TEST_F(FixedPattern, BoardsOutOfPlaceCostLittle) {
  const Setup setup{.jitter = 1};
  record(setup);
  const Outcome outcome = run("calibrate fixed-pattern campaign.yaml -o fp.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const double error = rms(found("map"), map_), noise = allowed(setup.distances, setup.rolls.size());
  std::printf("map, boards out by 1 mm and 1 mrad: error %.3f times what the noise allows\n", error / noise);
  EXPECT_LT(error, 1.2 * noise);
  // The stated uncertainty agrees with the error.
  const std::vector<double> sd = found("map_sd"), map = found("map");
  double squares = 0;
  for (std::size_t i = 0; i < plain_pixels; ++i) squares += std::pow((map[i] - map_[i]) / sd[i], 2);
  EXPECT_NEAR(std::sqrt(squares / plain_pixels), 1, 0.1);
}

TEST_F(FixedPattern, ItsGrowthWithTheDistanceIsFound) {
  const Setup setup{.slope = 2 * mm, .jitter = 0.5};
  record(setup);
  const Outcome outcome = run("calibrate fixed-pattern campaign.yaml -o fp.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("it grows with the distance"), std::string::npos) << outcome.err;
  // Weighted least squares fit of a straight line over the distances D - 2 m.
  double w = 0, wx = 0, wxx = 0;
  for (const double d : setup.distances) {
    const double weight = 4 * frames / std::pow(noise_at(d), 2);
    w += weight;
    wx += weight * (d - 2);
    wxx += weight * (d - 2) * (d - 2);
  }
  const double determinant = w * wxx - wx * wx;
  EXPECT_LT(rms(found("map"), map_), 1.2 * std::sqrt(wxx / determinant));
  EXPECT_LT(rms(found("slope_map"), slopes_, setup.slope), 1.2 * std::sqrt(w / determinant));
  const std::string text = read_text(folder.path() / "fp.model.yaml");
  EXPECT_NE(text.find("slope_map: {file: fp.maps.h5, dataset: slope_map}"), std::string::npos) << text;
}

/// A wiggling of 4 mm bends each board's image by up to a millimetre, differently at each distance: neither board shape
/// nor growth of the pattern, though five distances allow for both.
TEST_F(FixedPattern, WigglingIsNotTakenForThePattern) {
  const Setup setup{.wiggling = 4 * mm, .shaped = false};
  record(setup);
  const Outcome outcome = run("calibrate fixed-pattern campaign.yaml -o fp.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("no growth with the distance"), std::string::npos) << outcome.err;
  const double error = rms(found("map"), map_), noise = allowed(setup.distances, setup.rolls.size());
  std::printf("map, wiggling of 4 mm: error %.3f times what the noise allows\n", error / noise);
  EXPECT_LT(error, 1.5 * noise) << "of five distances a little of the bending is left in the mean";
}

/// A constant phasor turns the faint light of the image's corners and of distant boards by up to 12 mm, as a bent board
/// would. The boards' offsets follow the same curve.
TEST_F(FixedPattern, CrosstalkIsNotTakenForThePattern) {
  const Setup setup{.wiggling = 4 * mm, .crosstalk = 1 * mm, .offset = 0, .shaped = false};
  record(setup);
  const Outcome outcome = run("calibrate fixed-pattern campaign.yaml -o fp.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("the board: flat"), std::string::npos) << outcome.err;
  const double error = rms(found("map"), map_), noise = allowed(setup.distances, setup.rolls.size());
  std::printf("map, crosstalk of 1 mm at 1 m: error %.3f times what the noise allows\n", error / noise);
  EXPECT_LT(error, 1.1 * noise);
}

TEST_F(FixedPattern, WhatCannotBeToldIsSaid) {
  record({.distances = {1.2}, .rolls = {0}});
  const Outcome one = run("calibrate fixed-pattern campaign.yaml -o fp.yaml");
  EXPECT_EQ(one.exit_code, 2);
  EXPECT_NE(one.err.find("cannot be distinguished from errors of the pixels"), std::string::npos) << one.err;
  EXPECT_NE(one.err.find("roll: 90 deg"), std::string::npos) << one.err;
  record({.without_amplitude = 1.8, .distances = {1.2, 1.8}, .rolls = {0}});
  const Outcome two = run("calibrate fixed-pattern campaign.yaml -o fp.yaml");
  EXPECT_EQ(two.exit_code, 0) << two.err;
  EXPECT_NE(two.err.find("every condition has the same roll"), std::string::npos) << two.err;
  EXPECT_NE(two.err.find("2 distances: a growth of the pattern"), std::string::npos) << two.err;
  EXPECT_NE(two.err.find("no amplitudes in 'b1800-0': crosstalk"), std::string::npos) << two.err;
}

}  // namespace
}  // namespace tofgraph::tests
