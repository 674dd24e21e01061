// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

namespace tofgraph {
namespace {

Harness with_channels(const std::string& stage) { return Harness("channels " + stage); }

void put_three(Harness& stage) {
  stage.put<float>("distance", {1, 2}, {1, 2}, {.applied = "own", .from = "phases"});
  stage.put<float>("sigma", {1, 2}, {0.1F, 0.2F}, {.of = "distance"});
  stage.put<float>("amplitude", {1, 2}, {10, 20});
}

std::string refusal(const std::string& parameters) {
  try {
    Harness stage = with_channels(parameters);
    put_three(stage);
    stage.run();
    return "";
  } catch (const std::exception& error) {
    return error.what();
  }
}

TEST(Channels, ThoseThatAreDroppedDoNotLeave) {
  Harness stage = with_channels("drop=[sigma, amplitude]");
  put_three(stage);
  stage.run();
  EXPECT_TRUE(stage.has("distance"));
  EXPECT_FALSE(stage.has("sigma"));
  EXPECT_FALSE(stage.has("amplitude"));
  EXPECT_EQ(stage.applied("distance"), "own") << "what stays is not touched";
}

TEST(Channels, OnlyThoseThatAreKeptLeave) {
  Harness stage = with_channels("keep=[amplitude]");
  put_three(stage);
  stage.run();
  EXPECT_FALSE(stage.has("distance"));
  EXPECT_EQ(stage.get<float>("amplitude"), (std::vector<float>{10, 20}));
}

TEST(Channels, ARenamedOneKeepsContentMeaningAndItsSigma) {
  Harness stage = with_channels("rename=[distance=distance_short]");
  put_three(stage);
  for (int frame = 0; frame < 2; ++frame) {
    stage.run();
    EXPECT_FALSE(stage.has("distance"));
    EXPECT_EQ(stage.get<float>("distance_short"), (std::vector<float>{1, 2}));
  }
  EXPECT_EQ(stage.applied("distance_short"), "own");
  EXPECT_EQ(stage.of("sigma"), "distance_short");
}

TEST(Channels, SaysWhatCannotBe) {
  EXPECT_NE(refusal("").find("there is nothing to do: give keep, drop or rename"), std::string::npos);
  EXPECT_NE(refusal("drop=[depth]").find("there is no 'depth'; the input has distance, sigma, amplitude"),
            std::string::npos);
  EXPECT_NE(refusal("keep=[sigma] drop=[sigma]").find("exclude each other"), std::string::npos);
  EXPECT_NE(refusal("rename=[distance]").find("'distance' is not of the form old=new"), std::string::npos);
  EXPECT_NE(refusal("rename=[distance=sigma]").find("there is a channel 'sigma' already"), std::string::npos);
  EXPECT_NE(refusal("drop=[distance] rename=[distance=other]").find("'distance' is removed"), std::string::npos);
  EXPECT_NE(refusal("rename=[distance=a@b]").find("a name must not contain @"), std::string::npos);
}

}  // namespace
}  // namespace tofgraph
