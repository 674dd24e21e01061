// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: DiagnoseLab.*
// Rooms: diagnosis cli
// A laboratory profile with a wrong contrast; a search with a time limit.
#include <gtest/gtest.h>

#include "tests/hidden_effects/campaign.hpp"
#include "tests/hidden_effects/hidden_report.hpp"
#include "tests/program.hpp"

#include <chrono>

namespace tofgraph::hidden {
namespace {

class DiagnoseLab : public testing::Test {
 protected:
  void hide(const std::vector<std::string>& effects) {
    CampaignOptions options;
    options.design = "small";
    options.seed = 413;
    options.frames = 2;
    options.folder = folder_.path() / "campaign";
    for (const std::string& effect : effects) options.effects.add_text(effect, 1, options.seed, Drawn::plain);
    make_campaign(options);
  }

  /// Sets the contrast in the profile of campaign and model; that of the camera is 0.5.
  void say_contrast(const std::string& contrast) {
    std::string profile = tests::read_text(TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml");
    replace(profile, "contrast: 0.5", "contrast: " + contrast);
    tests::write_text(folder_.path() / "campaign/wrong.yaml", profile);
    for (const char* file : {"campaign.yaml", "model.yaml"}) {
      std::string text = tests::read_text(folder_.path() / "campaign" / file);
      replace(text, "camera: camcube2", "camera: wrong.yaml");
      tests::write_text(folder_.path() / "campaign" / file, text);
    }
  }

  tests::Outcome search(const std::string& options) const {
    return tests::shell(
        "\"$TOFGRAPH\" diagnose --model campaign/model.yaml --data campaign/campaign.yaml -o found " + options,
        folder_.path());
  }
  nlohmann::json report() const {
    return nlohmann::json::parse(tests::read_text(folder_.path() / "found/report.json"));
  }

  static void replace(std::string& text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from << " in\n" << text;
    text.replace(at, from.size(), to);
  }

  tests::TemporaryFolder folder_;
};

TEST_F(DiagnoseLab, AContrastThatIsNotTheProfilesIsMeasuredAndMakesNoName) {
  hide({"wiggling:amplitude=6mm,phase=0.9rad", "crosstalk:real=500counts/s,imaginary=-380counts/s"});
  say_contrast("0.53");
  const tests::Outcome outcome = search("");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json said = report();
  EXPECT_EQ(names_in(said), (std::set<std::string>{"crosstalk", "wiggling"})) << said.at("summary");
  EXPECT_TRUE(said.at("unexplained").is_null()) << said.at("unexplained").dump(1);
  const nlohmann::json& contrast = said.at("nuisances").at("contrast");
  EXPECT_NEAR(contrast.at("value"), 0.5, 0.002);
  EXPECT_EQ(contrast.at("profile"), 0.53);
  EXPECT_NE(outcome.err.find("The profile's contrast is off: 0.53"), std::string::npos) << outcome.err;
  const nlohmann::json& gaps = said.at("verification");
  EXPECT_LT(gaps.at("all_data").at("written"), gaps.at("all_data").at("given"));
  EXPECT_LT(gaps.at("held_out").at("written"), gaps.at("held_out").at("given"));
}

TEST_F(DiagnoseLab, ATimeLimitEndsTheSearchAndTheGivenModelIsWritten) {
  hide({"wiggling:amplitude=6mm,phase=0.9rad"});
  const auto begin = std::chrono::steady_clock::now();
  const tests::Outcome outcome = search("--time-limit '400 ms'");
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (outcome.exit_code == 1) {  // a slow machine cannot even read the captures in that time
    EXPECT_NE(outcome.err.find("--time-limit"), std::string::npos) << outcome.err;
    return;
  }
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_LT(seconds, 10);
  const nlohmann::json said = report();
  EXPECT_TRUE(said.at("verification").at("time_limit_reached"));
  EXPECT_EQ(said.at("verification").at("time_limit"), 0.4);
  EXPECT_TRUE(said.at("effects").empty());
  EXPECT_NE(outcome.err.find("The time limit of 400 ms ended the search."), std::string::npos) << outcome.err;
  EXPECT_NE(tests::read_text(folder_.path() / "found/model.yaml").find("effects: []"), std::string::npos);
}

TEST_F(DiagnoseLab, ATimeLimitIsAPositiveQuantity) {
  for (const char* wrong : {"5", "'0 s'", "'5 mm'", "'-1 min'"}) {
    const tests::Outcome outcome =
        tests::shell(std::string("\"$TOFGRAPH\" diagnose --model m.yaml --data c.yaml -o found --time-limit ") + wrong,
                     folder_.path());
    EXPECT_EQ(outcome.exit_code, 2) << wrong << outcome.err;
    EXPECT_NE(outcome.err.find("--time-limit"), std::string::npos) << wrong << outcome.err;
  }
}

}  // namespace
}  // namespace tofgraph::hidden
