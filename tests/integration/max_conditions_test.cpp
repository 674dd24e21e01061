// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: MaxConditions.*
// Rooms: diagnosis cli simulation plugins
// Campaigns of which only some conditions are searched, and the others predicted.
#include "diagnosis/data/plausibility.hpp"
#include "tests/small_campaign.hpp"
#include "tests/unit/full_disk.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace tofgraph::diagnosis {
namespace {

using nlohmann::json;
using tests::read_text;

class MaxConditions : public tests::SmallCampaign {
 protected:
  static constexpr std::size_t searched = 8;

  static void SetUpTestSuite() {
    simulate(3, "taps");
    done(diagnose + "--max-conditions 8 -o found");
  }
  static inline const std::string diagnose = "$TOFGRAPH diagnose --quiet --model ideal.yaml --data c/campaign.yaml ";

  static json report(const std::string& folder) { return json::parse(read_text(home() / folder / "report.json")); }
  static io::Campaign campaign() {
    config::Diagnostics diagnostics;
    io::Campaign campaign = io::read_campaign(home() / "c/campaign.yaml", diagnostics);
    EXPECT_TRUE(diagnostics.ok()) << diagnostics.text();
    return campaign;
  }
};

TEST_F(MaxConditions, AreSearchedAndTheOthersPredictedBlindly) {
  const json found = report("found");
  ASSERT_EQ(found.at("effects").size(), 1U);
  EXPECT_EQ(found["effects"][0].at("name"), "wiggling");
  EXPECT_EQ(found.at("conditions").size(), searched);
  EXPECT_EQ(found.at("data").at("conditions"), conditions);
  const json& rest = found.at("unsearched");
  EXPECT_EQ(rest.at("conditions"), conditions - searched);

  // The model as written, compared with these conditions alone.
  std::string skip;
  for (const json& one : found["conditions"]) skip += (skip.empty() ? "" : ",") + one.at("id").get<std::string>();
  done(diagnose + "--max-effects 0 -o before --exclude-condition " + skip);
  done(
      "$TOFGRAPH diagnose --quiet --model found/model.yaml --data c/campaign.yaml --max-effects 0 -o after "
      "--exclude-condition " +
      skip);
  const double before = report("before").at("gap").at("before"), after = report("after").at("gap").at("before");
  const json& distance = rest.at("distance");
  EXPECT_NEAR(distance.at("before"), before, 1e-9 * before);
  EXPECT_NEAR(distance.at("after"), after, 1e-4 * after) << "model.yaml has rounded values";
  EXPECT_LT(after, 0.3 * before);
  EXPECT_LE(distance.at("low"), distance.at("after"));
  EXPECT_GE(distance.at("high"), distance.at("after"));
  EXPECT_NE(found.at("summary").get<std::string>().find("8 of 12 conditions were searched; the distance gap of the "
                                                        "other 4, to which nothing was fitted, goes from "),
            std::string::npos)
      << found["summary"];
  EXPECT_NE(read_text(home() / "found/report.html").find("gap, not searched, of"), std::string::npos);
}

TEST_F(MaxConditions, GiveTheSameReportForAnyNumberOfThreads) {
  done(diagnose + "--max-conditions 8 --threads 1 -o single");
  EXPECT_EQ(read_text(home() / "single/report.json"), read_text(home() / "found/report.json"));
}

TEST_F(MaxConditions, ChangeNothingIfTheCampaignHasNoMore) {
  done(diagnose + "--max-conditions 12 --max-effects 0 -o enough");
  done(diagnose + "--max-effects 0 -o all");
  EXPECT_EQ(read_text(home() / "enough/report.json"), read_text(home() / "all/report.json"));
  EXPECT_FALSE(report("all").contains("unsearched"));
}

TEST_F(MaxConditions, ConfidenceCasesOfAnotherNumberAreNotCounted) {
  const std::string case_1 = "--max-effects 1 --confidence 2 --shard 1/2 -o shared --max-conditions ";
  done(diagnose + case_1 + "8");
  const std::vector<std::string> of_8 = tests::listing(home() / "shared/cases");
  ASSERT_EQ(of_8.size(), 1U);
  done(diagnose + case_1 + "9");
  EXPECT_EQ(tests::listing(home() / "shared/cases").size(), 2U);
}

/// The camera has the same name, but another contrast.
TEST_F(MaxConditions, ConfidenceCasesOfAnEditedProfileAreNotCounted) {
  const auto replaced = [](const std::string& file, const std::string& before, const std::string& after) {
    std::string text = read_text(file);
    const std::size_t at = text.find(before);
    EXPECT_NE(at, std::string::npos) << file << "\n" << before;
    return at == std::string::npos ? text : text.replace(at, before.size(), after);
  };
  done("cp -r c edited");
  const std::string folder = (home() / "edited").string(),
                    profile = TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml";
  tests::write_text(folder + "/campaign.yaml",
                    replaced(folder + "/campaign.yaml", "camera: camcube2", "camera: lab.yaml"));
  tests::write_text(folder + "/model.yaml",
                    replaced((home() / "ideal.yaml").string(), "camera: camcube2", "camera: lab.yaml"));
  const std::string case_1 =
      "$TOFGRAPH diagnose --quiet --model edited/model.yaml --data edited/campaign.yaml "
      "--max-effects 1 --confidence 2 --shard 1/2 --max-conditions 8 -o profiles";
  tests::write_text(folder + "/lab.yaml", read_text(profile));
  done(case_1);
  EXPECT_EQ(tests::listing(home() / "profiles/cases").size(), 1U);
  done(case_1);
  EXPECT_EQ(tests::listing(home() / "profiles/cases").size(), 1U);
  tests::write_text(folder + "/lab.yaml", replaced(profile, "contrast: 0.5", "contrast: 0.48"));
  done(case_1);
  EXPECT_EQ(tests::listing(home() / "profiles/cases").size(), 2U);
}

TEST_F(MaxConditions, ThreeBoardsAreSearchedAtLeast) {
  io::Campaign capped = campaign();
  for (std::size_t i = 3; i < conditions; ++i) capped.conditions[i].lens = "capped";
  IngestOptions options;
  options.max_conditions = 3;  // the lens of at least one of three is capped
  try {
    measure(capped, options);
    ADD_FAILURE() << "searched";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("a larger --max-conditions searches more"), std::string::npos)
        << error.what();
  }
}

TEST_F(MaxConditions, WrongEntriesOfTheOthersAreFound) {
  IngestOptions options;
  options.max_conditions = searched;
  std::size_t others = 0;
  for (std::size_t i = 0; i < conditions; ++i) {
    io::Campaign wrong = campaign();
    wrong.conditions[i].board_distance *= 2;
    const Measurements measured = measure(wrong, options);
    EXPECT_EQ(measured.searched.size(), searched);
    if (std::ranges::binary_search(measured.searched, i)) continue;
    ++others;
    const std::vector<Contradiction> found = contradictions(measured);
    EXPECT_TRUE(std::ranges::any_of(found, [&](const Contradiction& one) { return one.condition == i; })) << i;
  }
  EXPECT_GT(others, 0U);
}

}  // namespace
}  // namespace tofgraph::diagnosis
