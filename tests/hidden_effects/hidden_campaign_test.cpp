// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: HiddenCampaign.IsTheSame*:HiddenCampaign.DistancesAre*:HiddenCampaign.BoardsStand*
// Rooms: io
// Campaigns with hidden effects: files accepted by the program, drawn settings of the correct size, no disclosed truth.
#include "io/campaign.hpp"
#include "io/captures/capture.hpp"
#include "tests/hidden_effects/campaign.hpp"
#include "tests/hidden_effects/designs.hpp"
#include "tests/program.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>

namespace tofgraph::hidden {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using tests::TemporaryFolder;

CampaignOptions options_for(const fs::path& folder) {
  CampaignOptions options;
  options.design = "small";
  options.frames = 2;
  options.seed = 5;
  options.folder = folder;
  return options;
}

io::Campaign campaign_in(const fs::path& folder) {
  config::Diagnostics diagnostics;
  io::Campaign campaign = io::read_campaign(folder / "campaign.yaml", diagnostics);
  EXPECT_TRUE(diagnostics.ok()) << diagnostics.text();
  return campaign;
}

TEST(HiddenCampaign, IsAcceptedAndTellsNothing) {
  const TemporaryFolder folder;
  CampaignOptions options = options_for(folder.path() / "c");
  options.experiments = {"capped", "single_sources", "velocity"};
  options.effects.add_typical("wiggling", 1, 5);
  make_campaign(options);
  const tests::Outcome outcome =
      tests::shell("$TOFGRAPH check c/campaign.yaml && $TOFGRAPH check c/model.yaml", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* file : {"c/campaign.yaml", "c/model.yaml"}) {
    const std::string told = tests::read_text(folder.path() / file);
    EXPECT_THAT(told, testing::Not(HasSubstr("wiggling")));
    EXPECT_THAT(told, testing::Not(HasSubstr("reflectivity")));
  }
  const std::string truth = tests::read_text(folder.path() / "c/truth.yaml");
  EXPECT_THAT(truth, HasSubstr("{effect: wiggling, amplitude: 0.005"));
  const io::Campaign campaign = campaign_in(folder.path() / "c");
  ASSERT_EQ(campaign.conditions.size(), 36U + 4 + 8 + 12);
  for (std::size_t order = 0; order < campaign.conditions.size(); ++order) {
    const io::Condition& condition = campaign.conditions[order];
    EXPECT_EQ(condition.order.value(), order);
    EXPECT_THAT(truth, HasSubstr(fmt::format("{{id: {}, order: {}, ", condition.id, order)));
    const io::CaptureReader capture(condition.capture);
    EXPECT_EQ(capture.frames(), 2U);
    EXPECT_EQ(capture.channels().at(0).name, "taps");
    EXPECT_EQ(capture.metadata(0).integration_time, condition.integration_time);
  }
  EXPECT_FALSE(std::ranges::is_sorted(campaign.conditions, {}, &io::Condition::id)) << "as measured, not as designed";
  EXPECT_THROW(make_campaign(options), std::runtime_error) << "the folder is there";
}

std::vector<std::int32_t> phases_of(const fs::path& file) {
  std::vector<std::int32_t> phases(4UL * 204 * 204);
  io::CaptureReader(file).read(0, 0, phases.data());
  return phases;
}

TEST(HiddenCampaign, IsTheSameForOneSeedAndAnyThreads) {
  const TemporaryFolder folder;
  for (const std::size_t threads : {1U, 2U}) {
    CampaignOptions options = options_for(folder.path() / std::to_string(threads));
    options.noise = NoiseKind::heavy;
    options.frames = 1;
    options.output = Output::phases;
    options.threads = threads;
    make_campaign(options);
  }
  for (const char* file : {"campaign.yaml", "model.yaml", "truth.yaml"})
    EXPECT_EQ(tests::read_text(folder.path() / "1" / file), tests::read_text(folder.path() / "2" / file));
  for (const io::Condition& condition : campaign_in(folder.path() / "1").conditions) {
    const fs::path other = folder.path() / "2" / "captures" / condition.capture.filename();
    EXPECT_TRUE(phases_of(condition.capture) == phases_of(other)) << condition.id;
  }
}

/// The same noise in both: the distance is given by the phase of the samples on the circle, the amplitude by half of
/// the longest side of their triangle.
TEST(HiddenCampaign, DistancesAreThoseOfThePhases) {
  const TemporaryFolder folder;
  std::map<Output, io::Campaign> made;
  for (const Output output : {Output::phases, Output::distances}) {
    CampaignOptions options = options_for(folder.path() / std::to_string(static_cast<int>(output)));
    options.frames = 1;
    options.output = output;
    make_campaign(options);
    made[output] = campaign_in(options.folder);
  }
  constexpr double range = 299792458.0 / (2 * 20e6);  // m
  for (std::size_t i = 0; i < made[Output::phases].conditions.size(); ++i) {
    const std::vector<std::int32_t> phases = phases_of(made[Output::phases].conditions[i].capture);
    const io::CaptureReader capture(made[Output::distances].conditions[i].capture);
    const std::size_t pixels = phases.size() / 4;
    std::vector<float> distance(pixels), amplitude(pixels);
    for (std::size_t c = 0; c < 2; ++c)
      capture.read(c, 0, capture.channels()[c].name == "distance" ? distance.data() : amplitude.data());
    for (std::size_t p = 0; p < pixels; p += 501) {
      const double real = phases[p] - phases[2 * pixels + p], imaginary = phases[3 * pixels + p] - phases[pixels + p];
      EXPECT_GE(distance[p], 0);
      EXPECT_LT(distance[p], range * (1 + 1e-6));
      // A phasor rotated back by its own distance is real and positive.
      const std::complex<double> back =
          std::complex(real, imaginary) * std::polar(1.0, -2 * M_PI * distance[p] / range);
      EXPECT_NEAR(back.real(), 2.0 * amplitude[p], 1e-4 * amplitude[p]);
      EXPECT_NEAR(back.imag(), 0, 1e-5 * std::abs(back) + 1e-9);
    }
  }
}

/// Errors on the axis in every bright condition's capture, relative to the campaign, m.
std::vector<double> errors_on_axis(const fs::path& folder) {
  std::vector<double> errors;
  for (const io::Condition& condition : campaign_in(folder).conditions) {
    const std::vector<std::int32_t> phases = phases_of(condition.capture);
    std::array<double, 4> c{};  // mean of 10 x 10 pixels
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t row = 97; row < 107; ++row)
        for (std::size_t column = 97; column < 107; ++column) c[k] += phases[(k * 204 + row) * 204 + column] / 100.0;
    if (std::hypot(c[3] - c[1], c[0] - c[2]) / 2 < 500) continue;
    const double radians = std::atan2(c[3] - c[1], c[0] - c[2]), z = condition.board_distance;
    const double distance = Camera().metres_per_radian() * (radians < 0 ? radians + 2 * M_PI : radians);
    errors.push_back(distance - (z + std::hypot(0.05, z)) / 2);  // half path of a pixel on the axis
  }
  return errors;
}

double deviation(const std::vector<double>& values) {
  double mean = 0, squares = 0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

TEST(HiddenCampaign, BoardsStandWhereTheJitterPutsThem) {
  const TemporaryFolder folder;
  std::map<int, std::vector<double>> errors;
  for (const int jitter : {0, 20}) {
    CampaignOptions options = options_for(folder.path() / std::to_string(jitter));
    options.jitter = options.light_jitter = jitter;
    options.frames = 1;
    options.output = Output::phases;
    make_campaign(options);
    errors[jitter] = errors_on_axis(options.folder);
  }
  ASSERT_GE(errors[20].size(), 10U);
  const double known_to =
      1 / std::sqrt(2.0 * static_cast<double>(errors[20].size()));  // of a standard deviation of n draws
  EXPECT_NEAR(deviation(errors[20]) / (20 * 0.5e-3), 1, 3 * known_to);
  // 500 counts and noise of 6 counts per sample: 10 mm per pixel, 1 mm for 100 of them.
  EXPECT_LT(deviation(errors[0]), 1e-3);
}

TEST(HiddenCampaign, EveryNameOfTheListsWorks) {
  for (const NamedConditions& design : designs()) {
    const bool grid = design.name.starts_with("lab");
    EXPECT_GE(design.make().size(), grid ? 25U : 30U) << design.name;
    EXPECT_LE(design.make().size(), grid ? 300U : 110U) << design.name;
  }
  for (const NamedConditions& experiment : experiments()) EXPECT_GE(experiment.make().size(), 4U) << experiment.name;
  EXPECT_EQ(catalogue().size(), 35U);
  for (const PatternKind& kind : pattern_catalogue()) {
    const Pattern pattern = parse_pattern(kind.name, 2);
    EXPECT_EQ(pattern.size, 2 * kind.typical);
    View near, far;
    near.distance = 0.8;
    near.integration_time = 0.5e-3;
    far.distance = 3.1;
    far.earlier_distance = 0.8;
    far.integration_time = 4e-3;
    bool acts = false;
    for (int row = 0; row < 204; row += 17)
      for (int column = 0; column < 204; column += 17)
        acts |= distance_error(pattern, near, column, row) != distance_error(pattern, far, column, row) ||
                light_factor(pattern, near, column, row) != light_factor(pattern, far, column, row);
    EXPECT_TRUE(acts) << kind.name;
  }
}

TEST(HiddenCampaign, MistakesAreNamed) {
  const TemporaryFolder folder;
  const std::string program = TOFGRAPH_BINARY_DIR "/tests/hidden_effects_make ";
  for (const auto& [arguments, words] : std::map<std::string, std::string>{
           {"-o x --effect wigling", "there is no effect 'wigling'"},
           {"-o x --effect wiggling:size=5mm", "the effect wiggling has no parameter 'size'"},
           {"-o x --effect wiggling:amplitude=5", "amplitude of wiggling: "},
           {"-o x --pattern stripes", "there is no pattern 'stripes'"},
           {"-o x --design D", "there is no design 'D'"},
           {"-o x --add warmup", "there is no experiment 'warmup'"},
           {"", "-o DIR is missing"}}) {
    const tests::Outcome outcome = tests::shell(program + arguments, folder.path());
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_TRUE(fs::is_empty(folder.path())) << arguments;
  }
}

}  // namespace
}  // namespace tofgraph::hidden
