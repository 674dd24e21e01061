// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: diagnosis
// Choice of the conditions of a large campaign that are searched.
#include "diagnosis/data/design.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <string>

namespace tofgraph::diagnosis {
namespace {

using Conditions = std::vector<io::Condition>;

io::Condition board(double distance, const std::string& target, double time) {
  io::Condition condition;
  condition.board_distance = distance;
  condition.target = target;
  condition.integration_time = time;
  return condition;
}

/// 3 targets, 4 integration times, 50 distances, and 3 conditions with the lens capped.
Conditions campaign() {
  Conditions all;
  for (const char* target : {"white", "grey", "black"}) {
    for (const double time : {0.5e-3, 1e-3, 2e-3, 4e-3}) {
      for (int d = 0; d < 50; ++d) all.push_back(board(0.5 + 0.05 * d, target, time));
    }
  }
  for (const double time : {0.5e-3, 1e-3, 2e-3}) {
    all.push_back(board(std::nan(""), "", time));
    all.back().lens = "capped";
  }
  for (std::size_t i = 0; i < all.size(); ++i) all[i].id = "c" + std::to_string(i);
  return all;
}

template <class Level> std::map<Level, std::size_t> levels_of(const Conditions& all, const std::vector<std::size_t>& of,
                                                              Level io::Condition::*setting) {
  std::map<Level, std::size_t> levels;
  for (const std::size_t i : of) ++levels[all[i].*setting];
  return levels;
}

std::set<std::string> ids_of(const Conditions& all, std::size_t count) {
  std::set<std::string> ids;
  for (const std::size_t i : representative_conditions(all, count)) ids.insert(all[i].id);
  return ids;
}

TEST(Representative, HasTheWantedNumberAscending) {
  const Conditions all = campaign();
  for (const std::size_t count : {3U, 14U, 15U, 16U, 100U, 602U}) {
    const std::vector<std::size_t> chosen = representative_conditions(all, count);
    EXPECT_EQ(chosen.size(), count);
    EXPECT_TRUE(std::ranges::is_sorted(chosen));
    EXPECT_EQ(std::set(chosen.begin(), chosen.end()).size(), count) << "none twice";
  }
  for (const std::size_t count : {603U, 604U}) EXPECT_EQ(representative_conditions(all, count).size(), 603U);
}

TEST(Representative, DividesTheNumberEquallyAmongSettings) {
  const Conditions all = campaign();
  const std::vector<std::size_t> chosen =
      representative_conditions(all, 63);  // 5 of each setting, and the 3 capped ones
  std::map<std::pair<std::string, double>, std::set<double>> distances;
  for (const std::size_t i : chosen)
    if (!all[i].is_capped()) distances[{all[i].target, all[i].integration_time}].insert(all[i].board_distance);
  EXPECT_EQ(levels_of(all, chosen, &io::Condition::lens)["capped"], 3U) << "a small group enters whole";
  ASSERT_EQ(distances.size(), 12U);
  std::set<double> together;
  for (const auto& [setting, seen] : distances) {
    ASSERT_EQ(seen.size(), 5U) << setting.first;
    together.insert(seen.begin(), seen.end());
    double before = *seen.begin();
    for (const double distance : seen) {
      EXPECT_LE(distance - before, 1.0) << "of 2.45 m, 0.5 m on average";
      before = distance;
    }
  }
  EXPECT_GE(together.size(), 30U) << "the settings have different distances";
  EXPECT_LE(*together.begin(), 0.6);
  EXPECT_GE(*together.rbegin(), 2.85);
}

TEST(Representative, HasEveryLevelIfThereAreMoreSettingsThanPlaces) {
  Conditions all;
  for (const char* target : {"white", "light", "dark", "black"}) {
    for (int time = 1; time <= 20; ++time) {
      for (const double distance : {1.0, 2.0, 3.0}) all.push_back(board(distance, target, 1e-4 * time));
    }
  }
  all.push_back(all.back());
  all.back().lens = "capped";
  const std::vector<std::size_t> chosen = representative_conditions(all, 40);  // of 81 settings
  EXPECT_EQ(levels_of(all, chosen, &io::Condition::lens)["capped"], 1U);
  const auto times = levels_of(all, chosen, &io::Condition::integration_time);
  EXPECT_EQ(times.size(), 20U);
  for (const auto& [time, count] : times) EXPECT_NEAR(static_cast<double>(count), 2, 1) << time;
  const auto targets = levels_of(all, chosen, &io::Condition::target);
  EXPECT_EQ(targets.size(), 4U);
  for (const auto& [target, count] : targets) EXPECT_NEAR(static_cast<double>(count), 10, 1) << target;
}

TEST(Representative, DependsNeitherOnTheOrderInTheFileNorOnChance) {
  Conditions all = campaign();
  std::mt19937_64 random(5);
  for (io::Condition& condition : all) condition.order = random() % 1000;
  const std::set<std::string> few = ids_of(all, 8), many = ids_of(all, 200);
  for (int k = 0; k < 5; ++k) {
    std::ranges::shuffle(all, random);
    EXPECT_EQ(ids_of(all, 8), few);
    EXPECT_EQ(ids_of(all, 200), many);
  }
}

TEST(Representative, TemperatureThatDiffersInEveryConditionDoesNotDivide) {
  Conditions all = campaign();
  for (std::size_t i = 0; i < all.size(); ++i) all[i].temperature = 300 + 0.01 * static_cast<double>(i);
  std::map<std::pair<std::string, double>, std::size_t> settings;
  for (const std::size_t i : representative_conditions(all, 63)) ++settings[{all[i].target, all[i].integration_time}];
  for (const char* target : {"white", "grey", "black"}) {
    for (const double time : {0.5e-3, 1e-3, 2e-3, 4e-3}) EXPECT_EQ((settings[{target, time}]), 5U) << target << time;
  }
}

TEST(Representative, TenthRepeatsOthersIfSomeWereRepeated) {
  Conditions all = campaign();
  const std::size_t once = all.size();
  for (int k = 0; k < 2; ++k)
    for (std::size_t i = 0; i < once; ++i) all.push_back(all[i]), all.back().id += "r" + std::to_string(k);
  const auto different = [&](std::size_t count) {
    std::set<std::string> settings;
    const std::vector<std::size_t> chosen = representative_conditions(all, count);
    EXPECT_EQ(chosen.size(), count);
    for (const std::size_t i : chosen) settings.insert(settings_of(all[i]));
    return settings.size();
  };
  EXPECT_EQ(different(200), 180U);
  EXPECT_EQ(different(1000), once) << "more places than settings: all of them";
}

}  // namespace
}  // namespace tofgraph::diagnosis
