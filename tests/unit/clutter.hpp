// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A rail whose conditions have nuisances of their own, for tests of the search.
#pragma once

#include "tests/unit/rail.hpp"

#include <array>
#include <set>

namespace tofgraph::diagnosis {

class Clutter : public Rail {
 protected:
  /// Keeps a few candidates, which suffice here.
  void keep_few() {
    const std::set<std::string> kept = {"wiggling",        "crosstalk",   "source_position",
                                        "lens_distortion", "zero_offset", "integration_time_offset",
                                        "principal_point"};
    std::erase_if(candidates, [&](const auto& c) { return !kept.contains(c->name()); });
  }
  void SetUp() override {
    Rail::SetUp();
    keep_few();
  }

  /// Data with extra distance. @param more by condition and superpixel, m
  template <class F> std::vector<Observations> shifted(std::vector<Observations> data, F more) const {
    const std::size_t n = design->superpixels();
    for (std::size_t i = 0; i < data.size(); ++i) {
      for (std::size_t s = 0; s < n; ++s) data[i].value[distance * n + s] += more(i, s);
    }
    return data;
  }

  SearchResult searched(const std::vector<Observations>& data) const {
    return search(make_problem(*design, data), {}, candidates, {});
  }

  /// Expects wiggling alone with its true values, undisturbed by the clutter.
  void expect_wiggling_alone(const SearchResult& result, const std::vector<double>& truth) const {
    ASSERT_EQ(names(result), std::vector<std::string>{"wiggling"});
    EXPECT_TRUE(result.rest.empty()) << name_of(result.rest.front());
    EXPECT_EQ(result.patterns_without_axis(), 0U);
    EXPECT_NEAR(result.after.state.terms[0].values[0], truth[0], 4e-4);
    EXPECT_NEAR(result.after.state.terms[0].values[1], truth[1], 0.1);
  }

  static constexpr std::array<double, 2> wiggle = {5e-3, 0.4};
  std::vector<Term> wiggling() const { return {{&effect("wiggling"), {wiggle.begin(), wiggle.end()}}}; }
};

}  // namespace tofgraph::diagnosis
