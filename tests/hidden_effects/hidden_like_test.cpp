// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: HiddenLike.CameraAndEffects*:HiddenLike.MistakesAreNamed
// Rooms: io
// Another campaign of the same camera: properties of the camera and its boards are equal, the rest is drawn anew.
#include "config/document.hpp"
#include "io/campaign.hpp"
#include "io/captures/capture.hpp"
#include "tests/hidden_effects/designs.hpp"
#include "tests/hidden_effects/like.hpp"
#include "tests/program.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tofgraph::hidden {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using tests::TemporaryFolder;

const std::string program = TOFGRAPH_BINARY_DIR "/tests/hidden_effects_make ";

/// Lines of a truth file from one key to another.
std::string part(const std::string& text, const std::string& from, const std::string& to) {
  const std::size_t begin = text.find("\n" + from), end = text.find("\n" + to);
  EXPECT_NE(begin, std::string::npos);
  EXPECT_NE(end, std::string::npos);
  return text.substr(begin, end - begin);
}

TEST(HiddenLike, CameraAndEffectsStayTheRestIsDrawnAnew) {
  const TemporaryFolder folder;
  const auto shell = [&](const std::string& arguments) {
    const tests::Outcome outcome = tests::shell(program + arguments, folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome;
  };
  shell(
      "--design small --add capped --effect wiggling --effect saturation --pattern hysteresis --sessions 2 --warp 1mm "
      "--noise drift --frames 2 --output phases --seed 7 -o first");
  shell("--like first/truth.yaml --seed 8 -o second");
  const std::string first = tests::read_text(folder.path() / "first/truth.yaml"),
                    second = tests::read_text(folder.path() / "second/truth.yaml");
  EXPECT_EQ(part(first, "camera:", "clutter:"), part(second, "camera:", "clutter:"));  // includes effects and patterns
  EXPECT_EQ(part(first, "rig_seed:", "camera:"), part(second, "rig_seed:", "camera:"));
  EXPECT_NE(part(first, "sessions:", "conditions:"), part(second, "sessions:", "conditions:"));
  EXPECT_THAT(first, HasSubstr("\nseed: 7\nrig_seed: 7\n"));
  EXPECT_THAT(second, HasSubstr("\nseed: 8\nrig_seed: 7\n"));
  EXPECT_EQ(tests::shell("$TOFGRAPH check second/campaign.yaml", folder.path()).exit_code, 0);
}

TEST(HiddenLike, DistancesLieBetween) {
  const std::vector<io::Condition> first = conditions_of("B", {}), second = between(first, 3);
  std::set<double> levels, seen;
  for (const io::Condition& condition : first) levels.insert(condition.board_distance);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    const double was = first[i].board_distance, now = second[i].board_distance;
    const auto next = levels.upper_bound(was);
    const double low = next == levels.end() ? *std::prev(levels.find(was)) : was;
    const double high = next == levels.end() ? was : *next;
    EXPECT_GT(now, low + 0.29 * (high - low));
    EXPECT_LT(now, low + 0.71 * (high - low));
    EXPECT_EQ(first[i].target, second[i].target);
    EXPECT_EQ(first[i].integration_time, second[i].integration_time);
    EXPECT_NE(first[i].id, second[i].id);
    seen.insert(now);
  }
  EXPECT_EQ(seen.size(), levels.size()) << "what had one distance has one again";
}

/// Without jitter, a capture of the second campaign shows the first one's camera and effect at the new distance.
TEST(HiddenLike, ShowsTheSameEffectAtTheNewDistance) {
  const TemporaryFolder folder;
  CampaignOptions options;
  options.design = "small";
  options.frames = 1;
  options.output = Output::phases;
  options.noise = NoiseKind::none;
  options.seed = 11;
  options.effects.add_text("zero_offset:offset=30mm", 1, 1);
  options.effects.add_typical("fixed_pattern", 1, 1);
  options.folder = folder.path() / "first";
  make_campaign(options);
  CampaignOptions again = like(options.folder / "truth.yaml", 12);
  again.folder = folder.path() / "second";
  make_campaign(again);
  config::Diagnostics diagnostics;
  const std::vector<io::Condition> conditions =
      io::read_campaign(again.folder / "campaign.yaml", diagnostics).conditions;
  const PixelMaps maps = draw_maps({}, 11);
  const std::vector<io::Condition> targets = between(conditions_of("small", {}), 12);
  for (const std::size_t c : {0U, 9U}) {
    View view;
    view.distance = conditions[c].board_distance;
    view.integration_time = conditions[c].integration_time;
    view.reflectivity = std::ranges::find(targets, conditions[c].id, &io::Condition::id)->reflectivity;
    const Taps ideal = expected_taps(Physics{}, view);
    std::vector<std::int32_t> phases(4UL * 204 * 204);
    io::CaptureReader(conditions[c].capture).read(0, 0, phases.data());
    for (std::size_t i = 0; i < 204 * 204; i += 97) {
      const auto phasor = [&](const auto& sample) {
        return std::complex<double>(sample(0) - sample(2), sample(3) - sample(1)) / 2.0;
      };
      const std::complex<double> plain = phasor([&](std::size_t k) { return ideal.a[k][i] - ideal.b[k][i]; });
      const std::complex<double> seen =
          phasor([&](std::size_t k) { return static_cast<double>(phases[k * 204 * 204 + i]); });
      const double turn = (30e-3 + maps.fixed_pattern[i]) / Camera().metres_per_radian();
      EXPECT_NEAR(std::abs(seen - plain * std::polar(1.0, turn)), 0, 0.71) << "whole counts";
    }
  }
}

TEST(HiddenLike, MistakesAreNamed) {
  const TemporaryFolder folder;
  EXPECT_EQ(tests::shell(program + "--design small --frames 1 --seed 7 -o c", folder.path()).exit_code, 0);
  for (const auto& [arguments, words] : std::vector<std::pair<std::string, std::string>>{
           {"--like c/truth.yaml --seed 7 -o x", "--seed 7 is that of the campaign itself"},
           {"--like c/model.yaml --seed 8 -o x", "is not the truth.yaml of a campaign"},
           {"--like c/nothing.yaml --seed 8 -o x", "c/nothing.yaml"},
           {"--like c/truth.yaml --effect wiggling --seed 8 -o x", "--effect excludes --like"}}) {
    const tests::Outcome outcome = tests::shell(program + arguments, folder.path());
    EXPECT_NE(outcome.exit_code, 0) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr(words)) << arguments;
    EXPECT_FALSE(fs::exists(folder.path() / "x")) << arguments;
  }
}

}  // namespace
}  // namespace tofgraph::hidden
