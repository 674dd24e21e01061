// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Compiled correction tables converted to bytes and back.
#include <gtest/gtest.h>

#include "simulation/correction_cache.hpp"

using namespace tofgraph::simulation;

namespace {

std::shared_ptr<const CorrectionTables> some_tables() {
  auto made = std::make_shared<CorrectionTables>();
  CorrectionTables& tables = *made;
  tables.lanes = 8;
  tables.distances = 3;
  tables.amplitudes = 2;
  tables.first = 0.25;
  tables.step = 0.1;
  tables.range = 7.5;
  tables.shifts = {0.5F, -0.25F};
  tables.weakest = 8;
  tables.strongest = 4096;
  tables.pixels = {1, 2, 3, 4, 5};
  tables.corners = {{1, 2}, {}, {3}};
  tables.worst = 1e-6;
  tables.needs = {.amplitude = true, .integration_time = true, .temperature = false, .time_since_power_on = true};
  tables.integration_time = 1e-3;
  tables.modulation_frequency = 20e6;
  tables.ends = {{{0, 3600}, {298, 298}}};
  tables.steps = {12, 1};
  return made;
}

TEST(CorrectionCache, TablesSurviveTheWayToBytesAndBack) {
  const auto again = tables_from_bytes(to_bytes(*some_tables()));
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(again->lanes, 8U);
  EXPECT_EQ(again->shifts, some_tables()->shifts);
  EXPECT_EQ(again->pixels, some_tables()->pixels);
  EXPECT_EQ(again->corners, some_tables()->corners);
  EXPECT_EQ(again->ends, some_tables()->ends);
  EXPECT_EQ(again->range, 7.5);
  EXPECT_TRUE(again->covers({.integration_time = 1e-3, .time_since_power_on = 60}));
  EXPECT_FALSE(again->covers({.integration_time = 2e-3, .time_since_power_on = 60}));
  EXPECT_EQ(to_bytes(*again), to_bytes(*some_tables()));
}

TEST(CorrectionCache, BytesThatWereChangedOrCutOffAreNoTables) {
  const std::string bytes = to_bytes(*some_tables());
  for (const std::size_t length : {std::size_t{0}, std::size_t{10}, bytes.size() / 2, bytes.size() - 1})
    EXPECT_EQ(tables_from_bytes(bytes.substr(0, length)), nullptr) << length;
  for (const std::size_t place : {std::size_t{3}, std::size_t{40}, bytes.size() - 3}) {
    std::string changed = bytes;
    changed[place] = static_cast<char>(changed[place] ^ 1);
    EXPECT_EQ(tables_from_bytes(changed), nullptr) << place;
  }
}

}  // namespace
