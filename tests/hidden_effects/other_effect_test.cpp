// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: OtherEffect.IsNamedWhere*
// Rooms: diagnosis simulation plugins
// The search knows effects only by their declaration: an effect that tofgraph does not contain is unknown without its
// plugin and named with it, with its value, and other hidden effects are named beside it.
#include <gtest/gtest.h>

#include "tests/hidden_effects/campaign.hpp"
#include "tests/hidden_effects/patterns.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <set>

namespace tofgraph::hidden {
namespace {

constexpr double size = 3e-3;  // m

class OtherEffect : public testing::Test {
 protected:
  void hide(const std::string& effect = "") {
    CampaignOptions options;
    options.design = "small";
    options.every = 2;
    options.frames = 2;
    options.seed = 412;
    options.folder = folder_.path() / "campaign";
    options.patterns.push_back({"angular_ripple", size});
    if (!effect.empty()) options.effects.add_text(effect, 1, options.seed, Drawn::plain);
    make_campaign(options);
  }

  nlohmann::json search(const std::string& plugins) const {
    const tests::Outcome outcome = tests::shell(plugins +
                                                    " \"$TOFGRAPH\" diagnose --quiet --model campaign/model.yaml "
                                                    "--data campaign/campaign.yaml -o found --force",
                                                folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(tests::read_text(folder_.path() / "found/report.json"));
  }

  nlohmann::json search_with_it() const {
    return search("TOFGRAPH_PLUGIN_PATH='" TOFGRAPH_BINARY_DIR "/tests/other_effects'");
  }

  tests::TemporaryFolder folder_;
};

std::set<std::string> names(const nlohmann::json& report) {
  std::set<std::string> result;
  for (const auto& effect : report.at("effects")) result.insert(effect.at("name"));
  return result;
}

void expect_its_value(const nlohmann::json& report) {
  for (const auto& effect : report.at("effects")) {
    if (effect.at("name") != "angular_ripple") continue;
    const auto& amplitude = effect.at("parameters").at("amplitude");
    EXPECT_NEAR(amplitude.at("value"), size, 0.1e-3);
    EXPECT_LT(amplitude.at("low"), size);
    EXPECT_GT(amplitude.at("high"), size);
  }
}

TEST_F(OtherEffect, IsNamedWhereItsPluginIsThere) {
  hide();
  const nlohmann::json without = search("");
  EXPECT_EQ(without.at("verdict"), "unknown") << without.at("effects");
  EXPECT_EQ(names(without), std::set<std::string>());
  const nlohmann::json with = search_with_it();
  EXPECT_EQ(with.at("verdict"), "named");
  EXPECT_EQ(names(with), std::set<std::string>{"angular_ripple"});
  expect_its_value(with);
}

TEST_F(OtherEffect, IsNamedBesideAnother) {
  hide("wiggling");
  const nlohmann::json report = search_with_it();
  EXPECT_EQ(report.at("verdict"), "named");
  EXPECT_EQ(names(report), (std::set<std::string>{"angular_ripple", "wiggling"}));
  expect_its_value(report);
}

}  // namespace
}  // namespace tofgraph::hidden
