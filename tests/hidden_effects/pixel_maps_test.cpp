// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: PixelMaps.*
// Rooms: diagnosis simulation plugins
// The accuracy of a pixel pattern found by the search is limited only by the noise of the frames, in every pixel.
#include <gtest/gtest.h>

#include "io/campaign.hpp"
#include "io/captures/capture.hpp"
#include "io/captures/capture_map.hpp"
#include "tests/hidden_effects/campaign.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <random>
#include <set>
#include <string>

namespace tofgraph::hidden {
namespace {

constexpr double metres_per_radian = 299792458.0 / (4 * M_PI * 20e6);

/// Attainable uncertainty of each pixel's offset, root mean square over the pixels, m: a phase from n frames whose
/// samples have variance s^2 and mean amplitude a has the sd s / (sqrt(2 n) a); the information of conditions adds up.
double allowed_by_noise(const io::Campaign& campaign, std::size_t pixels) {
  std::vector<double> information(pixels, 0);
  for (const io::Condition& condition : campaign.conditions) {
    const io::CaptureReader capture(condition.capture);
    const auto frames = static_cast<double>(capture.frames());
    std::vector<std::array<double, 4>> mean(pixels);
    double squares = 0;
    std::vector<std::uint16_t> taps(8 * pixels);
    for (std::size_t f = 0; f < capture.frames(); ++f) {
      capture.read(0, f, taps.data());
      for (std::size_t p = 0; p < pixels; ++p) {
        for (std::size_t k = 0; k < 4; ++k) {
          const double c = taps[2 * k * pixels + p] - taps[(2 * k + 1) * pixels + p];
          mean[p][k] += c / frames;
          squares += c * c;
        }
      }
    }
    for (const auto& c : mean)
      for (const double value : c) squares -= frames * value * value;
    const double variance = squares / (4 * (frames - 1) * static_cast<double>(pixels));
    for (std::size_t p = 0; p < pixels; ++p) {
      const auto& c = mean[p];
      const double amplitude = std::hypot(c[3] - c[1], c[0] - c[2]) / 2;
      information[p] += 2 * frames * amplitude * amplitude / (variance * metres_per_radian * metres_per_radian);
    }
  }
  double sum = 0;
  for (const double one : information) sum += 1 / one;
  return std::sqrt(sum / static_cast<double>(pixels));
}

double root_mean_square(std::span<const double> values) {
  double mean = 0, square = 0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  for (const double value : values) square += (value - mean) * (value - mean);
  return std::sqrt(square / static_cast<double>(values.size()));
}

class PixelMaps : public testing::Test {
 protected:
  void make_small(std::initializer_list<const char*> effects) {
    CampaignOptions options;
    options.design = "small";
    options.every = 2;
    options.seed = seed;
    for (const char* effect : effects) options.effects.add_text(effect, 1, options.seed);
    options.folder = folder_.path() / "made";
    make_campaign(options);
  }

  void search(const std::string& options) {
    const tests::Outcome outcome =
        tests::shell("\"$TOFGRAPH\" diagnose --quiet --model made/model.yaml --data made/campaign.yaml -o " + options,
                     folder_.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }

  void expect_named(std::set<std::string> names) {
    search("found");
    const auto report = nlohmann::json::parse(tests::read_text(folder_.path() / "found/report.json"));
    std::set<std::string> found;
    for (const auto& effect : report.at("effects")) found.insert(effect.at("name"));
    EXPECT_EQ(found, names);
    EXPECT_EQ(report.at("verdict"), "named");
  }

  /// Root mean square of the difference between a true map and the one found, SI.
  double left_of(const std::vector<double>& truth, const std::string& dataset) {
    const io::ImageData found = io::read_pixel_map((folder_.path() / "found/maps.h5").string(), dataset);
    std::vector<double> left(truth.size(), NAN);
    for (std::size_t p = 0; p < found.values.size(); ++p) left.at(p) = truth[p] - found.values[p];
    return root_mean_square(left);
  }

  void expect_as_good_as_noise_allows(const std::vector<double>& truth) {
    config::Diagnostics diagnostics;
    const io::Campaign campaign = io::read_campaign(folder_.path() / "made/campaign.yaml", diagnostics);
    const double error = left_of(truth, "fixed_pattern_map"), allowed = allowed_by_noise(campaign, truth.size());
    RecordProperty("error_mm", std::to_string(1e3 * error));
    RecordProperty("allowed_mm", std::to_string(1e3 * allowed));
    EXPECT_LT(error, 1.2 * allowed);
    EXPECT_LT(error, 0.5 * root_mean_square(truth));
  }

  static constexpr std::uint64_t seed = 93001;
  tests::TemporaryFolder folder_;
};

TEST_F(PixelMaps, AreAsGoodAsTheNoiseAllows) {
  make_small({"fixed_pattern"});
  expect_named({"fixed_pattern"});
  expect_as_good_as_noise_allows(draw_maps(Camera(), seed).fixed_pattern);
  search("alone --threads 1");
  const auto map = [&](const char* out) {
    return io::read_pixel_map((folder_.path() / out / "maps.h5").string(), "fixed_pattern_map").values;
  };
  EXPECT_EQ(map("found"), map("alone")) << "the same with any number of threads";
}

TEST_F(PixelMaps, OfTwoEffectsAreToldApart) {
  make_small({"fixed_pattern", "pixel_response"});
  expect_named({"fixed_pattern", "pixel_response"});
  const auto truth = draw_maps(Camera(), seed);
  expect_as_good_as_noise_allows(truth.fixed_pattern);
  EXPECT_LT(left_of(truth.response, "pixel_response_map"), 0.1 * root_mean_square(truth.response));
}

/// Pattern of a real array: 83 mm in total, from pixels, rows and columns, at 320 x 240.
TEST_F(PixelMaps, OfALargePatternOfAnotherCameraToo) {
  constexpr std::size_t width = 320, height = 240;
  std::mt19937 random(83);
  std::normal_distribution<double> normal;
  const auto drawn = [&](std::size_t count, double sd) {
    std::vector<double> values(count);
    for (double& value : values) value = sd * normal(random);
    return values;
  };
  std::vector<double> pattern = drawn(width * height, 70e-3);
  const std::vector<double> rows = drawn(height, 30e-3), columns = drawn(width, 33e-3);
  for (std::size_t p = 0; p < pattern.size(); ++p) pattern[p] += rows[p / width] + columns[p % width];
  io::write_pixel_maps((folder_.path() / "pattern.h5").string(), {{"map", "m", pattern}}, height, width);
  std::string profile = tests::read_text(TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml");
  const auto change = [&](const std::string& from, const std::string& to) {
    profile.replace(profile.find(from), from.size(), to);
  };
  change("width: 204", "width: 320");
  change("height: 204", "height: 240");
  change("[101.5, 101.5]", "[159.5, 119.5]");
  tests::write_text(folder_.path() / "wide.yaml", profile);
  const std::string camera = "camera: " + (folder_.path() / "wide.yaml").string() + "\n";
  tests::write_text(folder_.path() / "truth.yaml",
                    "model: 1\n" + camera +
                        "effects:\n  - {effect: fixed_pattern, scale: 1, map: {file: pattern.h5, dataset: map}}\n");
  tests::write_text(folder_.path() / "scene.yaml",
                    "scene: 1\n" + camera +
                        "frames: 4\noutput: taps\nseed: 5\ntime_since_power_on: 3600 s\nintegration_time: 4 ms\n"
                        "objects:\n  - {name: board, type: board, distance: 1 m, reflectivity: 0.7}\n"
                        "sequence:\n  - {key: board.distance, values: [0.8 m, 1.2 m, 1.6 m, 2 m, 2.4 m, 2.8 m, 3.2 m, "
                        "3.6 m]}\n");
  const tests::Outcome made =
      tests::shell("\"$TOFGRAPH\" simulate scene.yaml --model truth.yaml -o made", folder_.path());
  ASSERT_EQ(made.exit_code, 0) << made.err;
  tests::write_text(folder_.path() / "made/model.yaml", "model: 1\n" + camera + "effects: []\n");
  expect_named({"fixed_pattern"});
  expect_as_good_as_noise_allows(pattern);
}

}  // namespace
}  // namespace tofgraph::hidden
