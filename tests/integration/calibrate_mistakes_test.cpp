// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Mistakes.BoardsThat*
// Rooms: config calibration
// Errors in a campaign that calibrate names: a rail with two targets in front of a camera of 24 x 24 px implemented
// here, with wiggling and an offset; each test writes one thing wrongly.
#include <hdf5.h>

#include "calibration/calibrate.hpp"
#include "config/diagnostics.hpp"
#include "tests/program.hpp"
#include "tests/unit/raw_capture.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace tofgraph::tests {
namespace {

constexpr std::size_t side = 24, pixels = side * side, frames = 2;
constexpr double metres_per_radian = 7.4948114 / (2 * std::numbers::pi);

/// Condition as seen by the camera, and as written in the campaign.
struct Board {
  std::string id, target;
  double distance = 1, reflectivity = 0.85, time = 4e-3;  ///< m, -, s: true values
  double written_distance = 1, written_time = 4e-3;
  std::string written_target, capture, camera = "tiny", applied;
};

class Mistakes : public testing::Test {
 protected:
  Mistakes() {
    for (int k = 0; k < 14; ++k) {
      for (const auto& [target, reflectivity] : {std::pair{"white", 0.85}, std::pair{"dark", 0.25}}) {
        Board b{.target = target, .distance = 0.75 + 0.25 * k, .reflectivity = reflectivity};
        b.id = b.capture = fmt::format("{}_{:.0f}", target, 1e3 * b.distance);
        b.written_distance = b.distance;
        b.written_target = target;
        boards.push_back(b);
      }
    }
  }

  Board& at(const std::string& id) { return *std::ranges::find(boards, id, &Board::id); }

  void record(const Board& board) {
    constexpr double focal = 12.8e-3, pitch = 330e-6;
    std::normal_distribution<double> unit(0, 1);
    std::vector<float> distances, amplitudes;
    for (std::size_t f = 0; f < frames; ++f) {
      for (std::size_t i = 0; i < pixels; ++i) {
        const double x = (static_cast<double>(i % side) - 11.5) * pitch,
                     y = (static_cast<double>(i / side) - 11.5) * pitch;
        const double k = (board.distance - focal) / focal;
        const double d =
            ((std::hypot(k * x + 0.05, k * y, board.distance) + std::hypot(k * x - 0.05, k * y, board.distance)) / 2 +
             (k + 1) * std::hypot(x, y, focal)) /
            2;
        const double a = std::min(7e6 * board.reflectivity * board.time / (4 * d * d), full_);
        const double error = 0.028 + 0.006 * std::sin(4 * d / metres_per_radian + 0.7);
        distances.push_back(static_cast<float>(d + error + 8 / a * unit(random_) * metres_per_radian));
        amplitudes.push_back(static_cast<float>(a + 5 * unit(random_)));
      }
    }
    RawCapture capture(folder.path() / (board.capture + ".h5"));
    capture.head(side, side, 1, "tofgraph-capture", board.camera);
    capture.dataset("distance", {frames, side, side}, distances, {1, side, side}, board.applied);
    capture.dataset("amplitude", {frames, side, side}, amplitudes, {1, side, side});
    capture.metadata(frames, board.time);
  }

  void write() {
    write_text(folder.path() / "camera.yaml",
               "profile: 1\nname: tiny\nwidth: 24\nheight: 24\npixel_pitch: 330 um\nfocal_length: 12.8 mm\n"
               "principal_point: [11.5, 11.5]\nmodulation_frequency: 20 MHz\nsources:\n"
               "  - {name: left, position: [-50 mm, 0 mm, 0 mm], amplitude: 1}\n"
               "  - {name: right, position: [50 mm, 0 mm, 0 mm], amplitude: 1}\n"
               "gain: 7.0e6 counts m^2/s\ncontrast: 0.5\nfull_well: 30000 counts\nintegration_time: [0.5 ms, 50 ms]\n");
    std::string text = "campaign: 1\ncamera: camera.yaml\nconditions:\n";
    for (const Board& b : boards) {
      record(b);
      text += fmt::format(
          "  - {{id: {}, capture: {}.h5, board: {{distance: {:.1f} mm}}, target: {}, integration_time: {} ms}}\n", b.id,
          b.capture, 1e3 * b.written_distance, b.written_target, 1e3 * b.written_time);
    }
    write_text(folder.path() / "campaign.yaml", text);
  }

  /// The error, or the notes and the summary.
  std::string calibrated(const char* kind = "offset", bool force = false) {
    write();
    try {
      const calibration::Result result = calibration::calibrate(
          calibration::kind_of(kind),
          {.campaign = folder.path() / "campaign.yaml", .output = folder.path() / "o.yaml", .force = force});
      return fmt::format("notes: {}\n{}", fmt::join(result.notes, "\n"), result.summary);
    } catch (const config::ConfigurationError& error) {
      return fmt::format("usage: {}", error.what());
    } catch (const std::runtime_error& error) {
      return fmt::format("refused: {}", error.what());
    }
  }

  static void expect(const std::string& said, std::initializer_list<const char*> words) {
    for (const char* word : words) EXPECT_NE(said.find(word), std::string::npos) << word << "\n" << said;
  }

  double full_ = 1e9;  ///< counts, at which amplitudes saturate
  std::mt19937_64 random_{5};
  std::vector<Board> boards;
  TemporaryFolder folder;
};

TEST_F(Mistakes, ARightCampaignIsCalibratedAndNothingIsNamed) {
  const std::string said = calibrated();
  expect(said, {"notes: ", "28 conditions"});
  EXPECT_EQ(said.find("is its distance right?"), std::string::npos) << said;
  EXPECT_EQ(said.find("unit"), std::string::npos) << said;
}

TEST_F(Mistakes, SwappedTargets) {
  std::swap(at("white_1500").written_target, at("dark_1500").written_target);
  expect(calibrated(), {"usage: ", "white_1500", "dark_1500", "correct it, or leave the condition out"});
}

TEST_F(Mistakes, OneTarget) {
  at("white_2000").written_target = "dark";
  expect(calibrated(), {"usage: ", "condition 'white_2000': you wrote 'target: dark'", "the data say white"});
}

TEST_F(Mistakes, ABoardTwentyMillimetresOff) {
  at("white_2500").written_distance += 0.02;
  const std::string said = calibrated();
  expect(said, {"usage: ", "condition 'white_2500': the board at 2.52 m", "nearer than the others predict",
                "is its distance right?"});
  EXPECT_EQ(said.find("'dark_2500'"), std::string::npos) << said;
  EXPECT_EQ(said.find("'white_2250'"), std::string::npos) << said;
  expect(calibrated("offset", true), {"notes: ", "nearer than the others predict"});
}

TEST_F(Mistakes, BothBoardsTwentyMillimetresOffAtTheNearEnd) {
  at("white_750").written_distance += 0.02;
  at("dark_750").written_distance += 0.02;
  expect(calibrated(), {"usage: ", "condition 'white_750': the board at 770 mm", "condition 'dark_750'"});
}

TEST_F(Mistakes, ABoardTwentyMillimetresOffAtTheFarEnd) {
  at("white_4000").written_distance -= 0.02;
  const std::string said = calibrated();
  expect(said, {"usage: ", "condition 'white_4000': the board at 3.98 m"});
  EXPECT_EQ(said.find("'dark_4000'"), std::string::npos) << said;
}

TEST_F(Mistakes, AllDistancesInAnotherUnit) {
  for (Board& b : boards) b.written_distance /= 10;
  expect(calibrated(), {"usage: ", "said to stand at 75 mm to 400 mm", "is the unit of the distances right?"});
}

TEST_F(Mistakes, ABoardAtTenTimesItsDistance) {
  at("dark_750").written_distance = 7.4;
  expect(calibrated(), {"dark_750"});
}

TEST_F(Mistakes, AllIntegrationTimesInAnotherUnit) {
  for (Board& b : boards) b.written_time *= 1e-3;
  expect(calibrated(), {"0.001 times those of the captures", "4 us", "4 ms", "is the unit right?"});
}

TEST_F(Mistakes, OneIntegrationTime) {
  at("white_1500").written_time = 2e-3;
  expect(calibrated(),
         {"usage: ", "condition 'white_1500': you wrote 'integration_time: 2 ms'", "the capture says 4 ms"});
}

TEST_F(Mistakes, CapturesOfAnotherCamera) {
  at("dark_2000").camera = "lab9";
  expect(calibrated(), {"usage: ", "the capture is of the camera 'lab9', 27 others are of 'tiny'"});
}

TEST_F(Mistakes, BoardsThatWereCorrectedAlready) {
  for (Board& b : boards) b.applied = "four_phase_decoder offset_correction offset";
  expect(calibrated(), {"usage: ", "offset_correction applied", "from before that stage"});
  for (Board& b : boards) b.applied = "four_phase_decoder model_correction";
  expect(calibrated(), {"notes: ", "model_correction applied: what it corrected is not found again"});
}

TEST_F(Mistakes, SomeBoardsThatWereCorrectedAlready) {
  at("dark_2000").applied = "four_phase_decoder model_correction";
  expect(calibrated(), {"usage: ", "1 of 28 captures have model_correction applied", "dark_2000"});
}

TEST_F(Mistakes, ASaturatedSeries) {
  full_ = 15000;  // a camera that delivers decoded frames does not report saturation
  for (Board& b : boards) b.time = b.written_time = 10e-3;
  expect(calibrated(), {"usage: ", "condition 'white_750': the capture looks saturated"});
}

TEST_F(Mistakes, WhatDoesNotImproveHeldOutBoardsIsNotWritten) {
  std::erase_if(boards, [](const Board& b) { return b.distance != 0.75 && b.distance != 2.0 && b.distance != 4.0; });
  for (Board& b : boards) b.written_distance += b.distance == 2 ? 0.028 : -0.002;
  const std::string said = calibrated();
  expect(said, {"refused: calibrate offset", "each distance left out", "remain of", "likely causes", "--force"});
  expect(calibrated("offset", true), {"notes: the calibration does not improve conditions that were held out"});
}

}  // namespace
}  // namespace tofgraph::tests
