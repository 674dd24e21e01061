// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: */InAnotherOrder:*/Five:*/Eight
// Rooms: diagnosis simulation plugins
// Cameras whose frames are not the four steps of 90 degrees: hidden effects are named with their values.
#include <gtest/gtest.h>

#include "tests/hidden_effects/campaign.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

namespace tofgraph::hidden {
namespace {

struct Case {
  const char* name;
  std::vector<double> degrees;
  Output output;
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

class OtherExposures : public testing::TestWithParam<Case> {};

TEST_P(OtherExposures, AreSearched) {
  const tests::TemporaryFolder folder;
  CampaignOptions options;
  options.design = "small";
  options.every = 2;
  options.frames = 2;
  options.seed = 733;
  options.folder = folder.path() / "campaign";
  options.output = GetParam().output;
  options.steps.clear();
  for (const double degrees : GetParam().degrees) options.steps.push_back(degrees * M_PI / 180);
  options.effects.add("wiggling", {{"amplitude", 6e-3}, {"phase", 0.9}});
  options.effects.add("temporal_noise", {{"factor", 2}});
  make_campaign(options);
  const tests::Outcome outcome =
      tests::shell("\"$TOFGRAPH\" diagnose --quiet --model campaign/model.yaml --data campaign/campaign.yaml -o found",
                   folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json report = nlohmann::json::parse(tests::read_text(folder.path() / "found/report.json"));
  ASSERT_EQ(report.at("effects").size(), 1U) << report.at("summary");
  EXPECT_EQ(report.at("effects")[0].at("name"), "wiggling");
  EXPECT_EQ(report.at("verdict"), "named") << report.at("summary");
  const auto& amplitude = report.at("effects")[0].at("parameters").at("amplitude");
  EXPECT_NEAR(amplitude.at("value"), 6e-3, 0.3e-3);
  // Read and shot noise of the individual camera are within 30 % of the profile's.
  EXPECT_GT(report.at("noise").at("over_profile"), 2 * 0.75);
  EXPECT_LT(report.at("noise").at("over_profile"), 2 * 1.25);
}

INSTANTIATE_TEST_SUITE_P(OfAFrame, OtherExposures,
                         testing::Values(Case{"InAnotherOrder", {0, 180, 90, 270}, Output::taps},
                                         Case{"Three", {0, 120, 240}, Output::phases},
                                         Case{"Five", {0, 72, 144, 216, 288}, Output::taps},
                                         Case{"Eight", {0, 45, 90, 135, 180, 225, 270, 315}, Output::taps}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace tofgraph::hidden
