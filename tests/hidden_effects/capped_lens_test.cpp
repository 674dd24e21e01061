// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Hidden/CappedLens.*
// Rooms: diagnosis simulation plugins
// Light leaking inside the camera and light from a fixed object in front of it cannot be distinguished with boards. A
// capped lens distinguishes them: reports propose it, and the search uses it.
#include <gtest/gtest.h>

#include "tests/hidden_effects/campaign.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

namespace tofgraph::hidden {
namespace {

struct Case {
  const char* effect;
  Output output;
};
void PrintTo(const Case& one, std::ostream* out) { *out << one.effect << " in " << static_cast<int>(one.output); }

/// Conditions of a campaign by their number in the design, [first, last), as a command line option.
std::string conditions(const std::filesystem::path& campaign, const std::string& first, const std::string& last) {
  std::string ids;
  for (const auto& file : std::filesystem::directory_iterator(campaign / "captures")) {
    const std::string id = file.path().stem().string();
    if (id >= first && id < last) ids += (ids.empty() ? "" : ",") + id;
  }
  return ids;
}

class CappedLens : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    CampaignOptions options;
    options.design = "small";
    options.every = 2;
    options.experiments = {"capped"};
    options.frames = 2;
    options.seed = 8806;
    options.output = GetParam().output;
    options.folder = folder_.path() / "campaign";
    const std::string effect = GetParam().effect;
    if (effect == "crosstalk") options.effects.add(effect, {{"real", 1200}, {"imaginary", 700}});
    if (effect == "static_reflection") options.effects.add(effect, {{"strength", 1400}, {"distance", 0.3}});
    make_campaign(options);
  }

  nlohmann::json search(const std::string& out, const std::string& options) const {
    const tests::Outcome outcome =
        tests::shell("\"$TOFGRAPH\" diagnose --quiet --model campaign/model.yaml --data campaign/campaign.yaml -o " +
                         out + " " + options,
                     folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(tests::read_text(folder_.path() / out / "report.json"));
  }

  tests::TemporaryFolder folder_;
};

TEST_P(CappedLens, TellsWhatIsInsideTheCamera) {
  const std::string effect = GetParam().effect;
  if (!effect.empty()) {
    const nlohmann::json open = search("open", "--skip " + conditions(folder_.path() / "campaign", "018", "022"));
    EXPECT_EQ(open.at("verdict"), "tie") << open.at("summary");
    EXPECT_EQ(open.at("next").at(0).at("condition").at("lens"), "capped");
    const tests::Outcome next =
        tests::shell("\"$TOFGRAPH\" simulate open/next_condition.yaml -o next.h5", folder_.path());
    EXPECT_EQ(next.exit_code, 0) << next.err;
  }
  const nlohmann::json capped = search("capped", effect.empty() ? "" : "--resample 2");
  if (effect.empty()) {
    EXPECT_EQ(capped.at("verdict"), "nothing_found") << capped.at("summary");
    return;
  }
  EXPECT_EQ(capped.at("verdict"), "named") << capped.at("summary");
  ASSERT_EQ(capped.at("effects").size(), 1U) << capped.at("summary");
  EXPECT_EQ(capped.at("effects")[0].at("name"), effect);
  EXPECT_EQ(capped.at("effects")[0].at("tied_with"), nlohmann::json::array());
  std::size_t without_gap = 0;
  for (const auto& condition : capped.at("conditions")) without_gap += condition.at("held_out_gap_before").is_null();
  EXPECT_EQ(without_gap, 4U) << "they show no board";
  EXPECT_EQ(capped.at("resampled").size(), 3U);
  for (const auto& again : capped.at("resampled")) EXPECT_TRUE(again.at("gap_after").is_number()) << again;
  EXPECT_EQ(capped.at("conditions").size(), 22U) << "none is left out";
}

TEST(CappedLensCampaign, AloneTellsNothingOfBoards) {
  const tests::TemporaryFolder folder;
  CampaignOptions options;
  options.design = "small";
  options.every = 2;
  options.experiments = {"capped"};
  options.frames = 1;
  options.seed = 8807;
  options.folder = folder.path() / "campaign";
  make_campaign(options);
  const tests::Outcome outcome = tests::shell(
      "\"$TOFGRAPH\" diagnose --quiet --model campaign/model.yaml --data campaign/campaign.yaml -o found --skip " +
          conditions(options.folder, "002", "018"),
      folder.path());
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("2 conditions can be used, and a search needs 3"), std::string::npos) << outcome.err;
}

INSTANTIATE_TEST_SUITE_P(Hidden, CappedLens,
                         testing::Values(Case{"crosstalk", Output::taps}, Case{"static_reflection", Output::taps},
                                         Case{"crosstalk", Output::distances}, Case{"", Output::phases}),
                         [](const auto& info) {
                           const std::string effect = info.param.effect;
                           return (effect.empty() ? std::string("nothing") : effect) + "_" + std::to_string(info.index);
                         });

}  // namespace
}  // namespace tofgraph::hidden
